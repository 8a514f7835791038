#!/usr/bin/env bash
# Writes docs/developers/crates.md: the crates of the default build, counted by `cargo tree`, and the purpose of each.
#
#   docs/measure/crates/list.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

# Names of all crates below a package, for building and running it on this platform.
names() { cargo tree --offline "$@" -e normal,build --prefix none --no-dedupe | sed 's/ (.*//' | sort -u; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
direct=($(grep -h 'workspace = true' crates/*/Cargo.toml | sed -n 's/^\([a-z0-9_-]*\)\(\.workspace\| = {\).*/\1/p' |
    grep -v -E '^(slipstick|version|edition|rust-version|license|keywords|lints)' | sort -u |
    grep -v -E '^(cc|faer|pkg-config|proptest|pyo3|tempfile)$'))
for crate in "${direct[@]}"; do
    # if the tree has several versions, use the newest
    said=$(cargo pkgid --offline -p "$crate" 2>&1 || true)
    spec=$(sed -n "s/^.*[ #]\($crate@.*\)$/\1/p" <<< "$said" | tail -1)
    names -p "$spec" > "$folder/$crate"
done

# The crates of the workspace that depend on a crate.
users() {
    awk -v crate="$1" '/^\[/ { inside = $0 == "[dependencies]" }
        inside && $0 ~ "^" crate "(\\.workspace)? *=" { print FILENAME }' crates/*/Cargo.toml |
        cut -d/ -f2 | paste -sd, | sed 's/,/, /g'
}

# A crate, its users and purpose; the number of crates below it, and how many of those no other crate in the table needs.
row() {
    local below alone
    below=$(sed '/^'"$1"' /d' "$folder/$1" | wc -l)
    alone=$(comm -23 "$folder/$1" <(find "$folder" -type f ! -name "$1" -exec sort -u {} +) | sed '/^'"$1"' /d' | wc -l)
    printf '| `%s` | %s | %s | %s | %s |\n' "$1" "$(users "$1")" "$below" "$alone" "$2"
}

all=$(names -p slipstick-cli | wc -l)
own=$(names -p slipstick-cli | grep -c -E '^slipstick')
lean=$(names -p slipstick-cli --no-default-features | wc -l)
{
    cat <<TEXT
# The crates that slipstick depends on

The program is built from $all crates, $own of which are its own. With \`--no-default-features\`, which
omits METIS and therefore needs no C compiler, it is built from $lean. This page is written by
\`docs/measure/crates/list.sh\`. The column "below" counts the crates that \`cargo tree\` shows below a crate;
"only" counts how many of these no other crate in the table needs.

| crate | used by | below | only | for |
|---|---|--:|--:|---|
TEXT
    row base64 "binary data in VTU files and in report pages"
    row clap "the command line, its help and errors"
    row clap_complete "command completion in shells"
    row clap_mangen "the manual page"
    row ctrlc "Ctrl-C stops a run when the current Newton iteration ends"
    row flate2 "compressed VTU files"
    row getrandom "the token in the address of \`slipstick ui\`"
    row indicatif "the progress bar"
    row libloading "the CUDA driver and cuDSS at run time; only in builds with the feature \`cudss\`"
    row lz4_flex "VTU files compressed with LZ4"
    row lzma-rs "VTU files compressed with LZMA"
    row metis-sys "nested dissection by METIS (a C library, Apache 2.0, bundled); feature \`metis\`"
    row miette "errors that show the line of the case file"
    row nalgebra "vectors and matrices of size three"
    row num-dual "dual numbers: derivatives of small problems, and reference derivatives in tests"
    row png "pictures"
    row pulp "SIMD for the instruction set detected at run time"
    row quick-xml "VTU and 3MF files"
    row rayon "parallel loops"
    row robust "exact predicates: whether triangles of exported surfaces cross"
    row schemars "the JSON schema of case files"
    row serde "case files, checkpoints, JSON"
    row serde_json "checkpoints, records of runs, \`--json\`"
    row sha2 "hashes of meshes and checkpoints"
    row smallvec "lists of right-hand sides in substitution; a single one needs no allocation"
    row strsim "“did you mean”"
    row thiserror "error types"
    row toml "case files, with the position of every value"
    row toml_edit "\`--set\`"
    row zip "3MF files"
    cat <<'TEXT'

`proptest` (random inputs), `tempfile` and `faer` (an independent sparse LU) are used only in tests and
benchmarks.

About 700 lines in `views/src/render` and `picture.rs` draw charts and the text in pictures. We
tried libraries and kept our own code: `plotters`, `kuva` and `charts-rs` depend on `ttf-parser`,
which is no longer maintained (RUSTSEC-2026-0192); `skrifa` with `ab_glyph_rasterizer` would replace
only the code that draws glyphs, and would add about half a minute to the first build.

The server of `slipstick ui` (`cli/src/ui/http.rs`, about 230 lines) uses the standard library:
one request per connection, with a deadline and with limits for size and number. `tiny_http` 0.12
would add five crates, and sets no deadline for a request that arrives slowly.
TEXT
    printf '\nLicences: %s.\n' "$(cargo tree --offline -p slipstick-cli -e normal,build --prefix none --no-dedupe -f '{p}|{l}' |
        sed 's/.*|//' | sort -u | sed '/^$/d' | paste -sd';' | sed 's/;/; /g')"
} > docs/developers/crates.md.new
mv docs/developers/crates.md.new docs/developers/crates.md
