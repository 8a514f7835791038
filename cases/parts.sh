#!/usr/bin/env bash
# Takes three designs to parts and compares what they promised with what the parts do. It takes about half an hour
# on two idle cores and ends with an error if a contact force deviates by more than 10 %, as that of the bracket does.
#
#   PATH=$PWD/target/release:$PATH cases/parts.sh
#
# It needs slipstick, and Python with Gmsh (pip install gmsh).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
work=$(mktemp -d)

# Name, case, iterations, promised quantity.
part() {
    local folder=$work/$1
    slipstick optimize "$2" --out "$folder" --iterations "$3" -q
    slipstick export "$folder" --case "$folder/part" --measure
    python3 "$folder/part/mesh.py"
    slipstick solve "$folder/part/case.toml" --out "$folder/run" --json > "$folder/events"
    slipstick report "$folder/run" -q
    python3 - "$1" "$4" "$folder/events" <<'PYTHON'
import json, sys

name, quantity, events = sys.argv[1:]
events = [json.loads(line) for line in open(events)]
promises = next(event for event in events if event["event"] == "promises")["promises"]
found = next(of for of in promises if of["quantity"] == quantity)
print(f"{name}: {quantity} promised {found['promised']:.4g}, part {found['found']:.4g}: {found['deviation']:+.1%}")
sys.exit(abs(found["deviation"]) > 0.1)
PYTHON
}

part half_ball half_ball_on_plate/coarse.toml 30 ball_dome_normal_force
part gripper gripper/case.toml 60 grip
part bracket bracket/case.toml 20 pad_sole_normal_force
echo "results in $work"
