#!/usr/bin/env bash
# How closely designs on several ranks agree with those of the default solvers: ten iterations of the coarse examples, and
# the gradient at the resulting design, each solver compared with the first. Inserts its table into docs/measurements/cluster.md. Needs
# PETSc and mpirun. (Violations of the clutch's contact conditions stall at 2e-10, so their tolerance is 1e-9.)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/cluster/ranks.sh
runs=$work

# The largest difference between a column of two tables, relative to the largest value of the first.
apart() {
    paste -d, <(cut -d, -f"$1" "$2") <(cut -d, -f"$1" "$3") | awk -F, '
        NR > 1 { d = $1 - $2; d = d < 0 ? -d : d; v = $1 < 0 ? -$1 : $1; if (!(d <= m)) m = d; if (v > s) s = v }
        END { printf "%.0e", m / s }'
}

# run NAME WORDS… : runs the program, directly or with mpirun, on the case, and its gradient at the default's last design.
# The path of that design has no guide: it takes more steps if it would otherwise be cut back, which depends on round-off
run() {
    local name=$1
    shift
    rm -rf "${runs:?}/$name"
    told "$name" "$@" optimize "$case" --iterations 10 --out "$runs/$name"
    told "$name" "$@" gradient "$case" --design "$runs/default" --out "$runs/$name/gradient" ${steps:+--set "load_path.steps=$steps"}
}

told() {
    local name=$1
    shift
    "$@" --set load_path.tolerance.relative=1e-12 \
        ${enforcement:+--set "contact[0].enforcement=$enforcement"} ${solver:+--set "solver.linear=$solver"} \
        </dev/null >"$runs/$name.log" 2>&1 || { cat "$runs/$name.log"; exit 1; }
}

# against NAME: compares objectives, densities and gradient of the last run with the default's
against() {
    printf ' %s, %s, %s |' "$(apart 2 "$runs/default/history.csv" "$runs/$1/history.csv")" \
        "$(apart 3 "$runs/default/design.csv" "$runs/$1/design.csv")" \
        "$(apart 4 "$runs/default/gradient/gradient.csv" "$runs/$1/gradient/gradient.csv")"
}

table=$runs/table
printf '| example | `"multifrontal"` | 1 rank | 2 ranks | 4 ranks |\n|---|---|---|---|---|\n' >"$table"
while IFS='|' read -r name directory enforcement steps; do
    case=cases/$directory/coarse.toml
    solver='' run default "$program"
    {
        printf '| %s |' "$name"
        solver=multifrontal run f64 "$program"
        against f64
        for ranks in 1 2 4; do
            solver=petsc run "$ranks" mpirun --oversubscribe -n "$ranks" "$program" --threads 1
            against "$ranks"
        done
        printf '\n'
    } | tee -a "$table"
done <<'CASES'
half ball, Lagrange|half_ball_on_plate|{ lagrange = {} }
half ball, penalty|half_ball_on_plate|{ penalty = {} }
half ball, augmented|half_ball_on_plate|{ augmented = { tolerance = 1e-11 } }
ironing, Lagrange|ironing||30
clutch, augmented|clutch|{ augmented = { tolerance = 1e-9 } }
CASES
put docs/measurements/cluster.md agree "$table"
