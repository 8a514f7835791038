#!/usr/bin/env bash
# Writes transcript.md and its pictures by running the commands of the page: mesh, check, optimize,
# report, pictures, surface.
#
#   PATH=$PWD/target/release:$PATH cases/bracket/transcript.sh
#
# It needs slipstick, Gmsh, and Python with trimesh and PyVista (pip install gmsh trimesh scipy lxml networkx
# pyvista).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
figures=../../docs/figures
page=$(mktemp)
start=$(date +%s)
shared=$(awk '$1 > 1.5 { print ", which other programs used, too" }' /proc/loadavg)

# A command as it is typed and what it prints; with a second argument, only lines that match it.
show() {
    local from to
    from=$(date +%s)
    printf '```console\n$ %s\n' "$1"
    bash -o pipefail -c "$1" 2>&1 | tr '\r' '\n' | sed 's/[[:space:]]*$//' | grep -E -- "${2:-}" | cat -s
    to=$(date +%s)
    printf '```\n'
    echo "$1: $((to - from)) s" >> "$page.times"
}
seconds() { sed -n "s/^$1.*: \([0-9]*\) s$/\1/p" "$page.times"; }

rm -rf case
: > "$page.times"
{
    cat <<'TEXT'
# A bracket, from geometry to a printed part

Two pins hold a wall bracket. A pad is pressed onto its shelf and dragged towards the tip, with
friction. The bracket may use 45 % of its volume; the design should carry as much force as possible
at the final position of the pad. [A script](transcript.sh) writes this page: it runs each command
below and records its output.

## The mesh

[bracket.geo](bracket.geo) draws the side view, with a solid square around each pin, and extrudes it
into hexahedra. Its physical groups name what the case needs: the volumes `bracket` and `pad`, and
the surfaces `shelf`, `pins`, `sole` and `grip`. The sole of the pad is crowned, so that the pad
does not slide on the edges of its sole.

TEXT
    show "gmsh -3 bracket.geo -o bracket.msh" "nodes|Writing"
    cat <<'TEXT'

`slipstick new my-mesh --mesh bracket.msh` writes a case with these names as a starting point.
Edited, it becomes [case.toml](case.toml), whose main part is:

TEXT
    printf '```toml\n'
    sed -n '/^\[\[contact/,/^contact_force/p' case.toml
    printf '```\n\n## Check the case\n\n'
    show "slipstick check case.toml"
    cat <<'TEXT'

The bodies cannot move freely, the sole faces the shelf, and a run needs little memory. The warning
says that the initial design exceeds the bound: it has a density of 45 % everywhere except in the
passive regions, which are solid. The first updates remove the excess.

## The design

TEXT
    show "slipstick optimize case.toml" "^ +[0-9]*[05]  objective|^objective"
    printf '\nEvery fifth iteration is shown.\n\n'
    show "slipstick render case --out $figures/bracket_end.png"
    show "slipstick render case --iteration \$(tail -1 case/history.csv | cut -d, -f1) --out $figures/bracket_design.png"
    cat <<'TEXT'

![The bracket at the end of the path, with the pad as glass](../../docs/figures/bracket_end.png)
![The design](../../docs/figures/bracket_design.png)

## Report and export

TEXT
    show "slipstick report case"
    show "slipstick export case --threshold 0.5 --smooth 40 --stl case/bracket.stl --3mf case/bracket.3mf"
    cat <<'TEXT'

`report.html` is a single file that opens in any browser. The script `surface.py` checks the surface
with another program, trimesh:

TEXT
    show "python3 surface.py case/bracket.stl case/bracket.3mf"
    python3 picture.py case/bracket.stl $figures/bracket_part.png 2> /dev/null
    printf '\n![The part as printed](../../docs/figures/bracket_part.png)\n'
    printf '\n## Time\n\n'
    printf '| | s |\n|---|--:|\n| mesh | %s |\n| `check` | %s |\n| `optimize` | %s |\n| `report` | %s |\n| `export` | %s |\n| this whole page | %s |\n' \
        "$(seconds gmsh)" "$(seconds 'slipstick check')" "$(seconds 'slipstick optimize')" "$(seconds 'slipstick report')" \
        "$(seconds 'slipstick export')" "$(($(date +%s) - start))"
    printf '\nMeasured with %s on %s cores%s.\n' "$(slipstick --version)" "$(nproc)" "$shared"
} > "$page"
mv "$page" transcript.md
rm -f "$page.times"
