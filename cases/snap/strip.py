#!/usr/bin/env python3
"""Writes strip.inp, the curved strip of the snap-through as hexahedra, with the names that case.toml uses.

The strip is a shallow arch along x: half a wave of a cosine between its ends, of constant height. Its ends are held.
Lengths in mm.
"""
from math import cos, pi

LENGTH, RISE, HEIGHT, WIDTH = 40.0, 5.0, 0.5, 2.0     # WIDTH: half of the strip's; z = 0 is a plane of symmetry
COLUMNS, ROWS = 64, 3


def node(i, j, k):
    return 1 + i + (COLUMNS + 1) * (j + (ROWS + 1) * k)


lines = ["*HEADING", "curved strip, written by strip.py", "*NODE"]
for k in range(2):
    for j in range(ROWS + 1):
        for i in range(COLUMNS + 1):
            x = LENGTH * (i / COLUMNS - 0.5)
            y = RISE * 0.5 * (1.0 + cos(2.0 * pi * x / LENGTH)) + HEIGHT * (j / ROWS - 0.5)
            lines.append(f"{node(i, j, k)}, {x:.6g}, {y:.6g}, {WIDTH * k:.6g}")
lines.append("*ELEMENT, TYPE=C3D8, ELSET=strip")
for j in range(ROWS):
    for i in range(COLUMNS):
        front, back = ([node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)] for k in range(2))
        lines.append(", ".join(map(str, [1 + i + COLUMNS * j] + front + back)))
lines.append("*NSET, NSET=ends")
lines += [str(node(i, j, k)) for k in range(2) for j in range(ROWS + 1) for i in (0, COLUMNS)]
lines.append("*SURFACE, NAME=top, TYPE=ELEMENT")
lines += [f"{1 + i + COLUMNS * (ROWS - 1)}, S5" for i in range(COLUMNS)]
with open("strip.inp", "w", encoding="ascii") as file:
    file.write("\n".join(lines) + "\n")
