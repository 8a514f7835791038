#!/usr/bin/env python3
# Written by `slipstick new`, which runs it. To run it again:
#
#     pip install gmsh
#     python3 SCRIPT
#     slipstick new --mesh MESH
"""Meshes a STEP file for slipstick.

Each solid becomes a body, with the name that it has in the STEP file. Facing surfaces of two bodies
become BODY_touches_OTHER and OTHER_touches_BODY. Other faces get names too, for
supports and loads: their own name in the STEP file, or the side of the body on which they lie, or
their shape and a number. With HEXAHEDRA, prisms and bodies of revolution are swept in layers.
"""
import math
import os
import re
import sys
import unicodedata

STEP = "part.step"
MESH = "part.msh"
SIZE = None  # length of the edges of elements in mm; None: about 2500 elements in all, and more at contact
DISTANCE = None  # gaps and overlaps up to this distance in mm count as contact; None: 2 % of the smallest solid
CONTACT_SIZE = 0.7  # length of the edges at contact faces, relative to that of the bodies
PER_CIRCLE = 20  # number of elements around a full circle
ORDER = 2  # of the elements
HEXAHEDRA = False  # whether prisms and bodies of revolution are swept, with hexahedra

try:
    import gmsh
except (ImportError, OSError) as missing:
    sys.exit(f"error: {missing}\n    help: pip install gmsh")

# Maximum cosine between the outward normals of faces that look at each other.
OPPOSED = -0.7

# Smallest ratio of the Jacobian determinant at a point of an element to that at another one.
FLAT = 0.02

