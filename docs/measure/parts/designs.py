#!/usr/bin/env python3
"""Takes twenty designs through `export --case` and Gmsh with default options, and writes a table.

    python3 docs/measure/parts/designs.py --slipstick target/release/slipstick --out FOLDER [--only NAME] [--seed N]

Each design is a random field of densities, smoothed over a few elements and projected, so that it
has members of the size of this smoothing, cavities, and pieces of its own; it is solid at the
supports and the contact face. The bodies are curved and flat, of hexahedra, tetrahedra (linear and
quadratic) and wedges. For each part, the table states the pairs of crossing triangles, counted by
the program (in the exported surface and in the part), pieces, loose pieces left out, the volume
relative to that of the densities, and the elements of Gmsh's mesh with their worst quality.
It needs Python with Gmsh and meshio (pip install gmsh meshio).
"""
import argparse
import csv
import json
import math
import random
import re
import subprocess
import sys
from pathlib import Path

import gmsh
import meshio

CASE = """
title = "{name}"
[units]
length = "mm"
force = "N"
[[body]]
name = "part"
{shape}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "punch"
box = {{ min = [-4, 20.0, -4], max = [4, 24, 4], elements = [4, 2, 4] }}
material = {{ neo_hooke = {{ youngs_modulus = 5000.0, poisson_ratio = 0.3 }} }}
[[contact]]
slave = "punch_ymin"
master = "{top}"
friction = 0.2
[[dirichlet]]
set = "{bottom}"
[[dirichlet]]
set = "punch_ymax"
motion = [{{ t = 1.0, u = [0, -0.05, 0] }}]
[load_path]
steps = 1
[design]
bodies = ["part"]
volume_fraction = 0.5
density_filter = {{ radius = 3.0 }}
passive_solid = [{{ surface = "{top}", within = 3.0 }}, {{ surface = "{bottom}", within = 3.0 }}]
[objective]
contact_force = {{}}
[optimizer]
iterations = 1
"""


def solid_of(kind):
    """The solid of a shape in Gmsh, with its top at y = 20 and its bottom at y = 0."""
    occ = gmsh.model.occ
    if kind == "plate with holes":
        body = [(3, occ.addBox(-10, 0, -4, 20, 20, 8))]
        holes = [(3, occ.addCylinder(x, 10, -5, 0, 0, 10, 2.5)) for x in (-5, 5)]
        return occ.cut(body, holes)[0]
    if kind == "barrel":
        return [(3, occ.addCylinder(0, 0, 0, 0, 20, 0, 9))]
    if kind == "tube":
        return occ.cut([(3, occ.addCylinder(0, 0, 0, 0, 20, 0, 10))], [(3, occ.addCylinder(0, 0, 0, 0, 20, 0, 3))])[0]
    raise ValueError(kind)


def gmsh_mesh(file, kind, elements, size):
    gmsh.clear()
    gmsh.model.add("part")
    if elements == "wedge":
        occ = gmsh.model.occ
        flat = [(2, occ.addDisk(0, 0, 0, 10, 10, zAxis=[0, 1, 0]))]
        if kind == "tube":
            flat = occ.cut(flat, [(2, occ.addDisk(0, 0, 0, 3, 3, zAxis=[0, 1, 0]))])[0]
        occ.extrude(flat, 0, 20, 0, numElements=[round(20 / size)])
    else:
        solid_of(kind)
    gmsh.model.occ.synchronize()
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    gmsh.model.addPhysicalGroup(3, volumes, name="part")
    for _, tag in gmsh.model.getEntities(2):
        box = gmsh.model.getBoundingBox(2, tag)
        name = {0: "part_bottom", 20: "part_top"}.get(round(box[1], 3) if abs(box[4] - box[1]) < 1e-3 else None)
        if name:
            gmsh.model.addPhysicalGroup(2, [tag], name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5 * size)
    gmsh.model.mesh.generate(3)
    if elements == "tet10":
        gmsh.model.mesh.setOrder(2)
    gmsh.write(str(file))


def generated(kind):
    return {
        "block": "box = { min = [-10, 0, -6], max = [10, 20, 6], elements = [20, 20, 12] }",
        "tube": "hollow_cylinder = { inner_radius = 3.0, outer_radius = 10.0, height = 20.0, elements = [7, 32, 16] }",
        "cone": "cone = { height = 20.0, bottom_radius = 11.0, top_radius = 8.0, elements = [12, 8, 20] }",
    }[kind]


# name, element, shape, size of the elements, radius of the smoothing, sharpness of the projection
DESIGNS = [
    ("hex block", "hex", "block", 1.0, 2.5, 8), ("hex block, thin", "hex", "block", 1.0, 1.2, 30),
    ("hex block, grey", "hex", "block", 1.0, 2.5, 2), ("hex tube", "hex", "tube", 1.0, 2.5, 8),
    ("hex tube, thin", "hex", "tube", 1.0, 1.3, 30), ("hex cone", "hex", "cone", 1.0, 2.5, 8),
    ("tet plate", "tet", "plate with holes", 1.2, 2.5, 8), ("tet plate, thin", "tet", "plate with holes", 1.2, 1.3, 30),
    ("tet plate, grey", "tet", "plate with holes", 1.2, 2.5, 2), ("tet barrel", "tet", "barrel", 1.3, 3.0, 8),
    ("tet barrel, thin", "tet", "barrel", 1.3, 1.4, 30), ("tet tube", "tet", "tube", 1.3, 3.0, 8),
    ("tet tube, coarse", "tet", "tube", 2.5, 3.5, 30), ("tet10 plate", "tet10", "plate with holes", 2.0, 3.0, 8),
    ("tet10 barrel", "tet10", "barrel", 2.2, 3.0, 8), ("tet10 tube, thin", "tet10", "tube", 2.0, 2.2, 30),
    ("wedge disc", "wedge", "disc", 1.3, 2.5, 8), ("wedge disc, thin", "wedge", "disc", 1.3, 1.4, 30),
    ("wedge tube", "wedge", "tube", 1.3, 2.5, 8), ("wedge tube, grey", "wedge", "tube", 1.3, 2.5, 2),
]


