#!/usr/bin/env bash
# Solves cases of the project, with all bodies solid, in CalculiX and in slipstick, and puts the table into
# docs/measurements/decks.md.
#
#   docs/decks/cases.sh                        a quarter of an hour; the bracket with 40 steps takes half of it
#   docs/decks/cases.sh "press fit" seal       these rows; the others stay as they are
#
# needs `ccx` and `python3` on the path, and a release build of slipstick.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source docs/measure/tables.sh
slipstick=$(realpath "$programs/slipstick")
only=$(printf "|%s|" "$@")
[ $# -gt 0 ] || only=
of_body() { echo "--set body[$1].material.neo_hooke.form=\"isochoric\""; }

# rows TEXT FILE QUANTITIES SETTINGS…: rows for a case, with the law that CalculiX has.
rows() {
    local text=$1 file=$2 quantities=$3
    shift 3
    if [[ -n $only && $only != *"|$text|"* ]]; then
        awk -v row="| $text |" '$0 == "<!-- cases -->" { inside = 1 } $0 == "<!-- end -->" { inside = 0 }
            inside && index($0, row) == 1' docs/decks.md >>"$work/rows"
        return
    fi
    rm -rf "$work/case" "$work/deck"
    cp -r "$(dirname "$file")" "$work/case"
    (
        cd "$work/case"
        "$slipstick" check "$(basename "$file")" "$@" --resolved >resolved.toml 2>"$work/log"
        "$slipstick" export resolved.toml --deck "$work/deck" >>"$work/log" 2>&1
        # exit code 3: numbers deviate
        "$slipstick" verify deck "$work/deck" --json >"$work/events" 2>>"$work/log" || [ $? = 3 ]
    )
    python3 - "$work/events" "$text" "$quantities" <<'EOF' | tee -a "$work/rows" >&2
import json, sys
events = [json.loads(line) for line in open(sys.argv[1]) if line.startswith("{")]
deck = next(event for event in events if event.get("event") == "deck")
# the deck of a tied rigid body has other nodes
displacements = "–" if deck["displacements"] is None else f"{100 * deck['displacements']:.2f} %"
for name in sys.argv[3].split():
    row = next(row for row in deck["compared"] if row["quantity"] == name)
    print(f"| {sys.argv[2]} | `{name}` | {row['slipstick']:.5g} | {row['ccx']:.5g} | "
          f"{100 * row['deviation']:+.2f} % | {displacements} |")
EOF
}

{
    echo "| case | quantity | slipstick | ccx | deviation | all displacements |"
    echo "|---|---|--:|--:|--:|--:|"
} >"$work/rows"
both="$(of_body 0) $(of_body 1)"
rows gripper cases/gripper/case.toml "input_force tube_crown_resultant_x tube_crown_resultant_y" $both
rows roller cases/roller/case.toml roller_tread_resultant_y $(of_body 1)
rows seal cases/seal/case.toml reaction_flange_inner_nodes_y $both
rows detent cases/detent/case.toml "insertion_force nose_crown_resultant_y" $both
rows "press fit" cases/press_fit/case.toml "reaction_ring_zmin_nodes_z bushing_inner_resultant_y" $both $(of_body 2)
rows bracket cases/bracket/case.toml "pad_sole_resultant_x pad_sole_resultant_y" $both
rows "half-ball" cases/half_ball_on_plate/coarse.toml "ball_dome_resultant_x ball_dome_resultant_y" $both
steps="--set load_path.steps=40"
rows "bracket, 40 steps" cases/bracket/case.toml "pad_sole_resultant_x pad_sole_resultant_y" $both $steps
rows "half-ball, 40 steps" cases/half_ball_on_plate/coarse.toml "ball_dome_resultant_x ball_dome_resultant_y" $both \
    $steps
put docs/measurements/decks.md cases "$work/rows"
