#!/usr/bin/env bash
# Runs what docs/measurements/designs.md describes and puts its tables between the marks of that page; about an hour on two idle cores.
# `measure.sh NAME …` repeats single ones: friction, finer, paper_size, landing, thickness, voids, costs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
slipstick() { "$programs/slipstick" "$@"; }

# column FILE NAME: a column of a table.
column() { awk -F, -v name="$2" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == name) at = i; next } { print $at }' "$1"; }

# Each design for one coefficient of friction, and the robust one, under all coefficients.
friction() {
    slipstick study cases/ironing/projected_study.toml -q
    awk -F, '
        $2 ~ /^objective_over_volume_fraction at/ { split($2, at, " at "); value[$1, at[2]] = -$3 }
        END {
            n = split("designed_for_mu_0 designed_for_mu_01 designed_for_mu_025 robust_for_all", design, " ")
            split("0 0.1 0.25", mu, " ")
            print "| −θ/V | designed for μ = 0 | 0.1 | 0.25 | robust | loss of the robust design |\n|---|--:|--:|--:|--:|--:|"
            for (k = 1; k <= 3; k++) {
                printf "| μ = %s |", mu[k]
                for (d = 1; d <= n; d++) printf d == k ? " **%.3f** |" : " %.3f |", value[design[d], mu[k]]
                printf " %.2f %% |\n", 100 * (1 - value[design[4], mu[k]] / value[design[k], mu[k]])
            }
        }' cases/ironing/projected_study/numbers.csv > "$work/friction.md"
    put docs/measurements/designs.md friction "$work/friction.md"
}

# cross STUDY MARK: each design for one coefficient of friction under all coefficients; then how each design's force grows
# with friction.
cross() {
    slipstick study "cases/ironing/$1.toml" -q
    awk -F, '
        $2 ~ /^objective_over_volume_fraction at/ { split($2, at, " at "); value[$1, at[2]] = -$3 }
        END {
            n = split("designed_for_mu_0 designed_for_mu_01 designed_for_mu_025", design, " ")
            split("0 0.1 0.25", mu, " ")
            print "| −θ/V | designed for μ = 0 | 0.1 | 0.25 |\n|---|--:|--:|--:|"
            for (k = 1; k <= 3; k++) {
                printf "| μ = %s |", mu[k]
                for (d = 1; d <= n; d++) printf d == k ? " **%.6f** |" : " %.6f |", value[design[d], mu[k]]
                print ""
            }
            for (k = 2; k <= 3; k++) {
                printf "| μ = %s, relative to μ = 0 |", mu[k]
                for (d = 1; d <= n; d++) printf " %.4f |", value[design[d], mu[k]] / value[design[d], mu[1]]
                print ""
            }
        }' "cases/ironing/$1/numbers.csv" > "$work/$2.md"
    put docs/measurements/designs.md "$2" "$work/$2.md"
}

# With an eighth of the paper's elements, and in the paper's size; the latter takes hours and is not among the defaults.
finer() { cross eighth_study finer; }
paper_size() { cross paper_size_study paper_size; }

# The half ball that lands in three places: the design for the middle one, and the worst-case design.
landing() {
    local case=cases/half_ball_on_plate/landing.toml one='load_case=[{ name = "centre" }]'
    slipstick optimize "$case" --set "$one" --out "$work/centre" -q
    slipstick optimize "$case" --out "$work/worst" -q
    {
        echo '| nodal contact force | at the centre | before it | beyond it | worst |'
        echo '|---|--:|--:|--:|--:|'
        for design in centre worst; do
            slipstick solve "$case" --design "$work/$design" --out "$work/solve_$design" -q
            column "$work/solve_$design/quantities.csv" force | awk -v design="$design" '
                NR == 11 || NR == 21 || NR == 31 { force[++n] = $1; if (n == 1 || $1 < least) least = $1 }
                END {
                    name = design == "centre" ? "designed for the centre" : "designed for the worst"
                    printf "| %s | %.3f | %.3f | %.3f | **%.3f** |\n", name, force[1], force[2], force[3], least
                }'
        done
    } > "$work/landing.md"
    put docs/measurements/designs.md landing "$work/landing.md"
}

