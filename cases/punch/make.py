"""Writes punch.inp: a cylindrical punch on a block, as PrePoMax writes its models (mm, N, MPa).

    python3 make.py [1 or 2: order of the tetrahedra] [size of the elements]     # needs gmsh
"""

import sys

import gmsh

ORDER = int(sys.argv[1]) if len(sys.argv) > 1 else 1
SIZE = float(sys.argv[2]) if len(sys.argv) > 2 else 1.2
RADIUS, WIDTH, HEIGHT, DEPTH = 20.0, 6.0, 5.0, 3.0
FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]  # S1 to S4 of a tetrahedron

END = """\
** Materials
**
*Material, Name=Aluminium
*Density
2.7E-09
*Elastic
70000., 0.33
*Material, Name=Steel
*Elastic
210000., 0.3
**
** Sections
**
*Solid section, Elset=BLOCK, Material=Aluminium
*Solid section, Elset=PUNCH, Material=Steel
**
** Surface interactions
**
*Surface interaction, Name=Dry
*Surface behavior, Pressure-overclosure=Linear
1.0E+06
*Friction
0.2, 5.0E+05
*Contact pair, Interaction=Dry, Type=Surface to surface
PUNCH_BOTTOM, BLOCK_TOP
**
** Steps
**
*Step, Nlgeom, Inc=100
*Static
0.25, 1.
*Boundary
FIXED, 1, 3
SIDES, 3, 3
*Boundary
DRIVEN, 1, 1
DRIVEN, 2, 2, -0.05
*Node file
RF, U
*El file
S, E
*Contact file
CDIS, CSTR
*Node print, Nset=DRIVEN, Totals=Only
RF
*End step
*Step, Nlgeom, Inc=100
*Static
0.25, 1.
*Boundary
DRIVEN, 1, 1, 0.02
*Node print, Nset=DRIVEN, Totals=Only
RF
*End step"""


def mesh():
    """The bodies, meshed, finer near the contact."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    block = occ.addBox(-8, -5, 0, 16, 5, DEPTH)
    cylinder = occ.addCylinder(0, RADIUS, 0, 0, 0, DEPTH, RADIUS)
    box = occ.addBox(-WIDTH, 0, 0, 2 * WIDTH, HEIGHT, DEPTH)
    punch = occ.intersect([(3, cylinder)], [(3, box)])[0][0][1]
    occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", SIZE)
    gmsh.option.setNumber("Mesh.MeshSizeMin", SIZE)
    gmsh.option.setNumber("Mesh.ElementOrder", ORDER)
    field = gmsh.model.mesh.field
    field.add("Box", 1)
    near = dict(VIn=SIZE / 2, VOut=SIZE, XMin=-4, XMax=4, YMin=-1, YMax=1, ZMin=0, ZMax=DEPTH, Thickness=2)
    for key, value in near.items():
        field.setNumber(1, key, value)
    field.setAsBackgroundMesh(1)
    gmsh.model.mesh.generate(3)
    return {"BLOCK": block, "PUNCH": punch}


def main():
    bodies = mesh()
    tags, x, _ = gmsh.model.mesh.getNodes()
    points = {int(tag): x[3 * i : 3 * i + 3] for i, tag in enumerate(tags)}
    cells, count = {}, 4 if ORDER == 1 else 10
    for name, volume in bodies.items():
        _, elements, nodes = gmsh.model.mesh.getElements(3, volume)
        cells[name] = [[int(n) for n in nodes[0][count * i : count * (i + 1)]] for i in range(len(elements[0]))]
    used = sorted({node for part in cells.values() for cell in part for node in cell})
    number = {tag: i + 1 for i, tag in enumerate(used)}
    lines = ["*" * 60, "** Heading", "**", "*Heading", "A cylindrical punch on a block; mm, N, MPa"]
    lines += ["**", "** Nodes", "**", "*Node"]
    lines += ["%d, %.9E, %.9E, %.9E" % (number[tag], *points[tag]) for tag in used]
    lines += ["**", "** Elements", "**"]
    element, sides = 0, {}
    for name, part in cells.items():
        lines.append("*Element, Type=C3D%d, Elset=%s" % (count, name))
        for cell in part:
            element += 1
            if ORDER == 2:
                cell = cell[:8] + [cell[9], cell[8]]  # Gmsh numbers the last two edges the other way round
            lines.append("%d, %s" % (element, ", ".join(str(number[node]) for node in cell)))
            for side, face in enumerate(FACES):
                sides.setdefault(tuple(sorted(cell[i] for i in face)), []).append((name, element, side + 1))

    def members(ids):
        return [", ".join(map(str, ids[i : i + 10])) + ("," if i + 10 < len(ids) else "") for i in range(0, len(ids), 10)]

    def node_set(name, test):
        lines.append("*Nset, Nset=%s" % name)
        lines.extend(members([number[tag] for tag in used if test(*points[tag])]))

    def surface(name, body, test):
        groups = {}
        for face, owners in sides.items():
            if len(owners) == 1 and owners[0][0] == body and all(test(*points[node]) for node in face):
                groups.setdefault(owners[0][2], []).append(owners[0][1])
        for side, ids in sorted(groups.items()):
            lines.append("*Elset, Elset=Internal_Surface-%s_S%d" % (name, side))
            lines.extend(members(sorted(ids)))
        lines.append("*Surface, Name=%s, Type=Element" % name)
        lines.extend("Internal_Surface-%s_S%d, S%d" % (name, side, side) for side in sorted(groups))

    node_set("FIXED", lambda x, y, z: y < -5 + 1e-6)
    node_set("DRIVEN", lambda x, y, z: y > HEIGHT - 1e-6)
    node_set("SIDES", lambda x, y, z: z < 1e-6 or z > DEPTH - 1e-6)
    mantle = lambda x, y, z: abs((x * x + (y - RADIUS) ** 2) ** 0.5 - RADIUS) < 1e-3 and abs(x) < 5
    surface("PUNCH_BOTTOM", "PUNCH", mantle)
    surface("BLOCK_TOP", "BLOCK", lambda x, y, z: abs(y) < 1e-6)
    with open("punch.inp", "w") as file:
        file.write("\n".join(lines + [END]) + "\n")
    print(len(used), "nodes,", element, "elements")


main()
