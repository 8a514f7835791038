#!/usr/bin/env python3
"""Writes buffer.inp: two legs joined at one end, with a slot between them, as hexahedra. Lengths in mm."""

LENGTH, HEIGHT, DEPTH = 48.0, 20.0, 2.0
HINGE = 40.0                    # the slot ends here
SLOT = (8.0, 12.0)              # its lower and upper face
SIZE = 1.0

columns, rows = int(LENGTH / SIZE), int(HEIGHT / SIZE)
solid = [
    (i, j) for j in range(rows) for i in range(columns)
    if i * SIZE >= HINGE or not SLOT[0] <= j * SIZE < SLOT[1]
]
numbers = {}


def node(i, j, k):
    return numbers.setdefault((i, j, k), len(numbers) + 1)


cells = [
    [node(i + a, j + b, k) for k in range(2) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))] for i, j in solid
]
lines = ["*HEADING", "a buffer with a slot, written by buffer.py", "*NODE"]
lines += [f"{n}, {i * SIZE:.6g}, {j * SIZE:.6g}, {k * DEPTH:.6g}" for (i, j, k), n in numbers.items()]
lines.append("*ELEMENT, TYPE=C3D8, ELSET=buffer")
lines += [", ".join(map(str, [1 + e] + corners)) for e, corners in enumerate(cells)]

lines.append("*NSET, NSET=nodes")
lines += [str(n) for n in numbers.values()]


def surface(name, face, inside):
    lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
    lines.extend(f"{1 + e}, {face}" for e, (i, j) in enumerate(solid) if inside(i * SIZE, j * SIZE))


# S3 is the face at the lowest y, S5 that at the highest
surface("bottom", "S3", lambda x, y: y == 0.0)
surface("top", "S5", lambda x, y: y == HEIGHT - SIZE)
surface("slot_lower", "S5", lambda x, y: x < HINGE and y == SLOT[0] - SIZE)
surface("slot_upper", "S3", lambda x, y: x < HINGE and y == SLOT[1])
with open("buffer.inp", "w", encoding="ascii") as file:
    file.write("\n".join(lines) + "\n")
