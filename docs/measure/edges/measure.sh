#!/usr/bin/env bash
# Writes the tables of docs/measurements/edges.md between the markers of that page; takes a few minutes on one core.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh

SLIPSTICK_TABLES=$work cargo test --release -p slipstick --test suite edges::study:: -- --ignored
for name in refinement overlaps meshes ssnp503 sharp; do
    put docs/measurements/edges.md "$name" "$work/$name.md"
done