# filters LABEL NAME CASE BODIES RADIUS ITERATIONS [settled]: a case with its sensitivity filter, with a density filter of that
# radius and a projection, and with three designs of the same filter; lines of the table of thicknesses, and pictures.
# With `settled`, the last two start from the first.
filters() {
    local label=$1 case=$3 bodies=$4 radius=$5 iterations=$6 start=${7-} name
    local thickness schedule
    thickness=$(awk -v radius="$radius" 'BEGIN { printf "%.2f", radius / 1.134 }')
    schedule=$(awk -v n="$iterations" 'BEGIN {
        printf "optimizer.schedule={ sharpness = [[0, 1], [%d, 2], [%d, 4], [%d, 8]] }", n / 3, 5 * n / 9, 7 * n / 9 }')
    local -A of=(
        [sensitivity]=''
        [projection]="design.density_filter={ radius = $radius }"
        [three_fields]="design.minimum_thickness=$thickness"
    )
    local -A title=([sensitivity]='sensitivity filter' [projection]='projection' [three_fields]='three designs')
    for name in sensitivity projection three_fields; do
        local more=() run=$work/$2_$name requested=–
        if [ "$name" != sensitivity ]; then
            sed '/^sensitivity_filter/d' "$case" > "$run.toml"
            more=(--set "${of[$name]}" --set 'design.projection={}' --set "$schedule" --set optimizer.mma='{ move_limit = 0.1 }')
        else
            cp "$case" "$run.toml"
        fi
        if [ "$name" != sensitivity ] && [ "$start" = settled ]; then more+=(--design "$work/$2_sensitivity"); fi
        if [ "$name" = three_fields ]; then requested=$thickness; fi
        slipstick optimize "$run.toml" "${more[@]}" --set optimizer.iterations="$iterations" --out "$run" -q
        slipstick export "$run" --measure -q
        slipstick render "$run" --bodies "$bodies" --out "docs/figures/designs_$2_$name.png" --size 560x440 -q
        python3 - "$run" "$label, ${title[$name]}" "$requested" <<'PYTHON'
import csv, json, sys
from pathlib import Path

run, name, requested = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
last = list(csv.DictReader(open(run / "history.csv")))[-1]
objective = float(last.get("objective_nominal") or last["objective"])
found = json.loads((run / "measures.json").read_text())
length = lambda of: f"{of['length']:.3f}" if of else "none"
print(
    f"| {name} | {-objective:.4g} | {float(last['discreteness']):.3f} | {requested} "
    f"| {length(found['member'])} | {length(found['gap'])} |"
)
PYTHON
    done
}

# Half ball, ironing and clutch with a sensitivity filter, with a projection, and with three designs: thinnest member, narrowest gap.
thickness() {
    {
        echo '| | −θ | discreteness | requested | thinnest member | narrowest gap |'
        echo '|---|--:|--:|--:|--:|--:|'
        filters half-ball half_ball cases/half_ball_on_plate/coarse.toml plate 0.34 45
        filters ironing ironing cases/ironing/coarse.toml slab 1.2 60
        filters clutch clutch cases/clutch/coarse.toml lower,upper 1.2 60 settled
    } > "$work/thickness.md"
    put docs/measurements/designs.md thickness "$work/thickness.md"
}

# A line of the table of voids: compression, voids, objective re-evaluated, history of the run.
voids_line() {
    awk -F, -v compression="$1" -v name="$2" -v found="$3" '
        NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        { newton += $at["newton_iterations"]; cut += $at["increments"] > 10; seconds += $at["seconds"]; last = $1
          objective = -$at["objective"]; discreteness = $at["discreteness"] }
        END {
            printf "| %s %% | %s | %d | ", 100 * compression / 6, name, last
            printf last == 30 ? "%.3f | %s | %.3f |" : "– | – | – |", objective, found, discreteness
            printf " %.0f | %d of %d | %.1f |\n", newton / (last + 1), cut, last + 1, seconds / (last + 1)
        }' "$4"
}

