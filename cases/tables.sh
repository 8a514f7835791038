#!/usr/bin/env bash
# Runs the studies of the seal, the gripper finger, the snap-fit, the buffer and the snap-through, and puts their
# numbers between the marks of the pages of these cases; half an hour on two idle cores. `cases/tables.sh NAME …` does it
# for single cases. `finer_clutch`, `mapped_clutch` and `full_clutch`, which take one to two hours each, and
# `half_ball_paper`, which takes six, run only if they are named.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source docs/measure/tables.sh
program=$programs/slipstick

# history CASE COLUMN=HEADING …: rows of the history of the run `design`.
history() {
    local case=$1
    shift
    awk -F, -v names="$(printf '%s;' "$@")" '
        NR == 1 {
            for (i = 1; i <= NF; i++) at[$i] = i
            n = split(names, pairs, ";") - 1
            printf "| iteration |"
            for (k = 1; k <= n; k++) { split(pairs[k], pair, "="); column[k] = at[pair[1]]; printf " %s |", pair[2] }
            printf "\n|--:|"
            for (k = 1; k <= n; k++) printf "--:|"
            print ""
            next
        }
        $1 ~ /^(0|10|20|40|60|80|100|120)$/ {
            printf "| %d |", $1
            for (k = 1; k <= n; k++) { value = $column[k]; printf " %.4g |", value < 0 && k == 1 ? -value : value }
            print ""
        }' "cases/$case/study/design/history.csv" > "$work/history.md"
    put "cases/$case/README.md" history "$work/history.md"
}

# numbers CASE: the numbers of the study without those that every run has.
numbers() {
    awk -F, 'BEGIN { print "| run | quantity | value |\n|---|---|--:|" }
        NR > 1 && $2 !~ /^(iteration|seconds|newton_iterations|halvings|energy_balance|.*_work|strain_energy.*)( in .*)?$/ &&
        $2 !~ /^(displacement|rotation|reaction|moment)_.*_[xyz]( in .*)?$/ &&
        $2 !~ /_(contact_area|force_[xyz]|normal_force|friction_force|peak_pressure|open|stick|slip)( in .*)?$/ { printf "| %s | %s | %.4g |\n", $1, $2, $3 }' \
        "cases/$1/study/numbers.csv" > "$work/numbers.md"
    put "cases/$1/README.md" numbers "$work/numbers.md"
}

seal() { history seal objective=spread "least_pressure=least pressure [MPa], at least 0.22" "volume_fraction=volume fraction, at most 0.5"; }

gripper() {
    history gripper "objective=grip [N]" "input_force=input force [N], at most 60" "stress=stress [MPa], at most 30" \
        "volume_fraction=volume fraction, at most 0.3"
}

# force CASE QUANTITY TIME REQUESTED …: a quantity of the last design next to the requested values.
force() {
    local case=$1 quantity=$2
    shift 2
    awk -F, -v points="$*" -v quantity="$quantity" '
        BEGIN {
            print "| pseudo-time | requested [N] | reached [N] |\n|--:|--:|--:|"
            n = split(points, point, " ")
        }
        NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        { for (k = 1; k < n; k += 2) if (sqrt(($3 - point[k]) ^ 2) < 1e-9) printf "| %s | %s | %.2f |\n", point[k], point[k + 1], $at[quantity] }
    ' "cases/$case/study/design/quantities.csv" > "$work/force.md"
    put "cases/$case/README.md" force "$work/force.md"
}

detent() {
    history detent "objective=distance from the curve" "volume_fraction=volume fraction, at most 0.35"
    force detent insertion_force 0.1 2.0 0.2 5.5 0.35 11.0 0.45 11.0 0.55 11.0 0.7 7.7 0.85 4.3 1.0 1.0
}

buffer() {
    history buffer "objective=distance from the curve" "volume_fraction=volume fraction, at most 0.65"
    force buffer push 0.25 0.25 0.5 0.5 0.75 40.0 1.0 120.0
    "$program" render cases/buffer/study/design --curve time push -o docs/figures/buffer_force.png
}

