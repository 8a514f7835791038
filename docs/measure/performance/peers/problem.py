"""The problem that all programs solve: a slipstick case file, and the mesh that slipstick writes for it.

Understands two bodies of neo-Hookean hexahedra, one contact pair, a held surface and a driven one.
"""

import re
import tomllib

import numpy as np

# Corners of the faces of a hexahedron, in Abaqus' order of the faces (S1 to S6). VTK, Abaqus and
# slipstick number the corners in the same way.
FACES = np.array([[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]])


class Problem:
    """Units are those of the case file. Arrays over nodes and elements keep slipstick's order.

    points      coordinates, nodes x 3
    elements    corners, elements x 8
    body        number of the body of each element
    materials   Young's modulus and Poisson's ratio of each body
    friction    Coulomb's coefficient
    slave, master    names of the surfaces in contact
    held, driven     names of the surfaces with prescribed displacements
    steps       load steps over pseudo-time 0 to 1: those of the case times `refinement`
    """

    def __init__(self, case, mesh, refinement=1):
        with open(case, "rb") as file:
            self.case = tomllib.load(file)
        self.mesh, self.refinement = mesh, refinement
        self.points, self.elements, self.body = read_vtu(mesh)
        self.materials = []
        for body in self.case["body"]:
            law = body["material"]["neo_hooke"]
            self.materials.append((law["youngs_modulus"], law["poisson_ratio"]))
        (contact,) = self.case["contact"]
        self.slave, self.master, self.friction = contact["slave"], contact["master"], contact["friction"]
        held, driven = self.case["dirichlet"]
        self.held, self.driven, self.motion = held["set"], driven["set"], driven["motion"]
        self.steps = self.case["load_path"]["steps"] * refinement

    def displacement(self, time):
        """Displacement of the driven surface, piecewise linear in pseudo-time."""
        times = [0.0] + [point["t"] for point in self.motion]
        values = np.array([[0.0] * 3] + [point["u"] for point in self.motion])
        return [float(np.interp(time, times, values[:, i])) for i in range(3)]

    def pressed(self):
        """Pseudo-time at which the driven surface starts to slide."""
        return self.motion[0]["t"]

    def body_of(self, surface):
        """Number of the body that a surface belongs to."""
        return [surface.startswith(body["name"] + "_") for body in self.case["body"]].index(True)

    def nodes(self, surface):
        """Numbers of the nodes on a surface, ascending."""
        number = self.body_of(surface)
        body = self.case["body"][number]
        mine = np.unique(self.elements[self.body == number])
        x = self.points[mine] - body.get("place", {}).get("translate", [0.0] * 3)
        shape, side = set(body) & set(SIDES), surface[len(body["name"]) + 1 :]
        (shape,) = shape
        distance = SIDES[shape][side](x, body[shape])
        return mine[np.abs(distance) < 1e-9 * np.ptp(self.points)]

    def facets(self, surface):
        """Elements and face numbers (0 to 5) of the outer faces on a surface."""
        on = np.zeros(len(self.points), bool)
        on[self.nodes(surface)] = True
        corners = self.elements[:, FACES]
        element, face = np.nonzero(on[corners].all(axis=2) & (self.body == self.body_of(surface))[:, None])
        keys = np.sort(corners[element, face], axis=1)
        _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
        outer = np.sort(first[count == 1])
        return element[outer], face[outer]


# Distance of points from the named sides of slipstick's shapes, before they are translated.
SIDES = {
    "box": {
        "ymin": lambda x, box: x[:, 1] - box["min"][1],
        "ymax": lambda x, box: x[:, 1] - box["max"][1],
    },
    "half_ball": {
        "flat": lambda x, ball: x[:, 1],
        "dome": lambda x, ball: np.linalg.norm(x, axis=1) - ball["radius"],
    },
    "half_ring": {
        "ends": lambda x, ring: x[:, 1],
        "outer": lambda x, ring: np.hypot(x[:, 0], x[:, 1]) - ring["outer_radius"],
    },
}


def read_vtu(path):
    """Points, corners of hexahedra and body numbers of a VTU file of slipstick."""
    with open(path, "rb") as file:
        content = file.read()
    start = content.index(b"_", content.index(b"<AppendedData")) + 1
    header = content[:start].decode("ascii", "replace")
    arrays = {}
    for tag in re.findall(r'<DataArray[^>]*format="appended"[^>]*>', header):
        attributes = dict(re.findall(r'(\w+)="([^"]*)"', tag))
        at = start + int(attributes["offset"])
        (size,) = np.frombuffer(content, "<u8", 1, at)
        kind = {"Float64": "<f8", "Float32": "<f4", "Int64": "<i8", "UInt8": "u1"}[attributes["type"]]
        arrays[attributes["Name"]] = np.frombuffer(content[at + 8 : at + 8 + int(size)], kind)
    assert (arrays["types"] == 12).all(), "only hexahedra are supported"
    return arrays["Points"].reshape(-1, 3), arrays["connectivity"].reshape(-1, 8), arrays["body"]
