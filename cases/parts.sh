#!/usr/bin/env bash
# Takes eight designs to parts, compares what they promised with what the parts do, and puts the table between the marks
# of docs/measurements/parts.md.
#
#   cases/parts.sh
#
# It needs Python with Gmsh (pip install gmsh).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source docs/measure/tables.sh
slipstick() { "$programs/slipstick" "$@"; }

# part LABEL NAME CASE ITERATIONS QUANTITY [OPTION …]: a line of the table. The same design with solid elements, and voids,
# only is analysed on its own mesh too. `step` is the load step, by default the last one; `size` that of the part's edges.
part() {
    local label=$1 folder=$work/$2 case=$3 iterations=$4 quantity=$5
    shift 5
    slipstick optimize "$case" --out "$folder" --iterations "$iterations" -q "$@"
    slipstick export "$folder" --case "$folder/part" ${size:+--size "$size"} --measure > "$folder/export"
    python3 "$folder/part/mesh.py" >&2
    slipstick solve "$folder/part/case.toml" --out "$folder/run" --json > "$folder/events"
    awk -F, -v OFS=, -v threshold="$(sed -n 's/^density above \([0-9.]*\):.*/\1/p' "$folder/export")" '
        NR > 1 { $3 = $3 > threshold ? 1 : 0 }
        { print $1, $2, $3 }' "$folder/design.csv" > "$folder/solid.csv"
    slipstick solve "$folder/case.toml" --design "$folder/solid.csv" --out "$folder/solid" -q
    python3 - "$label" "$quantity" "$folder" "${step:-}" <<'PYTHON'
import csv, json, sys
from pathlib import Path

label, quantity, folder, step = sys.argv[1], sys.argv[2], Path(sys.argv[3]), sys.argv[4]
events = [json.loads(line) for line in open(folder / "events")]
promises = next(event for event in events if event["event"] == "promises")["promises"]
steps = [int(step)] if step else []
found = next(of for of in promises if of["quantity"] == quantity and of["steps"] == steps)
solid = float(list(csv.DictReader(open(folder / "solid" / "quantities.csv")))[int(step or -1)][quantity])
grey = float(list(csv.DictReader(open(folder / "history.csv")))[-1]["discreteness"])
print(f"| {label} | {quantity} | {grey:.3f} | {found['promised']:.4g} | {solid:.4g} | {found['found']:.4g} | {found['deviation']:+.1%} |")
PYTHON
}

for template in gripper press-fit snap-fit bracket; do slipstick new "$template" --out "$work/$template.toml" -q; done

# With a density filter of the same radius and a projection.
sed "/^sensitivity_filter/d; s|file = \"|&$PWD/cases/bracket/|" cases/bracket/case.toml > "$work/projected.toml"
projection=(
    --set 'design.density_filter={ radius = 4.5 }' --set 'design.projection={}'
    --set 'optimizer.schedule={ sharpness = [[0, 1], [20, 2], [30, 4], [40, 8]] }' --set 'optimizer.mma={ move_limit = 0.1 }'
)
{
    echo '| case | quantity | discreteness | design | solid elements | part | deviation |'
    echo '|---|---|--:|--:|--:|--:|--:|'
    part 'half-ball, as above' half_ball cases/half_ball_on_plate/coarse.toml 30 ball_dome_normal_force
    part 'gripper, 60 iterations' gripper cases/gripper/case.toml 60 grip
    part 'bracket, 20 iterations' bracket cases/bracket/case.toml 20 pad_sole_normal_force
    part 'bracket, projection, 60 iterations' projected "$work/projected.toml" 60 pad_sole_normal_force "${projection[@]}"
    part 'gripper of the template' template_gripper "$work/gripper.toml" 120 grip
    part 'press fit of the template' template_press_fit "$work/press-fit.toml" 60 torque
    step=8 size=0.6 part 'snap-fit of the template, load step 8' template_snap_fit "$work/snap-fit.toml" 65 insertion_force
    part 'bracket of the template' template_bracket "$work/bracket.toml" 60 deflection
} > "$work/parts.md"
put docs/measurements/parts.md parts "$work/parts.md"

# The snap-fit at the load steps of its objective, and its largest stress.
python3 - "$work/template_snap_fit/events" > "$work/snap_fit.md" <<'PYTHON'
import json, sys

events = [json.loads(line) for line in open(sys.argv[1])]
promises = next(event for event in events if event["event"] == "promises")["promises"]
print("| | design | part | deviation |")
print("|---|--:|--:|--:|")
for of in promises:
    steps = of["steps"]
    if of["quantity"] == "insertion_force" and steps:
        label = f"insertion force at load step {steps[0]} \\[N\\]"
    elif of["quantity"] == "stress_extreme" and steps:
        label = "largest stress over the path, at most 30 \\[MPa\\]"
    else:
        continue
    print(f"| {label} | {of['promised']:.3g} | {of['found']:.3g} | {of['deviation']:+.1%} |")
PYTHON
put cases/detent/README.md part "$work/snap_fit.md"
