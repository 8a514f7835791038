#!/usr/bin/env python3
"""Compares what ten optimized designs promise with what their parts do, and writes a table.

    python3 docs/measure/parts/promises.py --slipstick target/release/slipstick --out FOLDER [--only NAME]

Each design is optimized for the largest contact force at half the volume, exported with
`export --case`, meshed with the script of the export and solved, all with default options. The
bodies are flat and curved, of hexahedra, tetrahedra (linear and quadratic) and wedges. The table
has, for each quantity, the value of the grey design and the deviation of the part's value from it.
It needs Python with Gmsh and meshio (pip install gmsh meshio).
"""
import argparse
import csv
import json
import sys
from pathlib import Path

import gmsh
from designs import CASE, generated, gmsh_mesh, run

# name, element, shape, size of the elements
DESIGNS = [
    ("hex block", "hex", "block", 2.0), ("hex tube", "hex", "tube", 2.0), ("hex cone", "hex", "cone", 2.0),
    ("tet plate with holes", "tet", "plate with holes", 2.0), ("tet barrel", "tet", "barrel", 2.0),
    ("tet tube", "tet", "tube", 2.0), ("tet10 plate with holes", "tet10", "plate with holes", 2.5),
    ("tet10 barrel", "tet10", "barrel", 2.5), ("wedge disc", "wedge", "disc", 2.0), ("wedge tube", "wedge", "tube", 2.0),
]
QUANTITIES = {"punch_ymin_normal_force": "normal force", "punch_ymin_peak_pressure": "peak pressure",
              "strain_energy": "strain energy"}
# coarser than those of the random designs, whose members are thin
COARSE = {"elements = [20, 20, 12]": "elements = [10, 10, 6]", "elements = [7, 32, 16]": "elements = [4, 24, 10]",
          "elements = [12, 8, 20]": "elements = [8, 6, 10]"}


def written(folder, name, elements, kind, size):
    folder.mkdir(parents=True, exist_ok=True)
    top, bottom = ("part_ymax", "part_ymin") if kind == "block" else ("part_top", "part_bottom")
    if elements == "hex":
        shape = generated(kind)
        for fine, coarse in COARSE.items():
            shape = shape.replace(fine, coarse)
    else:
        gmsh_mesh(folder / "mesh.msh", kind, elements, size)
        shape = 'mesh = { file = "mesh.msh", part = "part" }'
    case = CASE.format(name=name, shape=shape, top=top, bottom=bottom)
    case = case.replace("density_filter = { radius = 3.0 }", "density_filter = { radius = 3.0 }\nprojection = {}")
    case = case.replace("iterations = 1\n", "iterations = 40\nschedule = { sharpness = [[0, 1], [15, 4], [30, 8]] }\n")
    (folder / "case.toml").write_text(case)


def follow(slipstick, folder, name, elements, kind, size):
    written(folder, name, elements, kind, size)
    steps = [
        ("optimize", [slipstick, "optimize", folder / "case.toml", "--out", folder / "run", "--force", "-q"]),
        ("export", [slipstick, "export", folder / "run", "--case", folder / "part", "--force"]),
        ("mesh", [sys.executable, folder / "part" / "mesh.py"]),
        ("solve", [slipstick, "solve", folder / "part" / "case.toml", "--out", folder / "of_part", "--force", "--json"]),
    ]
    for step, words in steps:
        done = run(*words)
        if done.returncode != 0:
            return f"{step}: {(done.stderr.strip().splitlines() or ['?'])[0]}"
    events = [json.loads(line) for line in done.stdout.splitlines()]
    promises = next(event["promises"] for event in events if event["event"] == "promises")
    grey = list(csv.DictReader(open(folder / "run" / "history.csv")))[-1]["discreteness"]
    record = json.load(open(folder / "part" / "part.json"))
    volume = record["bodies"][0]["volume"] / record["density_volume"] - 1.0
    cells = [name, f"{float(grey):.3f}", f"{volume:+.1%}"]
    for quantity in QUANTITIES:
        found = next((of for of in promises if of["quantity"] == quantity), None)
        cells += ["", ""] if found is None else [f"{found['promised']:.4g}", f"{found['deviation']:+.1%}"]
    return "| " + " | ".join(cells) + " |"


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--slipstick", type=Path, required=True)
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--only", help="only the design of this name")
    given = options.parse_args()
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 1)
    shown = [f"{name} | part" for name in QUANTITIES.values()]
    print("| design | discreteness | volume | " + " | ".join(shown) + " |")
    print("|---|--:|--:|" + "--:|" * (2 * len(QUANTITIES)))
    for name, *design in DESIGNS:
        if given.only in (None, name):
            line = follow(given.slipstick.resolve(), given.out / name.replace(" ", "_"), name, *design)
            print(line if line.startswith("|") else f"| {name} | {line} |", flush=True)


if __name__ == "__main__":
    main()
