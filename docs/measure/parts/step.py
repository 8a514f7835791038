#!/usr/bin/env python3
"""Writes designs as STEP files, reads them with Open CASCADE, and prints a table.

    python3 docs/measure/parts/step.py --slipstick target/release/slipstick LABEL=RESULTS …

"triangles" are those of the design's surface, "volume" is the deviation of the solids' volume from that of the
triangles that they are made from, "healing" is what Gmsh's `healShapes` changes: "none" if neither the numbers
of points, edges, faces and solids nor the volume, to 1e-9. It needs Python with Gmsh (pip install gmsh).
"""
import argparse
import json
import subprocess
import tempfile
import time
from pathlib import Path

import gmsh


def seen():
    gmsh.model.occ.synchronize()
    volumes = [gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3)]
    return [len(gmsh.model.getEntities(dimension)) for dimension in range(4)], sum(volumes)


def row(slipstick, label, results, folder):
    file = folder / "solids.step"
    words = [slipstick, "export", results, "--step", file, "--force", "--json"]
    lines = subprocess.run(words, check=True, capture_output=True, text=True).stdout.splitlines()
    told = json.loads(lines[-1])
    gmsh.clear()
    gmsh.logger.start()
    begin = time.process_time()
    gmsh.model.occ.importShapes(str(file))
    (before, volume), seconds = seen(), time.process_time() - begin
    gmsh.model.occ.healShapes([], 1e-7)
    after, healed = seen()
    if any(line.startswith(("Error", "Warning")) for line in gmsh.logger.get()):
        raise SystemExit(f"{label}: {gmsh.logger.get()}")
    gmsh.logger.stop()
    same = before == after and abs(healed / volume - 1) < 1e-9
    of, megabytes = told["step"], file.stat().st_size / 1e6
    triangles = sum(body["volume"] for body in of["bodies"])
    return (
        f"| {label} | {told['triangles']} | {of['planes']} | {of['curved']} | {of['facets']} | {volume / triangles - 1:+.3%} "
        f"| {'none' if same else 'some'} | {megabytes:.2f} | {5e4 * megabytes / told['triangles']:.1f} | {seconds:.1f} |"
    )


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--slipstick", required=True)
    options.add_argument("designs", nargs="+", metavar="LABEL=RESULTS")
    options = options.parse_args()
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    print("| design | triangles | plane faces | curved faces | facets | volume | healing | file [MB] | MB per 50,000 | Open CASCADE reads in [processor s] |")
    print("|---|--:|--:|--:|--:|--:|---|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as folder:
        for design in options.designs:
            label, results = design.split("=", 1)
            print(row(options.slipstick, label, results, Path(folder)), flush=True)


if __name__ == "__main__":
    main()
