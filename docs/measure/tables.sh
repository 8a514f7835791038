# For the scripts that put what they measure between the marks of a page; `source` it at the root of the repository.

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
programs=${CARGO_TARGET_DIR:-target}/release

# put PAGE NAME FILE: puts a file between <!-- NAME --> and <!-- end --> of a page.
put() {
    awk -v name="<!-- $2 -->" -v file="$3" '
        $0 == name { print; while ((getline line < file) > 0) print line; skip = 1; next }
        skip && $0 == "<!-- end -->" { skip = 0 }
        !skip { print }
    ' "$1" >"$work/page" && cp "$work/page" "$1"
}
