"""The program ``slipstick``, which the wheel installs."""

from __future__ import annotations

import sys

from . import _slipstick


def main() -> int:
    """Run the program with the arguments of this process; returns its exit code."""
    # studies start the program again for each of their entries
    launcher = [sys.executable, "-m", "slipstick"]
    return _slipstick.main(["slipstick", *sys.argv[1:]], launcher)


if __name__ == "__main__":
    sys.exit(main())
