#!/usr/bin/env bash
# Writes the tables of docs/measurements/edges.md between the markers of that page; takes a few minutes on one core.
# `measure.sh NAME …` repeats single ones: study, which writes all tables of the tests, slug (needs Python), and drag.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh

study() {
    SLIPSTICK_TABLES=$work cargo test --release -p slipstick --test suite edges::study:: -- --ignored
    for name in refinement overlaps meshes ssnp503 sharp; do
        put docs/measurements/edges.md "$name" "$work/$name.md"
    done
}

# Fx/Fy of a dragged block: its mean over the travel across the last facet of the layer, and at the end.
drag() {
    cargo build --release
    ratios() {
        "$programs/slipstick" solve docs/measure/edges/drag_bottom.toml --force -q -o "$work/drag" \
            --set "contact[0].friction=$1" --set "contact[0].normals=\"$2\"" >&2
        # 1/3 of travel, in 48 steps of 2/48
        awk -F, '
            NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
            { ratio[NR] = -$at["reaction_up_ymax_x"] / $at["reaction_up_ymax_y"] }
            END { for (k = NR - 7; k <= NR; k++) sum += ratio[k]; printf "%.3f, %.3f", sum / 8, ratio[NR] }
        ' <(sed 2d "$work/drag/quantities.csv")
    }
    {
        echo '| μ | averaged (the default): mean, at the end | `"touched"`: mean, at the end |'
        echo '|---|---|---|'
        for mu in 0.1 0.3 0.5 0.7; do
            echo "| $mu | $(ratios $mu averaged) | $(ratios $mu touched) |"
        done
    } > "$work/drag.md"
    put docs/measurements/edges.md drag "$work/drag.md"
}

# Axial by radial force at the edge of a slug in a narrowing, without friction and with three slave surfaces.
slug() {
    cargo build --release
    cp docs/measure/edges/slug.toml "$work"
    python3 docs/measure/edges/slug.py "$work"
    local number=0 settings
    for settings in 'contact[0].normals="averaged"' 'contact[0].normals="touched"' \
        'surface[0].of=["slug_SIDE", "slug_FRONT"]'; do
        number=$((number + 1))
        "$programs/slipstick" solve "$work/slug.toml" -q -o "$work/slug_$number" --set "$settings" >&2
        # all forces at the edge have one ratio; the edge meets the narrowing after two steps of 2.5
        awk -F, '
            NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
            NR > 4 { y = $at["axial"]; printf "%.1f %.4f\n", 2.5 * (NR - 4), sqrt(y * y / ($at["size"] ^ 2 - y * y)) }
        ' "$work/slug_$number/quantities.csv" > "$work/slug_$number.txt"
    done
    {
        echo '| pushed past the start of the narrowing by | side alone, averaged normals (the default) | side alone, `"touched"` | with the front |'
        echo '|---|---|---|---|'
        paste -d ' ' "$work"/slug_{1,2,3}.txt | awk '{ printf "| %s | %s | %s | %s |\n", $1, $2, $4, $6 }'
    } > "$work/slug.md"
    put docs/measurements/edges.md slug "$work/slug.md"
}

[ $# -gt 0 ] || set -- study slug drag
for name in "$@"; do
    "$name"
done
