"""The displacements of `contact4` of CalculiX' test suite with the exact integrals of its only contact facet, at small
strains: two hexahedra of 20 nodes, and a pressure of 1e7 per penetration at each point of the slave's face, whose forces
on both faces follow from their quadratic shape functions.

    python3 contact4.py contact4.inp contact4.frd

prints the deviation of the displacements in CalculiX' results; needs numpy.
"""

import re
import sys
from itertools import product
from pathlib import Path

import numpy as np

SUITE = Path(__file__).with_name("suite.py").read_text().replace("\nmain()\n", "\n")
STIFFNESS, MODULUS, PRESSURE = 1e7, 210000.0, 100.0
# nodes of a hexahedron: corners, then edges
NODES = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
NODES += [(0, -1, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1), (0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1)]
NODES = np.array(NODES + [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)


def shapes(p):
    factor = 1 + p * NODES
    corner = factor.prod(1) * ((p * NODES).sum(1) - 2) / 8
    edge = np.where(NODES == 0, 1 - p**2, factor).prod(1) / 4
    return np.where(np.arange(20) < 8, corner, edge)


def slopes(p, h=1e-6):
    return np.array([(shapes(p + h * e) - shapes(p - h * e)) / (2 * h) for e in np.eye(3)]).T


def stiffness(nodes):
    """Of an element without lateral contraction."""
    law, out = MODULUS * np.diag([1, 1, 1, 0.5, 0.5, 0.5]), np.zeros((60, 60))
    gauss = list(zip(*np.polynomial.legendre.leggauss(3)))
    for (a, u), (b, v), (c, w) in product(gauss, repeat=3):
        slope = slopes(np.array([a, b, c]))
        jacobian = nodes.T @ slope
        strain = np.zeros((6, 60))
        for i, (x, y, z) in enumerate(slope @ np.linalg.inv(jacobian)):
            strain[:, 3 * i : 3 * i + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
        out += strain.T @ law @ strain * np.linalg.det(jacobian) * u * v * w
    return out


def main():
    deck = Path(sys.argv[1]).read_text()
    numbers = lambda text: [int(n) for n in re.findall(r"\d+", text)]
    rows = deck.split("NSET=Nall\n", 1)[1].split("*", 1)[0].split()
    x = np.array([[float(n) for n in row.split(",")[1:]] for row in rows])
    data = numbers(deck.split("ELSET=Eall\n", 1)[1].split("*", 1)[0])
    below, above = [np.array(data[first + 1 : first + 21]) - 1 for first in (0, 21)]
    of_set = lambda name: numbers(re.search(r"NSET=%s *\n(.*?)\*" % name, deck, re.DOTALL).group(1))
    fixed = {3 * n - 3 + c for name, count in (("Nfix", 3), ("Nfix2", 2)) for n in of_set(name) for c in range(count)}
    free = np.setdiff1d(np.arange(x.size), sorted(fixed))

    tangent, force = np.zeros((x.size, x.size)), np.zeros(x.size)
    for element in (below, above):
        dofs = (3 * element[:, None] + range(3)).ravel()
        tangent[np.ix_(dofs, dofs)] += stiffness(x[element])

    def row(point, element):
        """The shape functions of an element at a point, along z. The elements are boxes."""
        local = np.linalg.lstsq(np.c_[x[element[:8]], np.ones(8)], NODES[:8], rcond=None)[0]
        out = np.zeros(x.size)
        out[3 * element + 2] = shapes(np.append(point, 1) @ local)
        return out

    gauss = list(zip(*np.polynomial.legendre.leggauss(12)))
    for (a, u), (b, v) in product(gauss, repeat=2):
        point = lambda z: np.array([0.5 + a / 4, 0.5 + b / 4, z])
        force -= PRESSURE * row(point(1.5), above) * u * v / 16
        # all points are closed
        gap = row(point(1.0), above) - row(point(1.0), below)
        tangent += STIFFNESS * np.outer(gap, gap) * u * v / 16
    found = np.zeros(x.size)
    found[free] = np.linalg.solve(tangent[np.ix_(free, free)], force[free])

    names = {}
    exec(SUITE, names)
    there = names["of_ccx"](Path(sys.argv[2]))[1]
    theirs = np.array([there[n + 1] for n in range(len(x))]).ravel()
    print("%.2g %%" % (100 * np.linalg.norm(found - theirs) / np.linalg.norm(theirs)))


main()
