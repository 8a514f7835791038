#!/usr/bin/env python3
"""Fills the surfaces of the part with elements. Written by `slipstick export --case`.

    pip install gmsh
    python3 mesh.py                  # hexahedra, four in each tetrahedron
    python3 mesh.py --tetrahedra     # linear tetrahedra: faster to solve, but too stiff

The surfaces stay as they are, so contact faces, supports and loads keep their places and names. For
a finer or coarser mesh, run `slipstick export --case` with another --size.
"""
import os
import sys

import gmsh

# For each body: its surface, the mesh to write, the length of the edges, the surfaces around each
# piece of material, and the surfaces of each named face.
BODIES = []


def mesh(body, hexahedra):
    gmsh.clear()
    gmsh.model.add(body["name"])
    gmsh.merge(body["surface"])
    volumes = []
    for surfaces in body["pieces"]:
        loop = gmsh.model.geo.addSurfaceLoop(surfaces)
        volumes.append(gmsh.model.geo.addVolume([loop]))
    gmsh.model.geo.synchronize()
    gmsh.model.addPhysicalGroup(3, volumes, name=body["name"])
    for name, surfaces in body["groups"].items():
        gmsh.model.addPhysicalGroup(2, surfaces, name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMax", body["size"])
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("")
    gmsh.model.mesh.optimize("Netgen")
    if hexahedra:
        gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)
        gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 2)
        gmsh.model.mesh.refine()
    gmsh.write(body["mesh"])
    kinds, tags, _ = gmsh.model.mesh.getElements(3)
    for kind, elements in zip(kinds, tags):
        quality = min(gmsh.model.mesh.getElementQualities(elements, "minSICN"))
        name = gmsh.model.mesh.getElementProperties(kind)[0]
        print(f"{body['mesh']}: {len(elements)} elements ({name}), worst quality {quality:.3f}")


def main():
    os.chdir(os.path.dirname(os.path.abspath(__file__)))
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)
    gmsh.option.setNumber("Mesh.Binary", 1)
    for body in BODIES:
        mesh(body, "--tetrahedra" not in sys.argv[1:])
    gmsh.finalize()


if __name__ == "__main__":
    main()
