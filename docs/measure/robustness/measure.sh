#!/usr/bin/env bash
# Runs what docs/measurements/robustness.md tells and puts its tables between the marks of that page; under an hour on two idle cores.
# `measure.sh NAME …` repeats single ones: kills, faults, memory, random_gradients, hard, setups; and `fuzz SECONDS`, which runs every
# fuzz target for so long and adds its executions to docs/measure/robustness/fuzz.csv; and `mutations`, which asks cargo-mutants for a
# sample, runs the tests with each (docs/measure/robustness/mutations.py) and adds what they noticed to docs/measure/robustness/mutations.csv.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
tables=$work

tests() { SLIPSTICK_TABLES=$tables cargo test --release "$@"; }

setups() {
    cargo build --release -p slipstick-cli
    docs/measure/robustness/setups/setups.py --out "$work/setups"
    put docs/measurements/robustness.md setups "$work/setups/setups.md"
    cp "$work/setups/setups.csv" docs/measure/robustness/setups.csv
}

kills() {
    SLIPSTICK_KILLS=${SLIPSTICK_KILLS:-120} tests -p slipstick-cli --test program killed
    put docs/measurements/robustness.md kills "$tables/kills.md"
}

faults() {
    tests -p slipstick-cli --test program faults
    {
        printf '| fault | attempts | exit codes | runs resumed bit for bit after the fault was fixed |\n|---|---|---|---|\n'
        cat "$tables"/faults_*.md
    } > "$tables/faults.md"
    put docs/measurements/robustness.md faults "$tables/faults.md"
}

memory() {
    tests -p slipstick-cli --test program table_of_memory -- --ignored
    put docs/measurements/robustness.md memory "$tables/memory.md"
}

hard() {
    tests -p slipstick --test suite jumps::table_of -- --ignored
    put docs/measurements/robustness.md jumps "$tables/jumps.md"
    put docs/measurements/robustness.md onset "$tables/onset.md"
}

random_gradients() {
    tests -p slipstick --test random_gradients -- --ignored
    put docs/measurements/robustness.md random_gradients "$tables/random_gradients.md"
    { head -n 2 "$tables/random_gradients.md"; cat "$tables"/random_kind_*.md; } > "$tables/random_kinds.md"
    put docs/measurements/robustness.md random_kinds "$tables/random_kinds.md"
}

# One target after the other; libFuzzer tells its executions at the end.
fuzz() {
    local record=docs/measure/robustness/fuzz.csv seeds target log
    for target in case model gmsh abaqus deck vtu density checkpoint start_values; do
        seeds=() words=()
        case $target in
        gmsh | abaqus | vtu) seeds=(crates/meshio/tests/data) ;;
        case | model) words=(-dict=fuzz/case.dict) ;;
        esac
        log=$tables/$target.log
        cargo fuzz run -s none "$target" "fuzz/corpus/$target" "${seeds[@]}" -- \
            "${words[@]}" -max_total_time="$1" -timeout=5 -rss_limit_mb=1024 -print_final_stats=1 > "$log" 2>&1 \
            || { tail -n 40 "$log"; echo "a finding of $target: see fuzz/artifacts/$target"; }
        awk -F'[ :]+' -v target="$target" -v seconds="$1" -v version="$(git rev-parse --short HEAD)" '
            /number_of_executed_units/ { n = $3 }
            /SUMMARY: libFuzzer/ { findings = 1 }
            END { printf "%s,%s,%s,%d,%d\n", version, target, seconds, n, findings }' "$log" >> "$record"
    done
    fuzz_table
}

# The sums of docs/measure/robustness/fuzz.csv: version, target, seconds, executions, findings.
fuzz_table() {
    awk -F, '
        NR > 1 { if (!($2 in s)) order[++n] = $2; s[$2] += $3; e[$2] += $4; f[$2] += $5; S += $3; E += $4; F += $5 }
        END {
            print "| target | minutes | executions | findings |\n|---|---|---|---|"
            for (i = 1; i <= n; i++) printf "| `%s` | %.0f | %d | %d |\n", order[i], s[order[i]] / 60, e[order[i]], f[order[i]]
            printf "| together | %.0f | %d | %d |\n", S / 60, E, F
        }' docs/measure/robustness/fuzz.csv > "$tables/fuzz.md"
    put docs/measurements/robustness.md fuzz "$tables/fuzz.md"
}

mutations() {
    docs/measure/robustness/mutations.py docs/measure/robustness/mutations.csv "${SLIPSTICK_MUTATIONS:-target/mutations}"
    mutations_table
}

# The latest version in docs/measure/robustness/mutations.csv, next to what the crate's own tests noticed in
# the first version. Columns: version, crate, sampled, unviable, noticed by the crate's tests, noticed
# only by the facade's tests, not noticed.
mutations_table() {
    awk -F, '
        function row(name, r, first) {
            printf "| %s | %d | %d | %d | %d | %d | %d | %.1f %% | %.1f %% |\n", name, r[3], r[4], first, r[5], r[6], r[7],
                100 * first / (r[3] - r[4]), 100 * (r[5] + r[6]) / (r[3] - r[4])
        }
        NR > 1 {
            if (!($2 in last)) { order[++n] = $2; first[$2] = $5 }
            last[$2] = $0
        }
        END {
            print "| crate | sampled | do not compile | noticed by its own tests at first | now | noticed only by tests of the facade |" \
                " not noticed | share at first, own tests | share now |"
            print "|---|---|---|---|---|---|---|---|---|"
            for (i = 1; i <= n; i++) {
                split(last[order[i]], r)
                for (k = 3; k <= 7; k++) R[k] += r[k]
                sum += first[order[i]]
                row("`" order[i] "`", r, first[order[i]])
            }
            row("together", R, sum)
        }' docs/measure/robustness/mutations.csv > "$tables/mutations.md"
    put docs/measurements/robustness.md mutations "$tables/mutations.md"
}

if [ "${1:-}" = fuzz ]; then
    fuzz "${2:-600}"
else
    for name in ${*:-kills faults memory random_gradients hard setups}; do
        "$name"
    done
fi
