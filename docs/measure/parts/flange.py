#!/usr/bin/env python3
"""Writes a flange with fillets and bores, mm, and a design of it with curved holes: flange.step, flange.msh, flange.toml and
flange.csv in the folder given; `--size` is that of its elements. Everything is removed where a gyroid is above 0.4, but near the
hub's bore and the lower face.

    python3 docs/measure/parts/flange.py FOLDER --size 1.9
    slipstick solve FOLDER/flange.toml --design FOLDER/flange.csv --out FOLDER/run

It needs Python with Gmsh (pip install gmsh).
"""
import argparse
from math import cos, hypot, pi, sin
from pathlib import Path

import gmsh

CASE = """[units]
length = "mm"
[[body]]
name = "flange"
mesh = { file = "flange.msh" }
material = { linear_elastic = { youngs_modulus = 210000.0, poisson_ratio = 0.3 } }
[[dirichlet]]
set = "flange_lower"
[[load]]
surface = "flange_upper"
pressure = 1.0
[load_path]
steps = 1
[design]
bodies = ["flange"]
initial = 0.5
volume_fraction = 0.5
[[quantity]]
name = "energy"
strain_energy = { body = "flange" }
[objective]
minimise = { quantity = "energy" }
"""


def flange(size):
    """A disc and a hub with a fillet of radius 5 between them, 2 around the disc, and a bore and six holes."""
    occ = gmsh.model.occ
    body, _ = occ.fuse([(3, occ.addCylinder(0, 0, 0, 0, 0, 10, 40))], [(3, occ.addCylinder(0, 0, 0, 0, 0, 40, 16))])
    occ.synchronize()
    for radius, height, fillet in ((16, 10, 5), (40, 10, 2)):
        near = [
            curve
            for _, curve in gmsh.model.getBoundary(body, combined=False, oriented=False, recursive=False)
            for _, curve in gmsh.model.getBoundary([(2, curve)], oriented=False)
            for box in [gmsh.model.getBoundingBox(1, curve)]
            if abs(box[3] - radius) < 0.01 and abs(box[2] - height) < 0.01 and abs(box[5] - height) < 0.01
        ]
        body = occ.fillet([body[0][1]], sorted(set(near)), [fillet])
        occ.synchronize()
    holes = [(3, occ.addCylinder(30 * cos(k * pi / 3), 30 * sin(k * pi / 3), -1, 0, 0, 12, 4)) for k in range(6)]
    body, _ = occ.cut(body, holes + [(3, occ.addCylinder(0, 0, -1, 0, 0, 42, 9))])
    occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [body[0][1]], name="flange")
    faces = {}
    for _, face in gmsh.model.getBoundary(body, oriented=False):
        box = gmsh.model.getBoundingBox(2, face)
        flat = box[5] - box[2] < 0.01
        faces["lower" if flat and box[5] < 1 else "upper" if flat and box[2] > 39 else f"face_{face}"] = [face]
    for name, of in faces.items():
        gmsh.model.addPhysicalGroup(2, of, name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)


def density(x, y, z):
    if z < 2.0 or hypot(x, y) < 11.0:
        return 1
    x, y, z = (2 * pi * c / 16.0 for c in (x, y, z))
    return int(sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x) < 0.4)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=Path)
    options.add_argument("--size", type=float, default=1.9)
    options = options.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    flange(options.size)
    gmsh.write(str(options.folder / "flange.step"))
    gmsh.write(str(options.folder / "flange.msh"))
    tags, _ = gmsh.model.mesh.getElementsByType(4)
    centres = gmsh.model.mesh.getBarycenters(4, -1, False, True).reshape(-1, 3)
    rows = "".join(f"{e},{density(*centre)}\n" for e, centre in enumerate(centres))
    (options.folder / "flange.csv").write_text("element,density\n" + rows)
    (options.folder / "flange.toml").write_text(CASE)
    print(len(tags), "tetrahedra")


if __name__ == "__main__":
    main()
