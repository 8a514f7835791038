# Shared by the scripts that measure on ranks; `source` it at the root of the repository.

export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
source docs/measure/tables.sh
cargo build --release --features petsc
program=$programs/slipstick

# The clutch at a fraction of its size, with PETSc.
clutch() {
    local scale=$1
    awk -v s="$scale" '
        /hollow_cylinder/ {
            match($0, /elements = \[[^]]*\]/)
            split(substr($0, RSTART + 12, RLENGTH - 13), n, ",")
            list = int(s * n[1] + 0.5) ", " 2 * int(s * n[2] / 2 + 0.5) ", " int(s * n[3] + 0.5)
            $0 = substr($0, 1, RSTART - 1) "elements = [" list "]" substr($0, RSTART + RLENGTH)
        }
        { print }
        END { print "[solver]\nlinear = \"petsc\"" }
    ' cases/clutch/case.toml
}
