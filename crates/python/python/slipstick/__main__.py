"""``python -m slipstick`` is the program ``slipstick``."""

import sys

from ._program import main

sys.exit(main())
