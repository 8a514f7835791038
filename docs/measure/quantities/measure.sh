#!/usr/bin/env bash
# Runs what docs/measurements/quantities.md tells and puts its tables between the marks of that page, and its charts into docs/figures;
# about ten minutes on two idle cores. `measure.sh NAME …` repeats single ones: gradients, peers, balance.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/tables.sh
program=$programs/slipstick

gradients() {
    SLIPSTICK_TABLES=$work cargo test --release -p slipstick --test suite quantity_gradients::
    {
        printf '| quantity | largest error of the derivative |\n|---|--:|\n'
        sort -t'|' -k3 "$work"/quantity_*.md | awk -F'|' '
            { error = $3 + 0; if (!($2 in worst)) order[++n] = $2; if (error > worst[$2]) worst[$2] = error }
            END { for (i = 1; i <= n; i++) printf "|%s| %.0e |\n", order[i], worst[order[i]] }' | sort
    } > "$work/gradients.md"
    put docs/measurements/quantities.md gradients "$work/gradients.md"
}

# column FILE NAME: the values of a column at the last step.
last() { awk -F, -v name="$2" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == name) k = i } END { printf "%.2f", $k }' "$1"; }

peers() {
    local friction run
    {
        printf '| μ | F_t | F_n |\n|--:|--:|--:|\n'
        for friction in 0 0.2; do
            run=$work/block_$friction
            "$program" solve docs/measure/quantities/ironing_block.toml --set "contact[0].friction=$friction" --out "$run" -q
            printf '| %s | %s | %s |\n' "$friction" "$(last "$run/quantities.csv" reaction_die_ends_x)" \
                "$(last "$run/quantities.csv" reaction_die_ends_y)"
        done
    } > "$work/block.md"
    put docs/measurements/quantities.md block "$work/block.md"
    {
        printf '| μ | F_t | F_n |\n|--:|--:|--:|\n'
        for friction in 0 0.2 0.5; do
            run=$work/cube_$friction
            "$program" solve docs/measure/quantities/cube.toml --set "contact[0].friction=$friction" --out "$run" -q
            printf '| %s | %s | %s |\n' "$friction" "$(last "$run/quantities.csv" reaction_cube_ymax_x)" \
                "$(last "$run/quantities.csv" reaction_cube_ymax_y)"
        done
    } > "$work/cube.md"
    put docs/measurements/quantities.md cube "$work/cube.md"
    "$program" render "$work/block_0.2" --curve time reaction_die_ends_x --title "Ironing of a block, friction 0.2" \
        --out docs/figures/ironing_block_ft.png
    "$program" render "$work/block_0.2" --curve time reaction_die_ends_y --title "Ironing of a block, friction 0.2" \
        --out docs/figures/ironing_block_fn.png
}

balance() {
    local steps run method keys
    {
        printf '| enforcement | load steps | external work | strain energy | friction work | energy balance / external work | work balance / external work |\n'
        printf '|---|--:|--:|--:|--:|--:|--:|\n'
        while read -r method keys; do
            for steps in 10 20 40 80; do
                run=$work/balance_${method}_$steps
                "$program" solve cases/half_ball_on_plate/coarse.toml --set "load_path.steps=$steps" \
                    --set "contact[0].enforcement=$keys" --set "design.initial=1" --set "design.volume_fraction=1" --out "$run" -q
                awk -F, -v method="$method" -v steps="$steps" '
                    NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i }
                    END {
                        external = $at["external_work"]; stored = $at["strain_energy"]; friction = $at["friction_work"]
                        printf "| %s | %d | %.5g | %.5g | %.5g | %.1e | %.1e |\n", method, steps, external, stored, friction,
                            $at["energy_balance"] / external, (external - stored - $at["contact_work"]) / external
                    }' "$run/quantities.csv"
            done
        done <<'METHODS'
lagrange {lagrange={}}
penalty {penalty={stiffness=30000,scaling='weighted'}}
METHODS
    } > "$work/balance.md"
    put docs/measurements/quantities.md balance "$work/balance.md"
}

for name in ${*:-gradients peers balance}; do "$name"; done
