#!/usr/bin/env bash
# Time and memory of each rank with the contact-zone preconditioner: one load step of the clutch and its gradient on
# 1, 2 and 4 ranks. Inserts its table into docs/measurements/cluster.md. Needs PETSc; half an hour on two idle cores and 12 GB.
# `zone.sh SIZES` measures other sizes, fractions of the paper's number of elements along each edge, and keeps the
# rows of the rest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/cluster/ranks.sh

measured() {
    local ranks=$1
    mpirun --oversubscribe --bind-to none --mca mpi_yield_when_idle 1 -n "$ranks" \
        "$program" bench "$work/case.toml" --steps 1 --threads 1 --memory 0 --json --quiet >"$work/told" 2>"$work/log" ||
        { cat "$work/log" >&2; return 1; }
    awk -v ranks="$ranks" '
        # the number that follows a key, searched from a given position in the line
        function number(key, from,   rest) {
            rest = substr($0, from)
            return match(rest, "\"" key "\":[-0-9.eE+]+") ? substr(rest, RSTART + length(key) + 3, RLENGTH - length(key) - 3) + 0 : 0
        }
        # the seconds of a phase, in the same way
        function phase(key, from,   rest) {
            rest = substr($0, from)
            return match(rest, "\"" key "\":\\[[-0-9.eE+]+") ? substr(rest, RSTART + length(key) + 4, RLENGTH - length(key) - 4) + 0 : 0
        }
        function peak(x, m) { return x > m ? x : m }
        /"event":"measurement"/ {
            forward = index($0, "\"forward\""); anew = index($0, "\"gradient_without")
            unknowns = number("unknowns", 1); newton = number("newton_iterations", 1)
            step = peak(number("seconds", forward), step); factor = peak(phase("factor", forward), factor)
            solve = peak(phase("solve", forward), solve); back = peak(number("seconds", anew), back)
            f = number("factor_bytes", 1); store = peak(f, store)
            m = number("peak_bytes", 1); memory = peak(m, memory); all += m
        }
        END {
            printf "| %d | %d | %d | %.0f | %.1f | %.1f | %.0f | %.2f | %.2f | %.1f |\n", unknowns, ranks, newton, step,
                factor / newton, solve / newton, back, store * 1e-9, memory * 1e-9, all * 1e-9
        }
    ' "$work/told"
}

for scale in ${*:-0.5 0.75 1 1.5}; do
    clutch "$scale" >"$work/case.toml"
    echo 'petsc_preconditioner = "contact_zone"' >>"$work/case.toml"
    for ranks in 1 2 4; do
        measured "$ranks" | tee -a /dev/stderr
    done
done >"$work/rows"
{
    echo '| unknowns | ranks | Newton | step [s] | setup per Newton iteration [s] | solves per Newton iteration [s] | adjoint [s] | zone factors per rank [GB] | peak memory per rank [GB] | of all ranks [GB] |'
    echo '|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|'
    { cat "$work/rows"; sed -n '/^<!-- zone -->/,/^<!-- end -->/p' docs/measurements/cluster.md | grep '^| [0-9]'; } |
        awk -F'|' '!seen[$2, $3]++' | sort -t'|' -k2,2n -k3,3n
} >"$work/table"
put docs/measurements/cluster.md zone "$work/table"
