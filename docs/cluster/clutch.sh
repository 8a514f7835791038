# For the scripts that measure the clutch in parts of its size; `source` it at the root of the repository.

# The clutch in a part of its size, by PETSc.
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
