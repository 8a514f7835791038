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

# second order
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

# the slab and the block of wedges: triangles extruded in layers, of the slab upwards (y), of the block along z
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
geo = gmsh.model.geo


def prisms(name, low, high, axis, layers, size):
    """A box of wedges: the triangles of its side at the lowest coordinate along an axis, extruded in layers."""
    u, v = {"y": (2, 0), "z": (0, 1)}[axis]
    w = {"y": 1, "z": 2}[axis]
    corners = []
    for a, b in [(low[u], low[v]), (high[u], low[v]), (high[u], high[v]), (low[u], high[v])]:
        point = [0, 0, 0]
        point[u], point[v], point[w] = a, b, low[w]
        corners.append(geo.addPoint(*point, size))
    lines = [geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
    start = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    along = [0, 0, 0]
    along[w] = high[w] - low[w]
    # `recombine` makes wedges of the triangles instead of tetrahedra
    made = geo.extrude([(2, start)], *along, numElements=[layers], recombine=True)
    geo.synchronize()
    ends = {start: "bottom", made[0][1]: "top"}
    if axis == "z":
        # made[2:] are the sides over the lines, of which the first is at the lowest y and the third at the highest
        ends = {made[2][1]: "bottom", made[4][1]: "top"}
    add = gmsh.model.addPhysicalGroup
    add(3, [made[1][1]], name=name)
    for side, end in ends.items():
        add(2, [side], name=f"{name}_{end}")
    add(0, [corners[0]], name=name + "_corner")


prisms("slab", (0, 0, 0), (4, 1, 2), "y", 2, 1.0)
prisms("block", (0.6, 1.0, 0.3), (2.0, 1.7, 1.6), "z", 2, 0.75)
gmsh.model.mesh.generate(3)
gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
gmsh.write("gmsh_wedges.msh")
wedges = meshio.read("gmsh_wedges.msh")
# the block alone, with nodes in the middle of its quadrilaterals and without
gmsh.model.removePhysicalGroups([group for group in gmsh.model.getPhysicalGroups() if "slab" in gmsh.model.getPhysicalName(*group)])
gmsh.model.mesh.setOrder(2)
gmsh.write("gmsh_wedges_second_order.msh")
gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
gmsh.model.mesh.setOrder(1)
gmsh.model.mesh.setOrder(2)
gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
gmsh.write("gmsh_wedges_second_order.inp")
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
for version in ("42", "51"):
    for kind in ("ascii", "binary"):
        meshio.vtk.write(f"meshio_{version}_{kind}.vtk", mesh, fmt_version=f"{version[0]}.{version[1]}", binary=kind == "binary")

# the wedges with their faces, in VTK's numbering before version 9.7
cells = [block for block in wedges.cells if block.type in ("triangle", "quad", "wedge")]
groups = [group for group, block in zip(wedges.cell_data["gmsh:physical"], wedges.cells) if block in cells]
meshio.vtu.write("meshio_wedges.vtu", meshio.Mesh(wedges.points, cells, cell_data={"group": groups}), binary=False)

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
for version, kind in ((42, "Binary"), (51, "ASCII")):
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetFileName(f"vtk_{version}_{kind.lower()}.vtk")
    writer.SetInputData(grid)
    writer.SetFileVersion(version)
    getattr(writer, f"SetFileTypeTo{kind}")()
    writer.Write()
