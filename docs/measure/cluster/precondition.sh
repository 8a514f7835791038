#!/usr/bin/env bash
# Compares the contact-zone preconditioner with MUMPS on tangents of real designs and inserts the table between the
# markers of docs/measurements/cluster.md. About ten minutes on two idle cores, most of it for a design of the half-ball in the size of
# the paper; `precondition.sh RESULTS` uses the latest design of a run of that case instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
cargo build --release -p slipstick -p slipstick-cli -p slipstick-petsc --features slipstick-cli/petsc \
    --bin slipstick --example export_matrix --example precondition
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 RAYON_NUM_THREADS=1

# Tangent of a case with a given design, at the end of its path.
tangent() { "$programs/examples/export_matrix" "$1" "$2" "$work/$3.bin" >&2; }

measured() {
    echo "$2"
    for ranks in 1 2; do
        for method in mumps zone; do
            mpirun --oversubscribe --bind-to none --mca mpi_yield_when_idle 1 -n "$ranks" "$programs/examples/precondition" \
                "$work/$1.bin" "$method"
        done
    done
}

designs() {
    local ball=cases/half_ball_on_plate clutch=cases/clutch/coarse.toml
    "$programs/slipstick" optimize $ball/coarse.toml --iterations 10 --out "$work/coarse" --quiet
    "$programs/slipstick" optimize $clutch --iterations 10 --out "$work/clutch" --quiet
    tangent $ball/coarse.toml "$work/coarse" coarse
    tangent $clutch "$work/clutch" clutch
    # a fifth of the steps
    sed 's/^steps = 50/steps = 10/' $ball/case.toml > "$work/paper.toml"
    [ -n "${1-}" ] || "$programs/slipstick" optimize "$work/paper.toml" --iterations 12 --out "$work/paper" --quiet
    tangent "$work/paper.toml" "${1:-$work/paper}" paper
    "$programs/examples/export_matrix" 100000 "$work/blocks.bin" >&2
}

designs "${1-}"
{
    printf '```text\n'
    measured coarse "half_ball_on_plate/coarse.toml"
    measured clutch "clutch/coarse.toml"
    measured paper "half_ball_on_plate/case.toml"
    measured blocks "two blocks, wavy densities"
    printf '```\n'
} > "$work/table"
put docs/measurements/cluster.md precondition "$work/table"
