#!/usr/bin/env bash
# Runs a deck with CalculiX and with slipstick, and compares the total force on the nodes of a set.
#
#   cases/punch/ccx.sh cases/punch/punch.inp DRIVEN [OPTIONS OF slipstick solve]
#
# needs `ccx` and `slipstick` on the path. The deck must print the total force on the set (*NODE PRINT, TOTALS=ONLY),
# and its conditions must hold only this set and sets at rest.
set -euo pipefail
deck=$(realpath "$1")
set=$2
shift 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
name=$(basename "$deck" .inp)
cp "$deck" "$folder"
cd "$folder"
ccx -i "$name" > ccx.log
slipstick solve "$name.inp" --quiet "$@"
python3 - "$name" "$set" <<'PYTHON'
import csv, re, sys
name, which = sys.argv[1:]
text = open(name + ".dat").read()
found = re.findall(r"for set (\S+) and time\s+(\S+)\s+(\S+)\s+(\S+)\s+(\S+)", text)
ccx = {float(t): [float(x) for x in force] for of, t, *force in found if of == which.upper()}
rows = list(csv.DictReader(open(name + "_solve/quantities.csv")))
columns = [key for key in rows[0] if re.fullmatch(r"reaction_.*%s_[xyz]" % which, key)]
end = max(ccx)
print("%-6s %-24s %12s %12s %9s" % ("time", "", "ccx", "slipstick", ""))
for row in rows[1:]:
    time = float(row["time"]) * end
    force = next((force for t, force in ccx.items() if abs(t - time) < 1e-6 * end), None)
    for column in columns if force else []:
        there, here = force["xyz".index(column[-1])], float(row[column])
        size = max(abs(x) for x in force)
        print("%-6g %-24s %12.3f %12.3f %8.2f%%" % (time, column, there, here, 100 * (here - there) / size))
PYTHON