# A block with voids that are crushed: several settings of voids, for three compressions. Each design is evaluated again with
# interpolated energy. A minimum of 1e-6 is tried for 15 iterations at the smallest compression, where it takes minutes.
voids() {
    local case=docs/measure/designs/voids.toml compression setting
    {
        echo '| compression | voids | iterations | −θ | re-evaluated | discreteness | Newton iterations per path | paths cut back | seconds per iteration |'
        echo '|--:|---|--:|--:|--:|--:|--:|--:|--:|'
        for compression in 0.3 0.9 1.8; do
            local down="[0.0, -$compression, 0.0]" end="[0.3, -$compression, 0.0]"
            local motion="dirichlet[1].motion=[{ t = 0.8, u = $down }, { t = 1.0, u = $end }]"
            for setting in 'interpolated 1e-3' 'plain 1e-3' 'plain 1e-2' 'interpolated 1e-6' 'plain 1e-6'; do
                local kind=${setting% *} min=${setting#* } run="$work/voids_${setting/ /_}_$compression" iterations=30 found=–
                local more=()
                if [ "$kind" = interpolated ]; then more=(--set 'design.energy_interpolation={}'); fi
                if [ "$min" = 1e-6 ]; then
                    if [ "$compression" != 0.3 ]; then continue; fi
                    iterations=15
                fi
                slipstick optimize "$case" --set "$motion" --set "design.simp.min=$min" "${more[@]}" \
                    --iterations "$iterations" --out "$run" -q
                if [ "$iterations" = 30 ]; then
                    found=$(slipstick solve "$case" --set "$motion" --set 'design.energy_interpolation={}' --design "$run" \
                        --out "$run/again" --json | sed -n 's/.*"event":"result".*"objective":-\([0-9.]*\).*/\1/p')
                    found=$(LC_ALL=C printf %.3f "$found")
                fi
                voids_line "$compression" "$kind, $min" "$found" "$run/history.csv"
            done
        done
    } > "$work/voids.md"
    put docs/measurements/designs.md voids "$work/voids.md"
}

# An iteration with three designs or three load cases compared with one with a single one, in turns, on all cores.
costs() {
    local case=cases/ironing/projected.toml
    local load_cases='load_case=[{ name = "a", friction = 0.0 }, { name = "b", friction = 0.1 }, { name = "c" }]'
    # Seconds of iterations 3 to 8, the least of three runs.
    best() {
        local name=$1 least=
        shift
        for turn in 1 2 3; do
            slipstick optimize "$@" --set optimizer.iterations=8 --set optimizer.schedule='{}' --out "$work/$name" --force -q
            local seconds
            seconds=$(column "$work/$name/history.csv" seconds | awk 'NR > 3 && NR < 9 { sum += $1 } END { print sum }')
            least=$(echo "${least:-$seconds} $seconds" | awk '{ print $1 < $2 ? $1 : $2 }')
        done
        echo "$least"
    }
    sed '/^density_filter/d' "$case" > "$work/thick.toml"
    local one three cases
    one=$(best one "$case")
    three=$(best three "$work/thick.toml" --set design.minimum_thickness=1.06)
    cases=$(best cases "$case" --set "$load_cases" --set 'objective.load_cases="worst"')
    {
        echo '| iteration with | time relative to one design and load case |'
        echo '|---|--:|'
        awk -v one="$one" -v three="$three" -v cases="$cases" 'BEGIN {
            printf "| eroded, nominal and dilated design | %.2f |\n| three load cases | %.2f |\n", three / one, cases / one }'
    } > "$work/costs.md"
    put docs/measurements/designs.md costs "$work/costs.md"
}

for part in "${@:-friction finer landing thickness voids costs}"; do
    for name in $part; do "$name"; done
done
