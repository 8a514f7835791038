#!/usr/bin/env bash
# Makes the measurements of docs/performance.md and inserts them between the markers of that page. About half an hour on
# two cores; nothing else should run. `measure.sh NAME …` repeats single measurements.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

source docs/tables.sh
program=$programs/slipstick
cargo build --release -p slipstick-cli

# Inserts the output of a command between <!-- NAME --> and <!-- end -->.
measure() {
    local name=$1
    shift
    { printf '```text\n'; "$@"; printf '```\n'; } > "$work/$name"
    put docs/performance.md "$name" "$work/$name"
}

sizes() { "$program" bench --sizes 1000,3000,9400 --threads 1,2; }

# First a nearly converged design: the same problem with a fifth of the steps; the measurement starts from its densities.
settled() {
    local case=cases/half_ball_on_plate/case.toml
    "$program" optimize "$case" --set load_path.steps=10 --iterations 12 --out "$work/design" --quiet
    "$program" bench "$case" --design "$work/design" --threads 2
    echo
    echo "one iteration of the optimization from there"
    "$program" optimize "$case" --design "$work/design" --iterations 2 --out "$work/next" | tail -n 4 | head -n 3
}

ironing_block() { "$program" bench docs/performance/ironing_block.toml --threads 1 --cpu; }

methods() {
    local case=cases/half_ball_on_plate/coarse.toml
    for enforcement in '{ lagrange = {} }' '{ augmented = {} }' \
        '{ augmented = { stiffness = 100, scaling = "weighted", tolerance = 1e-9, tolerance_scaling = "absolute" } }' \
        '{ penalty = { stiffness = 1000, scaling = "weighted" } }'; do
        sed "/^enforcement = /d; s/^friction = .*/&\nenforcement = ${enforcement}/" "$case" > "$work/case.toml"
        echo "$enforcement"
        "$program" bench "$work/case.toml" --threads 1 --cpu | head -n 2
    done
}

# Factors are kept; the time is that of the processors.
responses() { "$program" bench --sizes 9400 --steps 10 --threads 1 --responses 20 --cpu | sed -n '/together/,/^$/p' | grep .; }

# The same nodes, with linear elements and with half as many of second order in each direction.
orders() {
    local case=cases/half_ball_on_plate/coarse.toml
    for order in 1 2; do
        local plate='14, 4, 14' ball='12, 2, 2'
        [ $order = 1 ] || { plate='7, 2, 7'; ball='6, 1, 1'; }
        sed "s/elements = \\[14, 3, 14\\] }/elements = [$plate] }\\norder = $order/
             s/elements = \\[10, 2, 1\\] }/elements = [$ball] }\\norder = $order/" "$case" > "$work/case.toml"
        echo "order $order"
        "$program" bench "$work/case.toml" --threads 1 --cpu | sed -n '1,6p'
    done
}

elements() { cargo bench --quiet -p slipstick-solid --bench assembly; }

large() { "$program" bench --sizes 90000 --steps 1 --threads 2; }

# The iterative solver; the larger mesh needs 15 GB.
iterative() {
    local mesh
    for mesh in '63, 14, 63/45, 9, 5' '97, 21, 97/69, 14, 7'; do
        sed "s/\[14, 3, 14\]/[${mesh%/*}]/; s/\[10, 2, 1\]/[${mesh#*/}]/" docs/performance/half_ball.toml > "$work/case.toml"
        "$program" bench "$work/case.toml" --steps 1 --threads 2
        echo
    done
}

for name in ${*:-sizes settled ironing_block methods responses elements orders large iterative}; do
    measure "$name" "$name"
done
