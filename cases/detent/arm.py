#!/usr/bin/env python3
"""Writes arm.inp, the arm of the snap-fit as hexahedra, with the names that case.toml uses.

The arm is a bar along x, held at x = 0. Its underside carries a bump, one wave of a cosine, over which the nose
slides; elements are short there. Lengths in mm.
"""
from math import cos, pi

HEIGHT, WIDTH = 8.0, 3.0                    # WIDTH: half of the arm's; z = 0 is a plane of symmetry
CREST, HALF, DEPTH = 22.0, 5.0, 2.0         # the bump: position of its crest, half its length, its depth
COLUMNS = [(16.5, 25), (27.5, 44), (28.0, 1)]   # up to this x, so many columns of elements
ROWS = 16


def under(x):
    """Height of the underside."""
    if abs(x - CREST) >= HALF:
        return 0.0
    return -DEPTH * (1.0 + cos(pi * (x - CREST) / HALF)) / 2.0


xs = [0.0]
for end, count in COLUMNS:
    start = xs[-1]
    xs += [start + (end - start) * (i + 1) / count for i in range(count)]
columns = len(xs) - 1


def node(i, j, k):
    return 1 + i + (columns + 1) * (j + (ROWS + 1) * k)


lines = ["*HEADING", "arm of a snap-fit, written by arm.py", "*NODE"]
for k in range(2):
    for j in range(ROWS + 1):
        for i, x in enumerate(xs):
            y = under(x) + (HEIGHT - under(x)) * j / ROWS
            lines.append(f"{node(i, j, k)}, {x:.6g}, {y:.6g}, {WIDTH * k:.6g}")
lines.append("*ELEMENT, TYPE=C3D8, ELSET=arm")
for j in range(ROWS):
    for i in range(columns):
        front, back = ([node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)] for k in range(2))
        lines.append(", ".join(map(str, [1 + i + columns * j] + front + back)))
lines.append("*NSET, NSET=root")
lines += [str(node(0, j, k)) for k in range(2) for j in range(ROWS + 1)]
lines.append("*SURFACE, NAME=under, TYPE=ELEMENT")
lines += [f"{1 + i}, S3" for i in range(columns)]
with open("arm.inp", "w", encoding="ascii") as file:
    file.write("\n".join(lines) + "\n")