class Field:
    """A smooth random function: a sum of waves of about one length."""

    def __init__(self, seed, radius):
        random.seed(seed)
        self.waves = []
        for _ in range(60):
            z, turn = random.uniform(-1, 1), random.uniform(0, 2 * math.pi)
            flat, number = math.sqrt(1 - z * z), math.pi / (radius * random.uniform(1.0, 2.0))
            way = [number * flat * math.cos(turn), number * flat * math.sin(turn), number * z]
            self.waves.append((way, random.uniform(0, 2 * math.pi)))

    def at(self, x):
        waves = (math.cos(sum(k * c for k, c in zip(way, x)) + phase) for way, phase in self.waves)
        return sum(waves) / math.sqrt(0.5 * len(self.waves))


def run(*words, **options):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


def follow(slipstick, folder, design, seed):
    name, elements, kind, size, radius, sharpness = design
    folder.mkdir(parents=True, exist_ok=True)
    if elements == "hex":
        shape, top, bottom = generated(kind), "part_top", "part_bottom"
        if kind == "block":
            top, bottom = "part_ymax", "part_ymin"
    else:
        gmsh_mesh(folder / "mesh.msh", kind, elements, size)
        shape, top, bottom = 'mesh = { file = "mesh.msh", part = "part" }', "part_top", "part_bottom"
    (folder / "case.toml").write_text(CASE.format(name=name, shape=shape, top=top, bottom=bottom))
    made = run(slipstick, "solve", folder / "case.toml", "--out", folder / "uniform", "--force", "-q")
    if made.returncode != 0:
        return {"design": name, "failed": f"uniform: {made.stderr.strip().splitlines()[0]}"}
    centres = element_centres(folder / "uniform")
    field, rows = Field(seed, radius), list(csv.DictReader(open(folder / "uniform" / "design.csv")))
    values = []
    for row, centre in zip(rows, centres):
        edge = min(centre[1], 20 - centre[1])
        smooth = 0.5 + 0.5 * math.tanh(sharpness * 0.3 * field.at(centre))
        values.append(1.0 if row["body"] != "part" or edge < 2.0 else smooth)
    with open(folder / "design.csv", "w") as file:
        file.write("element,body,density\n")
        file.writelines(f"{row['element']},{row['body']},{value:.6f}\n" for row, value in zip(rows, values))
    solved = run(
        slipstick, "solve", folder / "case.toml", "--design", folder / "design.csv", "--out", folder / "run",
        "--force"
    )
    if solved.returncode != 0:
        return {"design": name, "failed": f"solve: {solved.stderr.strip().splitlines()[-2:]}"}
    exported = run(
        slipstick, "export", folder / "run", "--case", folder / "part", "--stl", folder / "design.stl", "--measure",
        "--force"
    )
    if exported.returncode != 0:
        return {"design": name, "failed": f"export: {exported.stderr.strip().splitlines()[0]}"}
    record = json.load(open(folder / "part" / "part.json"))
    body = record["bodies"][0]
    found = {
        "design": name, "triangles": body["triangles"], "crossings": record["crossings"] + body["crossings"],
        "pieces": body["pieces"], "loose": len(body["loose"]),
        "volume": body["volume"] / record["density_volume"] - 1.0,
    }
    member = re.search(r"thinnest member[^:]*: (\S+)", exported.stdout)
    found["member"] = float(member[1]) if member else math.nan
    meshed = run(sys.executable, folder / "part" / "mesh.py")
    if meshed.returncode != 0:
        return found | {"failed": f"mesh: {(meshed.stderr.strip().splitlines() or ['?'])[-2]}"}
    found["quality"] = float(re.search(r"worst quality (\S+)", meshed.stdout)[1])
    found["elements"] = int(re.search(r": (\d+) elements", meshed.stdout)[1])
    return found


def element_centres(directory):
    """The centres of the elements, by their corners."""
    mesh = meshio.read(directory / "path_0000.vtu")
    return [mesh.points[cell[:corners(block.type)]].mean(axis=0) for block in mesh.cells for cell in block.data]


def corners(kind):
    return {"tetra10": 4, "hexahedron27": 8}.get(kind)


def line(found):
    failed = found.get("failed")
    part = [f"{found[key]}" if key in found else "" for key in ("triangles", "crossings", "pieces", "loose")]
    volume = f"{found['volume']:+.1%}" if "volume" in found else ""
    member = f"{found['member']:.2f}" if "member" in found else ""
    mesh = [f"{found['elements']}", f"{found['quality']:.2f}"] if "quality" in found else [failed or "", ""]
    return "| " + " | ".join([found["design"], *part, volume, member, *mesh]) + " |"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--slipstick", required=True, type=Path)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--only", help="only designs whose name contains this")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 1)
    print("| design | triangles | crossings | pieces | loose | volume | thinnest member | elements | worst quality |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|")
    failed = 0
    for number, design in enumerate(DESIGNS):
        if options.only and options.only not in design[0]:
            continue
        folder = options.out / design[0].replace(", ", "_").replace(" ", "_")
        found = follow(options.slipstick.resolve(), folder, design, 100 * options.seed + number)
        failed += "failed" in found
        print(line(found), flush=True)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