snap() {
    local study=cases/snap/study
    {
        echo "| viscosity [N/mm⁴] | Newton iterations | sum of six forces [N] | viscous work [N mm] | strain energy [N mm] | force [N] |"
        echo "|--:|--:|--:|--:|--:|--:|"
        for run in more_viscous=3e-3 start=3e-4 less_viscous=3e-5; do
            number() { awk -F, -v run="${run%=*}" -v name="$1" '$1 == run && $2 == name { print $3 }' $study/numbers.csv; }
            awk -F, -v c="${run#*=}" -v n="$(number newton_iterations)" -v sum="$(number objective)" '
                NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
                { work = $at["viscous_work"]; stored = $at["strain_energy"]; force = -$at["push"] }
                END { printf "| %s | %d | %.2f | %.3f | %.2f | %.2f |\n", c, n, -sum, work, stored, force }' "$study/${run%=*}/quantities.csv"
        done
    } > "$work/viscosity.md"
    put cases/snap/README.md viscosity "$work/viscosity.md"
    "$program" render $study/more_viscous $study/start $study/less_viscous --curve time push -o docs/figures/snap_force.png
}

# clutch RUN NAME EVERY: every so many rows of the history of a run of the clutch.
clutch() {
    awk -F, -v every="$3" '
        BEGIN { print "| iteration | θ | volume fraction | open / slipping at the end | Newton iterations | s |\n|--:|--:|--:|--:|--:|--:|" }
        NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        $1 % every == 0 {
            printf "| %d | −%.2f | %.4f | %d / %d | %d | %.0f |\n", $1, -$at["objective"], $at["volume_fraction"], $at["open"],
                $at["slip"], $at["newton_iterations"], $at["seconds"]
        }' "cases/clutch/$1/history.csv" > "$work/$2.md"
    put cases/clutch/README.md "$2" "$work/$2.md"
}

full_clutch() { clutch full/full full 1; }

finer_clutch() { clutch finer/eighth eighth 10; }

mapped_clutch() { clutch mapped/mapped mapped 1; }

# What is kept of the half-ball at the paper's size: all iterations, a table of them, and the final designs with their
# gradients. Runs that are not there keep their rows.
half_ball_paper() {
    local case=cases/half_ball_on_plate kept=docs/figures/half_ball_paper.csv run from
    local columns=iteration,objective,volume_fraction,change,optimality,newton_iterations,increments,open,stick,slip
    for run in frictionless_last friction_last frictionless_all friction_all penalty augmented; do
        from=$case/paper/$run/history.csv
        if [ ! -e "$from" ]; then
            grep "^$run," $kept || true
            continue
        fi
        awk -F, -v run=$run -v columns=$columns '
            NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; n = split(columns, column, ","); next }
            { printf "%s", run; for (k = 1; k <= n; k++) printf ",%s", $at[column[k]]; print "" }
        ' "$from"
        from=$case/paper/${run}_gradient/gradient.csv
        [ ! -e "$from" ] || awk -F, '
            NR == 1 { print; next }
            { printf "%s,%s,%.6g,%.6g\n", $1, $2, $3, $4 }' "$from" >"$case/designs/$run.csv"
    done >"$work/rows"
    { echo run,$columns; cat "$work/rows"; } >$kept
    awk -F, '
        FILENAME ~ /numbers.csv$/ { number[$1, $2] = $3; next }
        function theta(value) { return sprintf((value < -1000) ? "−%.1f" : "−%.2f", -value) }
        function known(key) { return key in number ? sprintf(" %.2g |", number[key]) : " – |" }
        BEGIN {
            n = split("0 10 20 30 40 100 200", shown, " ")
            printf "| run |"
            for (k = 1; k <= n; k++) printf " θ at %d |", shown[k]
            printf " least θ | asymmetry x | asymmetry z |\n|---|"
            for (k = 1; k <= n + 3; k++) printf "--:|"
            print ""
        }
        function row(k) {
            printf "| `%s` |", run
            for (k = 1; k <= n; k++) printf " %s |", shown[k] in at ? theta(at[shown[k]]) : "–"
            printf " %s at %d |%s%s\n", theta(at[best]), best, known(run SUBSEP "asymmetry x"),
                known(run SUBSEP "asymmetry z")
        }
        $1 != run { if (run != "") row(); run = $1; best = $2; split("", at) }
        { at[$2] = $3; if ($3 < at[best]) best = $2 }
        END { row() }
    ' "$case/paper/numbers.csv" "$work/rows" >"$work/paper.md"
    put $case/README.md paper "$work/paper.md"
}

for case in ${*:-seal gripper detent buffer snap}; do
    case $case in
    *_clutch)
        "$program" study "cases/clutch/${case%_clutch}.toml"
        "$case"
        ;;
    half_ball_paper)
        "$program" study cases/half_ball_on_plate/paper.toml
        "$case"
        ;;
    *)
        "$program" study "cases/$case/study.toml"
        "$case"
        [ "$case" = snap ] || numbers "$case"
        ;;
    esac
done
