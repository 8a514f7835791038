#!/usr/bin/env bash
# Optimizes two designs with MMA and GCMMA and puts what they cost between the marks of docs/measurements/optimizers.md; five minutes on
# two idle cores. `measure.sh problems` instead repeats the default runs of docs/measure/optimizers/problems, makes the tuned ones that are
# not yet in its table, and puts the table into the page; half an hour, if all are made.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
cargo build --release -q
if [ "${1:-}" = problems ]; then
    SLIPSTICK=$PWD/$programs/slipstick docs/measure/optimizers/problems/problems.py --again default
    docs/measure/optimizers/problems/problems.py --table > "$work/problems.md"
    put docs/measurements/optimizers.md problems "$work/problems.md"
    exit
fi
program=$PWD/$programs/slipstick

push="cases/cube_on_cuboid/case.toml --set optimizer.iterations=20 --set design.volume_fraction=0.5 --set design.simp.min=1e-3
    --set quantity=[{name='push',reaction={set='cuboid_ymin',component='y'}}]
    --set objective={follow={quantity='push',points=[[0.5,25.0],[1.0,20.0]]}}"
"$program" new half-ball --out "$work/ball.toml" -q
sed -i '/^density_filter/d; /^projection/d; /^schedule/d; /^optimality/d; s/^mma = .*/mma = { asyinit = 0.8, asyincr = 1.2, asydecr = 0.65 }/' "$work/ball.toml"
ball="$work/ball.toml --set load_path.steps=5"

# row LABEL METHOD MOVE_LIMIT ITERATIONS CASE …
row() {
    local label=$1 method=$2 limit=$3 iterations=$4 run=$work/run
    shift 4
    "$program" optimize "$@" --iterations "$iterations" --set "optimizer.method=\"$method\"" \
        --set "optimizer.mma.move_limit=$limit" --out "$run" --force -q
    awk -F, -v label="$label" -v method="${method^^}" -v limit="$limit" '
        NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        NR > 2 && $at["objective"] > last { rises++ }
        { last = $at["objective"]; updates = $1; marches += 1 + $at["inner_iterations"] + $at["halvings"] }
        END { printf "| %s | %s | %s | %d | %d | %d | %.4g |\n", label, method, limit, updates, marches, rises, last }
    ' "$run/history.csv"
}

{
    echo "| case | method | move limit | iterations | marches | rises | objective |"
    echo "|---|---|--:|--:|--:|--:|--:|"
    row "cube on cuboid, force follows two points" mma 0.5 20 $push
    row "the same" mma 0.5 81 $push
    row "the same" gcmma 0.5 20 $push
    row "half ball on plate, largest contact force" mma 0.1 20 $ball
    row "the same" gcmma 0.1 20 $ball
    row "the same" mma 0.4 20 $ball
    row "the same" gcmma 0.4 20 $ball
} | sed 's/ -\([0-9]\)/ −\1/' > "$work/cost.md"
put docs/measurements/optimizers.md cost "$work/cost.md"
