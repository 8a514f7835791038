#!/usr/bin/env bash
# Reads the decks of CalculiX' own test suite that have contact or ties, solves those that are accepted with
# CalculiX and with slipstick, and tabulates the deviation of all displacements at the end, or why a deck is refused.
#
#   docs/decks/suite.sh > table.md
#   docs/decks/suite.sh --without-contact > table.md     its static decks of solid elements without contact
#
# needs `ccx`, `slipstick` and `python3` on the path, and Debian's package calculix-ccx-test, which is downloaded to a
# temporary folder.
set -euo pipefail
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get download -q calculix-ccx-test >&2
dpkg -x calculix-ccx-test_*.deb package
mkdir decks
find package -name '*.inp.gz' -exec sh -c 'gunzip -c "$1" > "decks/$(basename "$1" .gz)"' _ {} \;
find package -name '*.inp' -exec cp {} decks \;
python3 "$here/suite.py" decks "$@"
