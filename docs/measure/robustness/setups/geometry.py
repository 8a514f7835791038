"""The same case in another position, or in other units."""

import copy
import math


def axis_matrix(axis, degrees):
    length = math.sqrt(sum(a * a for a in axis))
    x, y, z = (a / length for a in axis)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    d = 1.0 - c
    return [
        [c + x * x * d, x * y * d - z * s, x * z * d + y * s],
        [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
        [z * x * d - y * s, z * y * d + x * s, c + z * z * d],
    ]


def apply(matrix, vector):
    return [sum(m * v for m, v in zip(row, vector)) for row in matrix]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def axis_angle(matrix):
    """Axis and degrees of a rotation; by way of its quaternion, which is stable at 180°."""
    m = matrix
    # the four squares of the quaternion's components, times 4
    squares = [1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2],
               1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2]]
    k = max(range(4), key=lambda i: squares[i])
    root = math.sqrt(squares[k])
    w, x, y, z = [
        [root, (m[2][1] - m[1][2]) / root, (m[0][2] - m[2][0]) / root, (m[1][0] - m[0][1]) / root],
        [(m[2][1] - m[1][2]) / root, root, (m[0][1] + m[1][0]) / root, (m[0][2] + m[2][0]) / root],
        [(m[0][2] - m[2][0]) / root, (m[0][1] + m[1][0]) / root, root, (m[1][2] + m[2][1]) / root],
        [(m[1][0] - m[0][1]) / root, (m[0][2] + m[2][0]) / root, (m[1][2] + m[2][1]) / root, root],
    ][k]
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12:
        return [0.0, 1.0, 0.0], 0.0
    return [x, y, z], math.degrees(2.0 * math.atan2(sine, w))


def _moved(case, matrix, words):
    """The case turned by a rotation; `words` maps names of components."""
    case = copy.deepcopy(case)
    for body in case["body"]:
        place = body.get("place", {})
        old = place.get("rotate", {"axis": [0.0, 1.0, 0.0], "degrees": 0.0})
        axis, degrees = axis_angle(product(matrix, axis_matrix(old["axis"], old["degrees"])))
        translate = apply(matrix, place.get("translate", [0.0, 0.0, 0.0]))
        body["place"] = {"rotate": {"axis": axis, "degrees": degrees}, "translate": translate}
    for surface in case.get("surface", []):
        if "normal" in surface:
            surface["normal"]["direction"] = apply(matrix, surface["normal"]["direction"])
    for support in case["dirichlet"]:
        if "components" in support:
            support["components"] = sorted(words[word] for word in support["components"])
        for waypoint in support.get("motion", []):
            if "u" in waypoint:
                waypoint["u"] = apply(matrix, waypoint["u"])
        if "rotation" in support:
            support["rotation"] = {key: apply(matrix, value) for key, value in support["rotation"].items()}
    for load in case.get("load", []):
        load["force"] = apply(matrix, load["force"])
    return case


def turned(case, axis, degrees):
    """For cases without lists of components."""
    return _moved(case, axis_matrix(axis, degrees), {})


def permuted(case):
    """x, y, z become y, z, x."""
    matrix = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    words = {a + x: a + y for a in ["", "r"] for x, y in ["xy", "yz", "zx"]}
    return _moved(case, matrix, words)


LENGTHS = {"min", "max", "radius", "height", "bottom_radius", "top_radius", "inner_radius", "outer_radius", "width",
           "tube_radius", "u", "offset", "translate", "point", "search_radius", "scale", "reference"}


def scaled(case, factor):
    """Lengths times a factor and moduli over its square: the same forces, energies times the factor."""
    def walk(value, key=None):
        if isinstance(value, dict):
            return {name: walk(inner, name) for name, inner in value.items()}
        if isinstance(value, list):
            return [walk(inner, key) for inner in value]
        if key in LENGTHS and isinstance(value, (int, float)):
            return value * factor
        if key in MODULI and isinstance(value, (int, float)):
            return value / factor**2
        return value
    case = walk(copy.deepcopy(case))
    for body in case["body"]:
        if "mesh" in body:
            body["mesh"]["scale"] = factor
    return case


MODULI = {"youngs_modulus", "c10", "c01", "bulk_modulus", "stiffness"}


#: The counts of elements of generated bodies.
SHAPES = ["box", "half_ball", "half_ring", "ball", "cone", "torus", "hollow_cylinder"]


def refined(case, boxes, others):
    """Elements of boxes and of the other shapes divided by these numbers, mesh files as they are; None if there is
    nothing else."""
    case = copy.deepcopy(case)
    found = [(body, shape) for body in case["body"] for shape in SHAPES if shape in body]
    for body, shape in found:
        body[shape]["elements"] = [n * (boxes if shape == "box" else others) for n in body[shape]["elements"]]
    return case if found else None


def exchanged(case):
    """Slave and master of every pair exchanged."""
    case = copy.deepcopy(case)
    for contact in case["contact"]:
        contact["slave"], contact["master"] = contact["master"], contact["slave"]
    return case
