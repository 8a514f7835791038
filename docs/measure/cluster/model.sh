#!/usr/bin/env bash
# Work, memory and communication of each rank: one load step of the clutch and its gradient, in three sizes on 1, 2 and 4
# ranks, with MUMPS. Inserts its table into docs/measurements/cluster.md. Needs PETSc, and OpenMPI to count bytes; half an hour on two
# idle cores and 20 GB. `model.sh SIZES` uses other sizes: fractions of the paper's number of elements along each edge.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/cluster/ranks.sh

# Bytes sent by all ranks, as counted by OpenMPI: for MUMPS, PETSc and slipstick.
sent() { awk '/^E/ { sum += $4 } END { printf "%.3f", sum / 1e9 }' "$work"/bytes.*.prof; }

measured() {
    local scale=$1 ranks=$2
    rm -f "$work"/bytes.*.prof
    mpirun --oversubscribe --bind-to none --mca mpi_yield_when_idle 1 --mca pml_monitoring_enable 1 \
        --mca pml_monitoring_enable_output 3 --mca pml_monitoring_filename "$work/bytes" -n "$ranks" \
        "$program" bench "$work/case.toml" --steps 1 --threads 1 --memory 20GiB --json --quiet >"$work/told" 2>"$work/log" ||
        { cat "$work/log" >&2; return 1; }
    sent=$(sent) awk -v ranks="$ranks" '
        # the number that follows a key, searched from a given position in the line
        function number(key, from,   rest) {
            rest = substr($0, from)
            return match(rest, "\"" key "\":[-0-9.eE+]+") ? substr(rest, RSTART + length(key) + 3, RLENGTH - length(key) - 3) + 0 : 0
        }
        function peak(x, m) { return x > m ? x : m }
        /"event":"measurement"/ {
            forward = index($0, "\"forward\""); kept = index($0, "\"gradient\""); anew = index($0, "\"gradient_without")
            unknowns = number("unknowns", 1); newton = number("newton_iterations", 1)
            factors = number("factorizations", forward)
            work = number("operations", 1); all += work; most = peak(work, most)
            f = number("factor_bytes", 1); held += f; store = peak(f, store)
            memory = peak(number("peak_bytes", 1), memory)
            seconds = number("seconds", forward); back = number("seconds", anew); solve = number("seconds", kept)
            told = peak(number("bytes_sent", forward), told)
            split($0, phase, "\"factor\":\\["); split(phase[2], part, ","); factor = peak(part[1], factor)
            elements = peak(number("elements_here", 1), elements); sum += number("elements_here", 1)
        }
        END {
            n = factors + 1
            printf "| %d | %d | %d | %d | %.1f | %.2f | %.2f | %.1f | %.1f | %.2f | %.2f | %.2f | %.2f | %.2f | %.1f |\n", unknowns, ranks, newton,
                factors, seconds, solve, back, all / n * 1e-9, factor / factors, most * ranks / all, elements * ranks / sum,
                store * 1e-9, memory * 1e-9, ENVIRON["sent"] / n, told / newton * 1e-6
        }
    ' "$work/told"
}

{
    echo '| unknowns | ranks | Newton | factorizations | step [s] | adjoint, factors kept [s] | adjoint, refactorized [s] | Gflop per factorization | time per factorization [s] | balance of work | balance of elements | factors per rank [GB] | peak memory per rank [GB] | sent by all ranks per factorization [GB] | vectors sent per rank and Newton iteration [MB] |'
    echo '|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|'
    for scale in ${1-0.5 0.7 1}; do
        clutch "$scale" >"$work/case.toml"
        for ranks in 1 2 4; do
            measured "$scale" "$ranks" | tee -a /dev/stderr
        done
    done
} >"$work/table"
put docs/measurements/cluster.md model "$work/table"
