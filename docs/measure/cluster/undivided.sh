#!/usr/bin/env bash
# Replicated and distributed data of each rank, without factors: peak memory of a rank on 2, 4 and 8 ranks, up to the first
# factorization, with the diagonal instead of factors, so that the run ends there. Prints the fit c + w n + d n / P. Needs
# PETSc; takes a few minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

source docs/measure/cluster/ranks.sh

# Runs the given command and writes its peak memory in kB.
cat >"$work/peak" <<'END'
#!/usr/bin/env bash
"$@" >/dev/null 2>&1 &
while grep VmHWM "/proc/$!/status" 2>/dev/null; do sleep 0.05; done | awk 'END { print "peak", $2 }'
END
chmod +x "$work/peak"

for scale in 0.5 0.7; do
    clutch "$scale" >"$work/case.toml"
    echo 'petsc_options = "-ksp_type preonly -pc_type jacobi"' >>"$work/case.toml"
    unknowns=$("$program" check "$work/case.toml" --json 2>/dev/null |
        grep -o '"unknowns":[0-9]*' | head -1 | cut -d: -f2)
    for ranks in 2 4 8; do
        mpirun --oversubscribe --bind-to none --mca mpi_yield_when_idle 1 -n "$ranks" \
            "$work/peak" "$program" bench "$work/case.toml" --steps 1 --threads 1 |
            awk -v n="$unknowns" -v p="$ranks" '$2 > m { m = $2 } END { print n, p, 1.024e-3 * m }'
    done
done | tee /dev/stderr | awk '
    # least squares with the normal equations of (1, n, n / P)
    { f[1] = 1; f[2] = $1; f[3] = $1 / $2
      for (i = 1; i <= 3; i++) { b[i] += f[i] * $3; for (j = 1; j <= 3; j++) a[i, j] += f[i] * f[j] } }
    END {
        for (k = 1; k <= 3; k++) for (i = k + 1; i <= 3; i++) {
            r = a[i, k] / a[k, k]; b[i] -= r * b[k]
            for (j = k; j <= 3; j++) a[i, j] -= r * a[k, j]
        }
        for (k = 3; k >= 1; k--) { x[k] = b[k]; for (j = k + 1; j <= 3; j++) x[k] -= a[k, j] * x[j]; x[k] /= a[k, k] }
        printf "%.0f MB + %.2f kB n + %.1f kB n / P\n", x[1], 1e3 * x[2], 1e3 * x[3]
    }'