# Corners of the faces of elements with so many corners.
FACES = {
    4: ((0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    6: ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}

# Labels that programs write where the user gave none.
NO_LABELS = re.compile(r"(open cascade step translator.*|solid|shell|body|compound|shapes|assembly|unnamed|none|\d*)$")

# How many faces of a body are named after their shapes, the largest first. All others are BODY_other.
NAMED = 100

# Names of faces at the ends of a body.
SIDES = ("xmin", "xmax", "ymin", "ymax", "zmin", "zmax")

# Names of bodies that have a colour, but no label.
COLOURS = {
    "red": (255, 0, 0),
    "green": (0, 160, 0),
    "blue": (0, 0, 255),
    "yellow": (255, 255, 0),
    "orange": (255, 140, 0),
    "cyan": (0, 255, 255),
    "black": (0, 0, 0),
    "grey": (150, 150, 150),
    "white": (255, 255, 255),
}


def fail(message, cure):
    sys.exit(f"error: {message}\n    help: {cure}")


def word(text):
    """A label as a name in a case file; empty if it says nothing."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()  # without accents
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_-")
    return "" if NO_LABELS.match(text.strip().lower()) or NO_LABELS.match(name.lower()) else name


def unique(name, taken):
    """The name, with a number if another one is called so; upper and lower case do not count."""
    number, found = 1, name
    while found.lower() in taken:
        number += 1
        found = f"{name}_{number}"
    taken.add(found.lower())
    return found


def colour(solid):
    """The name of the colour of a solid; `part` if it has none."""
    *own, alpha = gmsh.model.getColor(3, solid)
    if alpha == 0:
        return "part"
    return min(COLOURS, key=lambda name: sum((a - b) ** 2 for a, b in zip(own, COLOURS[name])))


def load():
    """The solids of the file in mm, with their names."""
    try:
        # whatever the unit of the file is
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        gmsh.model.occ.importShapes(STEP)
        gmsh.model.occ.synchronize()
    except Exception as error:
        fail(f"{STEP} cannot be read as STEP: {error}", "export it again, as AP203, AP214 or AP242")
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    if not solids:
        found = "contains only surfaces, no solids" if gmsh.model.getEntities(2) else "contains no shapes"
        fail(f"{STEP} {found}", "export solid bodies, not sketches, surfaces or meshes")
    for solid in solids:
        if gmsh.model.occ.getMass(3, solid) <= 0.0:
            fail(f"solid {solid} of {STEP} has no volume", "repair the body in the CAD program")
    for face in gmsh.model.getEntities(2):
        owners = gmsh.model.getAdjacencies(*face)[0]
        if len(owners) > 1:
            fail(
                f"solids {owners[0]} and {owners[1]} of {STEP} share a face, so they would be glued",
                "export the parts as separate bodies, without merged or imprinted faces",
            )
    names, taken = {}, set()
    for solid in solids:
        labels = [word(label) for label in gmsh.model.getEntityName(3, solid).split("/")]
        labels = [label for label in labels if label]
        names[solid] = unique(labels[-1] if labels else colour(solid), taken)
    return names


def box(dim, tag):
    """Lowest and highest corner of an entity."""
    corners = gmsh.model.occ.getBoundingBox(dim, tag)
    return corners[:3], corners[3:]


def apart(one, other, distance):
    """Whether two boxes are further apart than a distance."""
    return any(one[0][c] > other[1][c] + distance or other[0][c] > one[1][c] + distance for c in range(3))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


class Face:
    """A face with points on it, their outward normals, and the areas around them."""

    def __init__(self, tag):
        self.tag, self.box = tag, box(2, tag)
        self.area = gmsh.model.occ.getMass(2, tag)
        self.kind = gmsh.model.getType(2, tag)
        self.label = word(gmsh.model.getEntityName(2, tag).split("/")[-1])
        tags, flat, _ = gmsh.model.mesh.getNodes(2, tag, includeBoundary=True)
        places = {node: flat[3 * i : 3 * i + 3] for i, node in enumerate(tags)}
        _, _, triangles = gmsh.model.mesh.getElements(2, tag)
        corners = [[places[n] for n in nodes[i : i + 3]] for nodes in triangles for i in range(0, len(nodes), 3)]
        centres = [float(sum(p[c] for p in triple) / 3.0) for triple in corners for c in range(3)]
        self.points, parameters = [], []
        if centres:
            centres, parameters = gmsh.model.getClosestPoint(2, tag, centres)
            self.points = [list(centres[i : i + 3]) for i in range(0, len(centres), 3)]
        # outward: Gmsh turns them with the face
        normals = gmsh.model.getNormal(tag, parameters) if self.points else []
        self.normals = [list(normals[i : i + 3]) for i in range(0, len(normals), 3)]

    def gaps(self, other, distance):
        """The signed distances from the points that look at another face: negative if the bodies overlap. And the
        share of the points that do."""
        if apart(self.box, other.box, distance) or not self.points or not other.points:
            return [], 0.0
        flat = [c for point in self.points for c in point]
        ends, parameters = gmsh.model.getClosestPoint(2, other.tag, flat)
        normals = gmsh.model.getNormal(other.tag, parameters)
        found = []
        for i, (point, normal) in enumerate(zip(self.points, self.normals)):
            step = [ends[3 * i + c] - point[c] for c in range(3)]
            length = dot(step, step) ** 0.5
            facing = dot(normals[3 * i : 3 * i + 3], normal)
            if length > distance or facing > OPPOSED:
                continue
            if gmsh.model.isInside(2, other.tag, list(ends[3 * i : 3 * i + 3])) == 0:
                continue
            gap = dot(step, normal)
            if length > 1e-6 and abs(gap) < 0.7 * length:
                continue
            found.append(0.0 if length <= 1e-6 else gap)
        return found, len(found) / len(self.points)


def place(face, body):
    """What to call a face that touches nothing: the side of its body, or its shape."""
    (low, high), (from_, to) = body, face.box
    size = max(b - a for a, b in zip(low, high))
    for axis, letter in enumerate("xyz"):
        if face.kind == "Plane" and to[axis] - from_[axis] < 1e-5 * size:
            if from_[axis] - low[axis] < 1e-5 * size:
                return letter + "min"
            if high[axis] - to[axis] < 1e-5 * size:
                return letter + "max"
    if face.kind == "Cylinder" and face.points:
        # the normals of a bore point at its axis
        middle = [(a + b) / 2.0 for a, b in zip(from_, to)]
        inward = sum(dot([m - p for m, p in zip(middle, x)], n) for x, n in zip(face.points, face.normals))
        return "bore" if inward > 0.0 else "round"
    return "plane" if face.kind == "Plane" else "face"


def find_contact(names, faces, distance):
    """For each two solids, the faces of each that look at the other one, and the smallest and largest gap."""
    solids, found = sorted(names), []
    for i, one in enumerate(solids):
        for two in solids[i + 1 :]:
            if apart(box(3, one), box(3, two), distance):
                continue
            mine, others, gaps = set(), set(), []
            for a in faces[one]:
                for b in faces[two]:
                    # the points of the finer face see the other one, which may be larger
                    for first, second in ((a, b), (b, a)):
                        some, share = first.gaps(second, distance)
                        if share > 0.02:
                            mine.add(a.tag)
                            others.add(b.tag)
                            gaps += some
            if gaps:
                found.append((one, two, mine, others, min(gaps), max(gaps)))
    return found


def common_volume(one, two):
    """The volume in which two solids overlap; 0 if it cannot be computed."""
    occ = gmsh.model.occ
    try:
        common, _ = occ.intersect([(3, one)], [(3, two)], removeObject=False, removeTool=False)
        volume = sum(occ.getMass(*part) for part in common if part[0] == 3)
        occ.remove(common, recursive=True)
        return volume
    except Exception:
        return 0.0


def overlaps(names, pairs, distance):
    """Warnings of solids that overlap although no faces of theirs look at each other."""
    found = []
    measured = {(one, two) for one, two, *_ in pairs}
    solids = sorted(names)
    for i, one in enumerate(solids):
        for two in solids[i + 1 :]:
            if (one, two) in measured or apart(box(3, one), box(3, two), 0.0):
                continue
            volume = common_volume(one, two)
            if volume > 1e-6 * min(gmsh.model.occ.getMass(3, one), gmsh.model.occ.getMass(3, two)):
                found.append(
                    f"warning {names[one]} and {names[two]} overlap by more than the contact distance of {distance:.3g} "
                    f"mm (common volume {volume:.3g} mm³): separate them in CAD, or give a larger --distance"
                )
    return found


# SWEEPS


def spoiled(parts):
    """Whether an element is turned over or nearly flat, or two lie on the same side of their common face."""
    seen = {}
    tags, flat, _ = gmsh.model.mesh.getNodes()
    points = {tag: flat[3 * i : 3 * i + 3] for i, tag in enumerate(tags)}
    for part in parts:
        for kind, elements, nodes in zip(*gmsh.model.mesh.getElements(3, part)):
            if min(gmsh.model.mesh.getElementQualities(elements, "minSJ")) < FLAT:
                return True
            _, _, _, count, _, corners = gmsh.model.mesh.getElementProperties(kind)
            for first in range(0, len(nodes), count):
                own = nodes[first : first + corners]
                centre = sum(points[tag] for tag in own) / corners
                for face in FACES.get(corners, ()):
                    at = [points[own[k]] for k in face]
                    key = tuple(sorted(own[k] for k in face))
                    if key not in seen:
                        middle, normal = sum(at) / len(at), cross(at[1] - at[0], at[-1] - at[0])
                        seen[key] = middle, normal, dot(normal, centre - middle)
                        continue
                    middle, normal, side = seen[key]
                    if side * dot(normal, centre - middle) >= 0:
                        return True
    return False


def mesh(hexahedra, plan=None, said=(), quadrangles=True):
    """Meshes the file, and says what it contains, after what is `said` already; sweeps bodies as in `plan`, with
    hexahedra, or only with wedges."""
    said = list(said)
    os.chdir(os.path.dirname(os.path.abspath(__file__)))
    if not os.path.isfile(STEP):
        fail(f"there is no file {STEP}", "correct STEP at the top of this script")
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    names = load()
    boxes = {solid: box(3, solid) for solid in names}
    sides = {solid: [b - a for a, b in zip(*boxes[solid])] for solid in names}
    volumes = {solid: gmsh.model.occ.getMass(3, solid) for solid in names}
    size = SIZE or (sum(volumes.values()) / (0.12 * 2500)) ** (1 / 3)
    sizes = {solid: SIZE or min(size, volumes[solid] ** (1 / 3) / 4) for solid in names}
    distance = DISTANCE
    if distance is None:
        distance = min(min(0.02 * dot(s, s) ** 0.5, 0.2 * min(s)) for s in sides.values())

    # points on the faces, from a first mesh
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", PER_CIRCLE)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.1 * min(sizes.values()))
    gmsh.model.mesh.generate(2)
    faces = {
        solid: [Face(abs(tag)) for _, tag in gmsh.model.getBoundary([(3, solid)], oriented=False)]
        for solid in names
    }
    pairs = find_contact(names, faces, distance)

    said += overlaps(names, pairs, distance)

    # groups
    groups, finer = {}, []
    for one, two, mine, others, low, high in pairs:
        a, b = names[one], names[two]
        groups[f"{a}_touches_{b}"], groups[f"{b}_touches_{a}"] = mine, others
        # the smaller side is where they touch
        area = {face.tag: face.area for face in faces[one] + faces[two]}
        finer += sorted(min(mine, others, key=lambda some: sum(area[tag] for tag in some)))
        said.append(f"contact {a}_touches_{b} {b}_touches_{a} {low:.6g} {high:.6g}")
    touching = set().union(*groups.values())
    for solid, name in names.items():
        counts, taken = {}, set()
        kinds = {face.tag: place(face, boxes[solid]) for face in faces[solid]}
        shaped = [f for f in faces[solid] if not f.label and f.tag not in touching and kinds[f.tag] not in SIDES]
        large = {face.tag for face in sorted(shaped, key=lambda face: -face.area)[:NAMED]}
        taken.update(["other"] if len(shaped) > NAMED else [])
        for face in sorted(faces[solid], key=lambda face: face.box):
            kind = kinds[face.tag]
            if face.label:
                own = unique(face.label, taken)
            elif face.tag in touching:
                continue
            elif kind in SIDES:  # all faces on that side together
                own = kind
            elif face.tag not in large:
                own = "other"
            else:
                counts[kind] = counts.get(kind, 0) + 1
                own = f"{kind}_{counts[kind]}"
            groups.setdefault(f"{name}_{own}", set()).add(face.tag)
    # what is meshed instead of each solid
    parts, joined, tried = {solid: [solid] for solid in names}, [], {}
    any_swept = any_vain = False
    if hexahedra:
        gmsh.model.mesh.clear()
        for solid in sorted(names):
            near = any(face.tag in finer for face in faces[solid])
            length = (CONTACT_SIZE if near else 1.0) * sizes[solid]
            found, tried[solid], vain = swept(solid, faces[solid], length, plan and plan[solid], quadrangles)
            any_vain |= vain
            if found is None:
                said.append(f"warning {names[solid]} {tried[solid][1]}: it gets tetrahedra instead of hexahedra")
                continue
            parts[solid], tags, closed = found
            any_swept = True
            groups = {name: set().union(*(tags.get(tag, {tag}) for tag in some)) for name, some in groups.items()}
            finer = sorted(set().union(*(tags.get(tag, {tag}) for tag in finer)))
            if closed:
                joined += parts[solid]
        if any_vain and not plan:
            gmsh.finalize()
            return mesh(True, tried)
    for solid, name in names.items():
        gmsh.model.addPhysicalGroup(3, parts[solid], name=name)
    for name, tags in sorted(groups.items()):
        gmsh.model.addPhysicalGroup(2, sorted(tags), name=name)

    # sizes: of each body, and finer close to contact
    field, fields = gmsh.model.mesh.field, []
    for solid in names:
        inside = field.add("Constant")
        field.setNumbers(inside, "VolumesList", parts[solid])
        field.setNumber(inside, "VIn", sizes[solid])
        field.setNumber(inside, "VOut", 1e22)
        fields.append(inside)
    if finer:
        small = CONTACT_SIZE * min(sizes[solid] for one, two, *_ in pairs for solid in (one, two))
        away, near = field.add("Distance"), field.add("Threshold")
        field.setNumbers(away, "SurfacesList", finer)
        field.setNumber(away, "Sampling", 40)
        settings = {"InField": away, "SizeMin": small, "SizeMax": size, "DistMin": small, "DistMax": small + 3 * size}
        for key, value in settings.items():
            field.setNumber(near, key, value)
        fields.append(near)
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", fields)
    field.setAsBackgroundMesh(least)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.ElementOrder", ORDER)
    gmsh.option.setNumber("Mesh.HighOrderOptimize", 1 if ORDER > 1 else 0)
    gmsh.option.setNumber("Mesh.OptimizeNetgen", 1)  # better elements; 0 if it fails
    # two edges of a quadrangle on one smooth curve would meet at a flat corner: two triangles, and so wedges, instead
    gmsh.option.setNumber("Mesh.RecombineMinimumQuality", 0.3)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.model.mesh.clear()
    try:
        gmsh.model.mesh.generate(3)
    except Exception as error:
        fail(f"Gmsh cannot mesh {STEP}: {error}", f"try another element size (--size, or SIZE in the script; it was {size:.3g} mm), or simplify small faces")
    bad = [name for solid, name in names.items() if any_swept and spoiled(parts[solid])]
    if bad:
        gmsh.finalize()
        if quadrangles:
            message = f"warning Gmsh made flat or overlapping hexahedra in {bad[0]}: swept bodies get wedges instead"
            return mesh(True, tried, [message], quadrangles=False)
        message = f"warning Gmsh made flat or overlapping elements in {bad[0]}: all bodies get tetrahedra instead of hexahedra"
        return mesh(False, said=[message])
    if joined:  # the ends of a whole revolution
        layer = [(3, part) for part in joined]
        whole = set(layer)
        for _ in range(3):
            layer = gmsh.model.getBoundary(layer, combined=False, oriented=False)
            whole.update(layer)
        gmsh.model.mesh.removeDuplicateNodes(sorted(whole))
    for solid, name in names.items():
        elements = sum(len(some) for part in parts[solid] for some in gmsh.model.mesh.getElements(3, part)[1])
        if elements == 0:
            fail(f"Gmsh made no elements in {name}", f"try another element size (--size; it was {size:.3g} mm), or repair the body")
        said.append(f"body {name} {elements}")
    said.append(f"distance {distance:.3g}")
    print("\n".join(said))
    gmsh.write(MESH)
    gmsh.finalize()


if __name__ == "__main__":
    mesh(HEXAHEDRA)
