#!/usr/bin/env bash
# Takes a hub, twenty random designs and ten optimized ones to parts, writes six designs as STEP files, and designs a
# seal, and puts the tables between the marks of docs/measurements/parts.md; forty minutes on two cores.
# `measure.sh hub`, `designs`, `promises`, `seal` or `step` repeats one table.
#
#   docs/measure/parts/measure.sh
#
# It needs Python with Gmsh and meshio (pip install gmsh meshio).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh

# hub_row LABEL RESULTS: a line of the table, from the last row of the run's quantities.
hub_row() {
    python3 - "$1" "$2/quantities.csv" <<'PYTHON'
import csv, sys
last = list(csv.DictReader(open(sys.argv[2])))[-1]
names = ["hub_inner_normal_force", "hub_inner_peak_pressure", "strain_energy", "external_work"]
print(f"| {sys.argv[1]} | " + " | ".join(f"{float(last[name]):.6g}" for name in names) + " |")
PYTHON
}

hub() {
    local solve=("$programs/slipstick" solve docs/measure/parts/hub.toml -q --out)
    "${solve[@]}" "$work/hub"
    "${solve[@]}" "$work/fine" --set 'body[0].hollow_cylinder.elements=[24, 144, 4]'
    "$programs/slipstick" export "$work/hub" --case "$work/whole" -q
    "$programs/slipstick" solve "$work/whole/case.toml" --out "$work/whole_run" -q
    "$programs/slipstick" export "$work/hub" --case "$work/part" --size 1.87 -q
    python3 "$work/part/mesh.py" >&2
    "$programs/slipstick" solve "$work/part/case.toml" --out "$work/part_run" -q
    {
        echo '| hub | normal force [N] | peak pressure [MPa] | strain energy [N mm] | external work [N mm] |'
        echo '|---|--:|--:|--:|--:|'
        hub_row 'design, 10 × 48 × 1 elements' "$work/hub"
        hub_row 'part with its own mesh' "$work/whole_run"
        hub_row 'part, remeshed' "$work/part_run"
        hub_row 'design, 24 × 144 × 4 elements' "$work/fine"
    } > "$work/hub.md"
    put docs/measurements/parts.md hub "$work/hub.md"
}

designs() {
    python3 docs/measure/parts/designs.py --slipstick "$programs/slipstick" --out "$work/designs" > "$work/designs.md"
    put docs/measurements/parts.md designs "$work/designs.md"
}

promises() {
    python3 docs/measure/parts/promises.py --slipstick "$programs/slipstick" --out "$work/promises" > "$work/promises.md"
    put docs/measurements/parts.md promises "$work/promises.md"
}

step() {
    local template designs=()
    for template in bracket press-fit snap-fit; do
        "$programs/slipstick" new "$template" --out "$work/$template.toml" -q
        "$programs/slipstick" optimize "$work/$template.toml" --out "$work/$template" -q
        designs+=("$template of the template=$work/$template")
    done
    for name in 'tet plate with holes' 'hex cone'; do
        python3 docs/measure/parts/promises.py --slipstick "$programs/slipstick" --out "$work/step" --only "$name" >&2
        designs+=("$name=$work/step/${name// /_}/run")
    done
    python3 docs/measure/parts/flange.py "$work/flange" --size 1.5 >&2
    "$programs/slipstick" solve "$work/flange/flange.toml" --design "$work/flange/flange.csv" --out "$work/flange/run" -q
    designs+=("flange with fillets=$work/flange/run")
    python3 docs/measure/parts/step.py --slipstick "$programs/slipstick" "${designs[@]}" > "$work/step.md"
    put docs/measurements/parts.md step "$work/step.md"
}

# The spread, the least pressure and the discreteness before the sharpness rises, without and with a compressible void.
seal() {
    local case=docs/measure/parts/seal.toml
    sed '/^void_poisson_ratio/d' "$case" > "$work/liquid.toml"
    "$programs/slipstick" optimize "$work/liquid.toml" --out "$work/liquid" -q
    "$programs/slipstick" optimize "$case" --out "$work/compressible" -q
    {
        echo '| void | sharpness | spread | least pressure [MPa], at least 0.22 | discreteness |'
        echo '|---|--:|--:|--:|--:|'
        local of at
        for of in 'ν = 0.49=liquid' 'ν = 0.3=compressible'; do
            for at in 19=1 39=2 59=3 79=4 99=6 119=8; do
                awk -F, -v void="${of%=*}" -v at="${at%=*}" -v sharpness="${at#*=}" '
                    NR == 1 { for (i = 1; i <= NF; i++) column[$i] = i }
                    NR > 1 && $1 == at {
                        printf "| %s | %s | %.4f | %.3f | %.2f |\n", void, sharpness, $column["objective"],
                            $column["least_pressure"], $column["discreteness"]
                    }' "$work/${of##*=}/history.csv"
            done
        done
    } > "$work/seal.md"
    put docs/measurements/parts.md seal "$work/seal.md"
}

for table in "${@:-hub designs promises seal step}"; do
    for name in $table; do "$name"; done
done
