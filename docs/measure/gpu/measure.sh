#!/usr/bin/env bash
# Makes the measurements of docs/measurements/gpu.md and inserts them between the markers of that page. Needs a GPU and cuDSS, and a
# quarter of an hour. `measure.sh NAME …` repeats single measurements. PROGRAMS is a folder with programs that are already built.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
if [ -n "${PROGRAMS:-}" ]; then
    programs=$PROGRAMS
else
    cargo build --release -p slipstick-cli --features cudss
    cargo build --release -p slipstick-cudss --example measure_gpu
    cargo build --release -p slipstick --example export_matrix --features cudss
fi
program=$programs/slipstick
threads=$(nproc)

# Inserts the output of a command between <!-- NAME --> and <!-- end -->, and shows it.
measure() {
    { printf '```text\n'; "$1"; printf '```\n'; } | tee "$work/$1"
    put docs/measurements/gpu.md "$1" "$work/$1"
}

# Factors of the matrices of two blocks in contact.
factors() {
    local unknowns
    for unknowns in 100000 300000 1000000; do
        "$programs/examples/export_matrix" $unknowns "$work/blocks.bin" >&2
        "$programs/examples/measure_gpu" "$work/blocks.bin" f32 f64
    done
}

# A load step of the half-ball with its gradient, on the GPU and with the iterative solver on the processor: elements of
# the plate, of the ball.
step() {
    local linear
    for linear in cudss schwarz; do
        sed "s/\[14, 3, 14\]/[$1]/; s/\[10, 2, 1\]/[$2]/; s/\"schwarz\"/\"$linear\"/" docs/measure/performance/half_ball.toml \
            > "$work/case.toml"
        echo "linear = \"$linear\""
        "$program" bench "$work/case.toml" --steps 1 --threads "$threads" | grep -v '^$' | sed '/gradient, without/,$d'
    done
}

steps() {
    (while sleep 0.3; do nvidia-smi --query-gpu=memory.used --format=csv,noheader,nounits >>"$work/used"; done) &
    local sampler=$!
    step '63, 14, 63' '45, 9, 5'
    step '97, 21, 97' '69, 14, 7'
    kill $sampler
    echo "memory of the GPU in use, at most: $(sort -n "$work/used" | tail -1) MiB"
}

# The half-ball of the paper's size at a settled design, as in docs/measure/performance/measure.sh.
settled() {
    local case=cases/half_ball_on_plate/case.toml linear
    "$program" optimize "$case" --set load_path.steps=10 --iterations 12 --out "$work/design" --quiet >&2
    for linear in cudss direct; do
        { cat "$case"; printf '\n[solver]\nlinear = "%s"\n' $linear; } > "$work/case.toml"
        echo "linear = \"$linear\""
        "$program" bench "$work/case.toml" --design "$work/design" --threads "$threads" | sed -n 1,2p
    done
}

# Increments of the clutch of the paper's size: a solver, and options of `bench`.
increments() {
    local linear=$1
    shift
    { cat cases/clutch/case.toml; printf '\n[solver]\nlinear = "%s"\n' "$linear"; } > "$work/case.toml"
    echo "linear = \"$linear\""
    "$program" bench "$work/case.toml" "$@" --threads "$threads" --memory 0 | sed -n 1,2p
}

# The first four, near the uniform design.
clutch() {
    local linear
    for linear in cudss schwarz direct; do
        increments $linear --steps 4
    done
}

# The first sixteen, at the settled design with an eighth of the elements (cases/clutch/mapped.toml).
plateau() {
    local eighth=${EIGHTH:-cases/clutch/mapped/eighth} linear
    [ -d "$eighth" ] || "$program" study cases/clutch/mapped.toml --only eighth --quiet >&2
    for linear in cudss schwarz; do
        increments $linear --design "$eighth" --steps 16
    done
}

for name in ${*:-factors steps settled clutch plateau}; do
    measure "$name"
done
