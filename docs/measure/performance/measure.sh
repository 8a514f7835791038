#!/usr/bin/env bash
# Makes the measurements of docs/measurements/performance.md and inserts them between the markers of that page. About an hour on
# two cores; nothing else should run. `measure.sh NAME …` repeats single measurements.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
program=$programs/slipstick
cargo build --release -p slipstick-cli

# Inserts the output of a command between <!-- NAME --> and <!-- end -->.
measure() {
    local name=$1
    shift
    { printf '```text\n'; "$@"; printf '```\n'; } > "$work/$name"
    put docs/measurements/performance.md "$name" "$work/$name"
}

sizes() { "$program" bench --sizes 1000,3000,9400 --threads 1,2; }

evaluations() { "$program" bench --sizes 1000 --threads 1 | sed -n '/^evaluations/,/^$/p' | grep .; }

# First a nearly converged design: the same problem with a fifth of the steps; the measurement starts from its densities.
settled() {
    local case=cases/half_ball_on_plate/case.toml
    "$program" optimize "$case" --set load_path.steps=10 --iterations 12 --out "$work/design" --quiet
    "$program" bench "$case" --design "$work/design" --threads 2
    echo
    echo "one iteration of the optimization from there"
    "$program" optimize "$case" --design "$work/design" --iterations 2 --out "$work/next" | grep -E '^ +[0-9]+  objective'
}

ironing_block() { "$program" bench docs/measure/performance/ironing_block.toml --threads 1 --cpu; }

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

plastic() { cargo bench --quiet -p slipstick-solid --bench assembly -- plastic; }

# One load step of the half-ball: LINEAR, elements of the plate, of the ball, options of the measurement.
half_ball() {
    sed "s/\[14, 3, 14\]/[$2]/; s/\[10, 2, 1\]/[$3]/; s/\"schwarz\"/\"$1\"/" docs/measure/performance/half_ball.toml \
        > "$work/case.toml"
    "$program" bench "$work/case.toml" --steps 1 --threads 2 "${@:4}"
}

# The processor time of a load step with direct factors and with iterations, where they are about as expensive.
choice() {
    local linear
    for linear in direct schwarz; do
        echo "$linear"
        half_ball $linear '29, 7, 29' '21, 4, 2' --cpu | head -n 2
        half_ball $linear '43, 10, 43' '31, 6, 4' --cpu | sed -n 2p
    done
}

large() { half_ball direct '63, 14, 63' '45, 9, 5'; }

# Iterations of the preconditioner to 1e-10, forward and transposed, for meshes and stiffnesses of void. The folder
# MATRICES, if it is set, keeps the matrices, which take half an hour.
contrast() {
    cargo build --quiet --release -p slipstick --example export_matrix
    cargo build --quiet --release -p slipstick-linalg --example schwarz
    local folder=${MATRICES:-$work} unknowns void file line
    printf '  unknowns   void 1e-3   void 1e-4   void 1e-5   void 1e-6\n'
    for unknowns in 33000 100000 300000; do
        line=
        for void in 1e-3 1e-4 1e-5 1e-6; do
            file=$folder/blocks_${unknowns}_$void.bin
            [ -e "$file" ] || "$programs/examples/export_matrix" $unknowns "$file" $void >&2
            # the second and the fourth of the solves are those to 1e-10
            line+=$("$programs/examples/schwarz" "$file" |
                awk '{ for (i = 2; i <= NF; i++) if ($i == "it.") n[++k] = $(i - 1); print $1, n[2], n[4] }')' '
        done
        awk '{ printf "%10d%7d / %2d%7d / %2d%7d / %2d%7d / %2d\n", $1, $2, $3, $5, $6, $8, $9, $11, $12 }' <<< "$line"
    done
}

# The iterative solver; the larger mesh needs 15 GB.
iterative() {
    half_ball schwarz '63, 14, 63' '45, 9, 5'
    echo
    half_ball schwarz '97, 21, 97' '69, 14, 7'
}

# Increments of the clutch of the paper's size: the first sixteen at the uniform design, and the first four at the settled
# design with an eighth of the elements (cases/clutch/mapped.toml), which the folder EIGHTH may hold.
clutch() {
    local eighth=${EIGHTH:-cases/clutch/mapped/eighth}
    [ -d "$eighth" ] || "$program" study cases/clutch/mapped.toml --only eighth --quiet >&2
    "$program" bench cases/clutch/case.toml --steps 16 --threads 2 --memory 0
    echo
    "$program" bench cases/clutch/case.toml --design "$eighth" --steps 4 --threads 2 --memory 0 2> /dev/null
}

for name in ${*:-sizes evaluations settled ironing_block methods responses elements plastic orders large choice contrast iterative clutch}; do
    measure "$name" "$name"
done
