#!/usr/bin/env python3
"""Writes slug.inp: a quarter of a slug and of a tube that narrows with a slope of 1:3, after SSNV504 of code_aster.

    slug.py FOLDER
"""

import math
import pathlib
import sys

AROUND, RINGS, LAYERS, RADIUS, LENGTH = 10, 8, 10, 50.0, 65.0
#: y and radius of the tube; its wall is 10 thick.
TUBE = [(5.0 * k - 5.0, 50.0) for k in range(16)] + [(70.0 + 2.5 * k, 50.0 - 2.5 * k / 3.0) for k in range(1, 7)]
TUBE += [(85.0 + 3.75 * k, 45.0) for k in range(1, 9)]


def main(folder):
    nodes, slug, tube, side, front, inner = [], [], [], [], [], []

    def node(radius, around, y):
        angle = 0.5 * math.pi * around / AROUND
        # exactly on the planes of symmetry
        ends = {0: (radius, 0.0), AROUND: (0.0, -radius)}
        x, z = ends.get(around, (radius * math.cos(angle), -radius * math.sin(angle)))
        nodes.append((x, y, z))
        return len(nodes)

    at = {}
    for layer in range(LAYERS + 1):
        y = LENGTH * layer / LAYERS
        at[layer, 0, None] = node(0.0, 0, y)
        for ring in range(1, RINGS + 1):
            for around in range(AROUND + 1):
                at[layer, ring, around] = node(RADIUS * ring / RINGS, around, y)
    for layer in range(LAYERS):
        for around in range(AROUND):
            end = [[at[l, 0, None], at[l, 1, around], at[l, 1, around + 1]] for l in (layer, layer + 1)]
            slug.append(end[0] + end[1])
            if layer + 1 == LAYERS:
                front.append((len(slug), "S2"))
            for ring in range(1, RINGS):
                corners = [(ring, around), (ring + 1, around), (ring + 1, around + 1), (ring, around + 1)]
                slug.append([at[l, *corner] for l in (layer, layer + 1) for corner in corners])
                if ring + 1 == RINGS:
                    side.append((len(slug), "S4"))
                if layer + 1 == LAYERS:
                    front.append((len(slug), "S2"))
    circle = lambda radius, y: [node(radius, around, y) for around in range(AROUND + 1)]
    wall = [[circle(radius + thick, y) for thick in (0.0, 10.0)] for y, radius in TUBE]
    for lower, upper in zip(wall, wall[1:]):
        for a in range(AROUND):
            tube.append([n for l in (lower, upper) for n in (l[0][a], l[1][a], l[1][a + 1], l[0][a + 1])])
            inner.append((len(slug) + len(tube), "S6"))
    lines = ["*NODE"] + [f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(nodes, 1)]
    number = 0
    for name, elements in ("SLUG", slug), ("TUBE", tube):
        for element in elements:
            number += 1
            kind = "C3D6" if len(element) == 6 else "C3D8"
            lines += [f"*ELEMENT, TYPE={kind}, ELSET={name}", ", ".join(map(str, [number] + element))]
    for name, faces in ("SIDE", side), ("FRONT", front), ("INNER", inner):
        lines += [f"*SURFACE, NAME={name}, TYPE=ELEMENT"] + [f"{element}, {face}" for element, face in faces]
    rear = sorted(n for (layer, _, _), n in at.items() if layer == 0)
    edge = [at[LAYERS, RINGS, around] for around in range(AROUND + 1)]
    for name, of in ("REAR", rear), ("EDGE", edge):
        lines += [f"*NSET, NSET={name}"] + [", ".join(map(str, of[i:i + 12])) for i in range(0, len(of), 12)]
    pathlib.Path(folder, "slug.inp").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
