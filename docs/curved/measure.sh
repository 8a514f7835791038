#!/usr/bin/env bash
# Writes the table and the picture of docs/curved.md; takes a few minutes on two cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

source docs/tables.sh

SLIPSTICK_TABLES=$work cargo test --release -p slipstick --test suite curved::table_of_fits -- --ignored
put docs/curved.md fits "$work/fits.md"
python3 docs/curved/picture.py "$work/fits.md" docs/figures/fits.svg
