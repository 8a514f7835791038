"""Checks of the written results, independent of the program."""

import collections
import csv
import math
import re
import struct

from kinds import stiffness

#: Relative error of balances of force.
FORCES = 1e-5
#: Part of the work that may be lost.
ENERGY = 0.05
#: Depth of a node inside another body, relative to the size of the facets around.
DEPTH = 0.15
#: The same where there is no force at all.
MISSED = 0.02
#: Part by which forces of equivalent cases may differ.
SAME = {"rotated": 1e-5, "units": 1e-5, "radius": 1e-5, "sides": 0.1}


def read_csv(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def iterations(out):
    try:
        return len(read_csv(out / "newton.csv"))
    except OSError:
        return 0


class Fields:
    """Arrays of a .vtu file with raw appended data."""

    def __init__(self, path):
        data = path.read_bytes()
        start = data.index(b"_", data.index(b"<AppendedData")) + 1
        head = data[:start].decode("latin-1")
        self.arrays = {}
        for tag in re.findall(r"<DataArray[^>]*format=\"appended\"[^>]*>", head):
            get = lambda key: (re.search(key + r'="([^"]*)"', tag) or [None, None])[1]
            at = start + int(get("offset"))
            (size,) = struct.unpack_from("<Q", data, at)
            code, width = {"Float64": ("d", 8), "Int64": ("q", 8), "UInt8": ("B", 1), "Int32": ("i", 4)}[get("type")]
            values = struct.unpack_from(f"<{size // width}{code}", data, at + 8)
            n = int(get("NumberOfComponents") or 1)
            self.arrays[get("Name")] = values if n == 1 else [values[i:i + n] for i in range(0, len(values), n)]

    def __getitem__(self, name):
        return self.arrays[name]


def minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def plus(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a):
    return math.sqrt(dot(a, a))


def total(vectors):
    out = (0.0, 0.0, 0.0)
    for vector in vectors:
        out = plus(out, vector)
    return out


HEXAHEDRON = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
WEDGE = [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]
#: Faces by VTK type of cell; those of second order by their corners.
FACES = {12: HEXAHEDRON, 29: HEXAHEDRON, 25: HEXAHEDRON, 10: TETRAHEDRON, 24: TETRAHEDRON, 13: WEDGE}
HEXAHEDRON_EDGES = {(0, 1): 8, (1, 2): 9, (2, 3): 10, (0, 3): 11, (4, 5): 12, (5, 6): 13, (6, 7): 14, (4, 7): 15,
                    (0, 4): 16, (1, 5): 17, (2, 6): 18, (3, 7): 19}
CENTRES = {frozenset(f): 20 + n for n, f in enumerate([(0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7),
                                                       (0, 1, 2, 3), (4, 5, 6, 7)])}


def parts(kind, face, cell):
    """A face as polygons of nodes; those of quadratic hexahedra in four parts."""
    if kind != 29:
        return [tuple(cell[n] for n in face)]
    edge = lambda a, b: cell[HEXAHEDRON_EDGES[min(a, b), max(a, b)]]
    middle, n = cell[CENTRES[frozenset(face)]], len(face)
    return [(cell[face[i]], edge(face[i], face[(i + 1) % n]), middle, edge(face[i - 1], face[i])) for i in range(n)]


def distance(p, a, b, c):
    """From a point to a triangle (Ericson, Real-Time Collision Detection, 5.1.5)."""
    ab, ac, ap = minus(b, a), minus(c, a), minus(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    scaled = lambda v, s: (v[0] * s, v[1] * s, v[2] * s)
    if d1 <= 0 and d2 <= 0:
        return norm(ap)
    bp = minus(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0 and d4 <= d3:
        return norm(bp)
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        return norm(minus(ap, scaled(ab, d1 / (d1 - d3))))
    cp = minus(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0 and d5 <= d6:
        return norm(cp)
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        return norm(minus(ap, scaled(ac, d2 / (d2 - d6))))
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        return norm(minus(bp, scaled(minus(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)))))
    normal = cross(ab, ac)
    return abs(dot(ap, normal)) / norm(normal)


def solid_angle(p, a, b, c):
    a, b, c = minus(a, p), minus(b, p), minus(c, p)
    la, lb, lc = norm(a), norm(b), norm(c)
    return 2.0 * math.atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)


class Run:
    def __init__(self, out, setup):
        self.setup = setup
        self.iterations = iterations(out)
        self.rows = read_csv(out / "quantities.csv")
        self.files = sorted(out.glob("path_*.vtu"))
        self.energy = self.depth = 0.0
        last = Fields(self.files[-1])
        self.last = last
        self.nodes = self._nodes_of_bodies(last)
        self.now = [plus(x, u) for x, u in zip(last["Points"], last["displacement"])]
        self.force = sum(norm(f) for f in last["contact_force"])
        #: Forces below this are round-off: a part of the softest body's modulus times a facet's area.
        self.round_off = 1e-9 * min(stiffness(b["material"]) for b in setup.case["body"] if "material" in b)

    def _nodes_of_bodies(self, fields):
        cells, start, nodes = fields["offsets"], 0, {}
        for end, body in zip(cells, fields["body"]):
            nodes.setdefault(body, set()).update(fields["connectivity"][start:end])
            start = end
        return nodes

    def value(self, key, row=-1):
        return float(self.rows[row].get(key) or 0.0)

    def findings(self):
        out = []
        for n, path in enumerate(self.files[1:], 1):
            out += [f"step {n}: {note}" for note in self._balance(Fields(path), n / (len(self.files) - 1))]
            out += [f"step {n}: {note}" for note in self._cone(Fields(path))]
        if len(out) > 2:
            out = out[:2] + [f"{len(out) - 2} more of this"]
        return out + self._depths()

    def _loads(self, t):
        """Resultants of the loads on each body."""
        bodies = [body["name"] for body in self.setup.case["body"]]
        out = {n: (0.0, 0.0, 0.0) for n in range(len(bodies))}
        for load in self.setup.case.get("load", []):
            if load["surface"] in bodies:
                continue  # the files count the load at a rigid body's reference point as its reaction
            (body,) = [n for n, name in enumerate(bodies) if load["surface"] == name or load["surface"].startswith(name + "_")]
            points = [(0.0, 0.0)] + [(w["t"], w["factor"]) for w in load.get("amplitude", [{"t": 1.0, "factor": 1.0}])]
            factor = points[-1][1]
            for (t0, f0), (t1, f1) in zip(points, points[1:]):
                if t0 <= t <= t1:
                    factor = f0 + (f1 - f0) * (t - t0) / (t1 - t0)
                    break
            out[body] = plus(out[body], tuple(factor * f for f in load["force"]))
        return out

    def _balance(self, fields, t):
        """Of each body, and of contact: action and reaction."""
        contact, reaction = fields["contact_force"], fields["reaction"]
        scale = sum(map(norm, contact)) + sum(map(norm, reaction)) + self.round_off / FORCES
        out = []
        if norm(total(contact)) > FORCES * scale:
            out.append(f"the forces of contact have the resultant {norm(total(contact)) / scale:.1e}")
        for body, load in self._loads(t).items():
            nodes = self.nodes[body]
            rest = plus(total([contact[n] for n in nodes] + [reaction[n] for n in nodes]), load)
            if norm(rest) > FORCES * (scale + norm(load)):
                out.append(f"body {body} is out of balance by {norm(rest) / (scale + norm(load)):.1e}")
        return out

    def _cone(self, fields):
        if any(pair.get("multiplier_shape") == "dual" for pair in self.setup.case["contact"]):
            return []  # nodal forces are positive combinations of multipliers, which obey the cone, only for standard shapes
        limit = max(pair["friction"] for pair in self.setup.case["contact"])
        largest = max((abs(p) for p in fields["contact_pressure"] if p == p), default=0.0) + self.round_off / 1e-5
        out = []
        for n, (p, t) in enumerate(zip(fields["contact_pressure"], fields["contact_traction"])):
            if p != p:
                continue
            shear = math.sqrt(max(dot(t, t) - p * p, 0.0))
            # the shear of nodes without friction is round-off, of which the root is taken
            if shear > limit * max(p, 0.0) * (1 + 1e-5) + 1e-5 * largest:
                out.append(f"shear {shear:.3g} of node {n} exceeds {limit} × {p:.3g}")
                break
            if p < -1e-5 * largest:
                out.append(f"tension {p:.3g} at node {n}")
                break
        return out

    def lost(self, after=0):
        """Whether more of the work since a load step is missing than round-off and the trapezoidal rule explain."""
        work = self.value("external_work") + self.value("offset_work")
        rest = self._rest() - (self._rest(after) if after else 0.0)
        if any("penalty" in pair["enforcement"] for pair in self.setup.case["contact"]):
            rest -= self._stored_by_penalties()
        scale = max([abs(work)] + [abs(self.value("strain_energy", i)) for i in range(len(self.rows))]
                    + [abs(self.value("friction_work"))])
        self.energy = rest / scale if scale > self.round_off else 0.0
        return abs(self.energy) > ENERGY

    def _rest(self, row=-1):
        """Work that is neither stored nor dissipated."""
        taken = sum(self.value(name, row) for name in ["strain_energy", "friction_work", "viscous_work"])
        return self.value("external_work", row) + self.value("offset_work", row) - taken

    def _stored_by_penalties(self):
        """½ Σ A_j ζ_nj |gap_j|. Nodal forces would not do: with standard shapes, they are means over the neighbours, and
        an edge that digs in stores most where the gap is largest. Areas are those of facets, scaled so that the forces
        add up to those of the tables, since facets may be partly covered."""
        gaps, multipliers, status = (self.last["contact_" + name] for name in ["gap", "multiplier", "status"])
        area = collections.defaultdict(float)
        for body in range(len(self.setup.case["body"])):
            for polygon in self._boundary(body):
                if any(status[n] < 0 for n in polygon):
                    continue
                a = [self.now[n] for n in polygon]
                size = sum(norm(cross(minus(a[i], a[0]), minus(a[i + 1], a[0]))) / 2 for i in range(1, len(a) - 1))
                for n in polygon:
                    area[n] += size / len(polygon)
        forces = {n: a * norm(multipliers[n]) for n, a in area.items()}
        pressed = sum(float(value or 0.0) for key, value in self.rows[-1].items() if key.endswith("_normal_force"))
        total_force = sum(forces.values())
        if total_force <= self.round_off:
            return 0.0
        return 0.5 * pressed / total_force * sum(force * max(-gaps[n], 0.0) for n, force in forces.items())

    def _boundary(self, body):
        """Facets of the boundary of a body."""
        fields, start, once = self.last, 0, {}
        for end, kind, of in zip(fields["offsets"], fields["types"], fields["body"]):
            cell, start = fields["connectivity"][start:end], end
            if of == body:
                for face in FACES[kind]:
                    key = frozenset(cell[n] for n in face)
                    once[key] = None if key in once else parts(kind, face, cell)
        return [polygon for polygons in once.values() if polygons for polygon in polygons]

    def _triangles(self, body):
        """Of quadrilaterals, four about their centre, so that warped ones are fair."""
        out = []
        for polygon in self._boundary(body):
            points = [self.now[n] for n in polygon]
            if len(points) == 3:
                out.append(tuple(points))
                continue
            middle = tuple(c / len(points) for c in total(points))
            out += [(points[i - 1], points[i], middle) for i in range(len(points))]
        return out

    def _depths(self):
        """How deep nodes of the boundary of one body are inside another body."""
        deepest = (0.0, 0.0, None)
        triangles = {body: self._triangles(body) for body in self.nodes}
        boundary = {body: {n for polygon in self._boundary(body) for n in polygon} for body in self.nodes}
        boxes = {}
        for body, list_of in triangles.items():
            points = [p for triangle in list_of for p in triangle]
            boxes[body] = [(min(p[a] for p in points), max(p[a] for p in points)) for a in range(3)]
        for slave, nodes in boundary.items():
            for master in triangles:
                if slave == master:
                    continue
                for n in nodes:
                    p = self.now[n]
                    if not all(low < x < high for x, (low, high) in zip(p, boxes[master])):
                        continue
                    if abs(sum(solid_angle(p, *triangle) for triangle in triangles[master])) < 2.0 * math.pi:
                        continue
                    depth, triangle = min((distance(p, *triangle), triangle) for triangle in triangles[master])
                    size = max(norm(minus(triangle[i - 1], triangle[i])) for i in range(3))
                    if depth / size > deepest[0]:
                        deepest = (depth / size, depth, (slave, n, master))
        self.depth = deepest[0]
        missed = self.depth > MISSED and self.force < self.round_off
        if self.depth > DEPTH or missed:
            slave, n, master = deepest[2]
            names = [body["name"] for body in self.setup.case["body"]]
            where = ", ".join(f"{x:.3g}" for x in self.now[n])
            return [f"node {n} of {names[slave]} at [{where}] is {deepest[1]:.3g} inside {names[master]}, "
                    f"{self.depth:.2f} of a facet" + (", without a force" if missed else "")]
        return []

    def differences(self, name, other):
        scale = max(self.force, other.force)
        if scale <= self.round_off:
            return []  # bodies that have come apart
        change = abs(other.force - self.force) / scale
        return [f"{name}: contact forces {self.force:.4g} become {other.force:.4g}"] if change > SAME[name] else []
