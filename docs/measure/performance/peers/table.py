"""Prints the table of docs/measurements/performance.md from the records of run.py: `table.py DIRECTORY CASE …`."""

import json
import math
import pathlib
import sys

PROGRAMS = {"slipstick": "slipstick", "getfem": "GetFEM", "calculix": "CalculiX"}
# Records of a case, in the order of the rows; only those that exist.
ROWS = ["slipstick", "getfem", "calculix", "calculix-2"]


def row(record):
    """Forces on the driven surface, increments, iterations, cost; what is missing if the run did not finish."""
    at = {round(force["time"], 9): force["reaction"] for force in record["forces"]}
    cells = [f"{PROGRAMS[record['program']]} {record['version']}, {record['method']}, {record['steps']} steps"]
    pressed, end = at.get(record["pressed"]), at.get(1.0)
    cells.append(f"{-pressed[1]:.2f}" if pressed else "–")
    if end:
        cells += [f"{-end[1]:.2f}", f"{math.hypot(end[0], end[2]):.2f}"]
    else:
        cells += [f"stopped at t = {record['reached']:.3g}", "–"]
    drawn = [math.hypot(force[0], force[2]) for time, force in at.items() if time > record["pressed"]]
    cells.append(f"{min(drawn):.2f}–{max(drawn):.2f}" if drawn else "–")
    increments = sum(force["time"] > 0 for force in record["forces"])
    cells += [f"{increments}", f"{record['newton']}", f"{record['seconds']:.1f}", f"{record['memory']:.0f}"]
    return "| " + " | ".join(cells) + " |"


def main(folder, *cases):
    print("| program, contact | F_n, pressed | F_n, end | F_t, end | F_t, sliding | increments | Newton | processor s | MB |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|")
    for case in cases:
        files = [pathlib.Path(folder) / f"{case}-{name}.json" for name in ROWS]
        records = [json.loads(file.read_text()) for file in files if file.exists()]
        print(f"| **{case.replace('_', ' ')}** | | | | | | | | |")
        for record in records:
            print(row(record))


if __name__ == "__main__":
    main(*sys.argv[1:])
