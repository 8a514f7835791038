"""Writes the mesh files of this folder: python -m venv v; v/bin/pip install gmsh meshio vtk; v/bin/python make.py

A slab of 4 x 2 x 2 hexahedra (0..4, 0..1, 0..2) and a block of 2 x 1 x 2 (0.6..2.0, 1.0..1.7, 0.3..1.6), their
surfaces `slab_top`, `slab_bottom`, `block_top`, `block_bottom` and a corner point and an edge as physical groups.
"""

import gmsh
import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
geo = gmsh.model.geo


def box(name, low, high, elements):
    """A box of hexahedra, extruded upwards (y) from its bottom; of tetrahedra of size 1 without numbers of elements."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    points = [geo.addPoint(*p, 1.0) for p in [(x0, y0, z0), (x0, y0, z1), (x1, y0, z1), (x1, y0, z0)]]
    lines = [geo.addLine(points[i], points[(i + 1) % 4]) for i in range(4)]
    bottom = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    if elements:
        for line, count in zip(lines, [elements[2], elements[0]] * 2):
            geo.mesh.setTransfiniteCurve(line, count + 1)
        geo.mesh.setTransfiniteSurface(bottom)
        geo.mesh.setRecombine(2, bottom)
        made = geo.extrude([(2, bottom)], 0, y1 - y0, 0, numElements=[elements[1]], recombine=True)
    else:
        made = geo.extrude([(2, bottom)], 0, y1 - y0, 0)
    geo.synchronize()
    top, volume = made[0][1], made[1][1]
    add = gmsh.model.addPhysicalGroup
    add(3, [volume], name=name)
    add(2, [bottom], name=name + "_bottom")
    add(2, [top], name=name + "_top")
    add(1, [lines[0]], name=name + "_edge")
    add(0, [points[0]], name=name + "_corner")


box("slab", (0, 0, 0), (4, 1, 2), (4, 2, 2))
box("block", (0.6, 1.0, 0.3), (2.0, 1.7, 1.6), (2, 1, 2))
gmsh.model.mesh.generate(3)
for version, name in [(2.2, "22"), (4.1, "41")]:
    for binary, kind in [(0, "ascii"), (1, "binary")]:
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(f"gmsh_{name}_{kind}.msh")
gmsh.option.setNumber("Mesh.Binary", 0)
gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
gmsh.write("gmsh.inp")
gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)

# second order, which is refused
gmsh.model.mesh.setOrder(2)
gmsh.write("gmsh_41_second_order.msh")
gmsh.finalize()

# a slab of tetrahedra under the block of hexahedra
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
geo = gmsh.model.geo
box("slab", (0, 0, 0), (4, 1, 2), None)
box("block", (0.6, 1.0, 0.3), (2.0, 1.7, 1.6), (2, 1, 2))
gmsh.option.setNumber("Mesh.MeshSizeFactor", 1.0)
gmsh.model.mesh.generate(3)
gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
gmsh.write("gmsh_tetrahedra.msh")
gmsh.finalize()

# quadrilaterals and hexahedra with the field `gmsh:physical`, which numbers the groups in the order made above
mesh = meshio.read("gmsh_41_ascii.msh")
keep = [i for i, block in enumerate(mesh.cells) if block.type in ("quad", "hexahedron")]
mesh = meshio.Mesh(
    mesh.points,
    [mesh.cells[i] for i in keep],
    cell_data={"group": [mesh.cell_data["gmsh:physical"][i].astype(np.int32) for i in keep]},
)
meshio.vtu.write("meshio_ascii.vtu", mesh, binary=False)
meshio.vtu.write("meshio_base64.vtu", mesh, compression=None)
meshio.vtu.write("meshio_base64_zlib.vtu", mesh, compression="zlib")
meshio.write("meshio.inp", mesh)

# the same by VTK
grid = vtk.vtkUnstructuredGrid()
points = vtk.vtkPoints()
points.SetData(numpy_to_vtk(mesh.points, deep=True))
grid.SetPoints(points)
for block in mesh.cells:
    number = {"quad": vtk.VTK_QUAD, "hexahedron": vtk.VTK_HEXAHEDRON}[block.type]
    for nodes in block.data:
        grid.InsertNextCell(number, len(nodes), [int(n) for n in nodes])
groups = numpy_to_vtk(np.concatenate(mesh.cell_data["group"]), deep=True)
groups.SetName("group")
grid.GetCellData().AddArray(groups)
WRITERS = {
    "vtk_raw": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOff(), w.SetCompressorTypeToNone()),
    "vtk_raw_zlib": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOff(), w.SetCompressorTypeToZLib()),
    "vtk_appended_base64": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOn(), w.SetCompressorTypeToNone()),
    "vtk_appended_base64_zlib": lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOn(), w.SetCompressorTypeToZLib()),
    "vtk_base64_big_endian": lambda w: (w.SetDataModeToBinary(), w.SetByteOrderToBigEndian(), w.SetCompressorTypeToNone(), w.SetHeaderTypeToUInt32()),
    "vtk_ascii": lambda w: (w.SetDataModeToAscii(),),
}
for name, choose in WRITERS.items():
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(name + ".vtu")
    writer.SetInputData(grid)
    choose(writer)
    writer.Write()
