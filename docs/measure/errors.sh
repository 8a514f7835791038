#!/usr/bin/env bash
# Writes the table of docs/errors.md: the codes that `slipstick explain` lists, with their meaning. Needs a
# release build of slipstick, and Python.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

source docs/measure/tables.sh

"$programs/slipstick" explain --json | python3 -c '
import json, sys

print("| code | what it means |\n|---|---|")
for line in sys.stdin:
    of = json.loads(line)
    cells = of["code"].split("::")[-1], of["about"]
    print("| `{}` | {} |".format(*(cell.replace("|", "\\|") for cell in cells)))
' >"$work/codes"
put docs/errors.md codes "$work/codes"
