#!/usr/bin/env bash
# Makes the measurements of docs/gpu.md and inserts them between the markers of that page. Needs a GPU and cuDSS, and ten
# minutes. `measure.sh NAME …` repeats single measurements. PROGRAMS is a folder with programs that are already built.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

source docs/tables.sh
if [ -n "${PROGRAMS:-}" ]; then
    programs=$PROGRAMS
else
    cargo build --release -p slipstick-cli --features cudss
    cargo build --release -p slipstick-cudss --example measure
    cargo build --release -p slipstick --example export_matrix --features cudss
fi
program=$programs/slipstick
threads=$(nproc)

# Inserts the output of a command between <!-- NAME --> and <!-- end -->, and shows it.
measure() {
    { printf '```text\n'; "$1"; printf '```\n'; } | tee "$work/$1"
    put docs/gpu.md "$1" "$work/$1"
}

# Factors of the matrices of two blocks in contact.
factors() {
    local unknowns
    for unknowns in 100000 300000; do
        "$programs/examples/export_matrix" $unknowns "$work/blocks.bin" >&2
        "$programs/examples/measure" "$work/blocks.bin" f32 f64
    done
}

# A load step of the half-ball with its gradient: elements of the plate, of the ball.
step() {
    sed "s/\[14, 3, 14\]/[$1]/; s/\[10, 2, 1\]/[$2]/; s/\"schwarz\"/\"cudss\"/" docs/performance/half_ball.toml \
        > "$work/case.toml"
    "$program" bench "$work/case.toml" --steps 1 --threads "$threads" | grep -v '^$' | sed '/gradient, without/,$d'
}

steps() {
    step '63, 14, 63' '45, 9, 5'
    step '97, 21, 97' '69, 14, 7'
}

# The half-ball of the paper's size at a settled design, as in docs/performance/measure.sh.
settled() {
    local case=cases/half_ball_on_plate/case.toml linear
    "$program" optimize "$case" --set load_path.steps=10 --iterations 12 --out "$work/design" --quiet >&2
    for linear in cudss direct; do
        { cat "$case"; printf '\n[solver]\nlinear = "%s"\n' $linear; } > "$work/case.toml"
        echo "linear = \"$linear\""
        "$program" bench "$work/case.toml" --design "$work/design" --threads "$threads" | sed -n 1,2p
    done
}

# Four increments of the clutch of the paper's size.
clutch() {
    local linear
    for linear in cudss direct; do
        { cat cases/clutch/case.toml; printf '\n[solver]\nlinear = "%s"\n' $linear; } > "$work/case.toml"
        echo "linear = \"$linear\""
        "$program" bench "$work/case.toml" --steps 4 --threads "$threads" --memory 0 | sed -n 1,2p
    done
}

for name in ${*:-factors steps settled clutch}; do
    measure "$name"
done
