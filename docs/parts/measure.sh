#!/usr/bin/env bash
# Takes twenty designs to parts and puts the table between the marks of docs/tutorials/part.md; eight
# minutes on two cores.
#
#   docs/parts/measure.sh
#
# It needs Python with Gmsh and meshio (pip install gmsh meshio).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

source docs/tables.sh
python3 docs/parts/designs.py --slipstick "$programs/slipstick" --out "$work/designs" > "$work/designs.md"
put docs/tutorials/part.md designs "$work/designs.md"
