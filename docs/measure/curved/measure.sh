#!/usr/bin/env bash
# Writes the tables and the picture of docs/measurements/curved.md; takes a few minutes on two cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh

SLIPSTICK_TABLES=$work cargo test --release -p slipstick --test suite -- --ignored curved::table_of_fits hertz::table_of_hertz
for name in fits hertz; do
    put docs/measurements/curved.md "$name" "$work/$name.md"
done
python3 docs/measure/curved/picture.py "$work/fits.md" docs/figures/fits.svg
