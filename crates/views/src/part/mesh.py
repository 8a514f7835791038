#!/usr/bin/env python3
"""Fills the surfaces of the part with elements. Written by `slipstick export --case`.

    pip install gmsh
    python3 mesh.py                  # hexahedra, four in each tetrahedron
    python3 mesh.py --tetrahedra     # linear tetrahedra: faster to solve, but too stiff

The surfaces stay as they are, and new points of curved faces lie on the true curve, so contact
faces, supports and loads keep their places and names. For a finer or coarser mesh, run
`slipstick export --case` with another --size.
"""
import json
import os
import subprocess
import sys

try:
    import gmsh
except ImportError as missing:
    sys.exit(f"error: {missing}\n    help: pip install gmsh")

# For each body: its surface, the points of its curved faces between those of the surface, the mesh
# to write, the length of the edges (mean and longest), the surfaces around each piece of material, those inside the design
# domain, and the surfaces of each named face.
BODIES = []

# Gmsh's algorithms for the interior; the attempts in their order, with the optimizers that follow. Each attempt runs in
# its own process, which may crash.
ALGORITHMS = {"Delaunay": 1, "HXT": 10, "Frontal": 4}
ATTEMPTS = [("Delaunay", ["", "Netgen"]), ("HXT", ["", "Netgen"]), ("Frontal", ["", "Netgen"]), ("Delaunay", [])]


def load(body):
    """The surface of a body, its volumes and its groups."""
    gmsh.clear()
    gmsh.model.add(body["name"])
    gmsh.merge(body["surface"])
    volumes = []
    for surfaces in body["pieces"]:
        loop = gmsh.model.geo.addSurfaceLoop(surfaces)
        volumes.append(gmsh.model.geo.addVolume([loop]))
    gmsh.model.geo.synchronize()
    gmsh.model.addPhysicalGroup(3, volumes, name=body["name"])
    for name, surfaces in body["groups"].items():
        gmsh.model.addPhysicalGroup(2, surfaces, name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMax", body["longest"])


def fill(body, algorithm):
    """Fills the surface with tetrahedra."""
    load(body)
    gmsh.option.setNumber("Mesh.Algorithm3D", ALGORITHMS[algorithm])
    gmsh.model.mesh.generate(3)
    if len(gmsh.model.mesh.getElements(3)[0]) == 0:
        sys.exit("no elements")


def round_off(body, point):
    return tuple(round(c / (1e-6 * body["size"])) for c in point)


# Edges of a hexahedron between its nodes.
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]

# Qualities are Gmsh's minSICN. Worst quality that moving points onto curved faces may cause; an attempt with a better one
# is the last.
QUALITY = 0.05

# Quality of a usable mesh.
USABLE = 0.001


def lift(body):
    """Moves new points of curved faces onto the smooth surface, and points inside with them."""
    with open(body["curved"]) as file:
        moves = {round_off(body, start): end for start, end in json.load(file)}
    if not moves:
        return
    points, moved = {}, {}
    for _, surface in gmsh.model.getEntities(2):
        tags, all_points, _ = gmsh.model.mesh.getNodes(2, surface, includeBoundary=True)
        for place, tag in enumerate(tags):
            point = [float(c) for c in all_points[3 * place : 3 * place + 3]]
            end = moves.get(round_off(body, point), point)
            points[tag], moved[tag] = point, [b - a for a, b in zip(point, end)]
    tags, all_points, _ = gmsh.model.mesh.getNodes()
    for place, tag in enumerate(tags):
        points.setdefault(tag, [float(c) for c in all_points[3 * place : 3 * place + 3]])
    elements, nodes = [], []
    for kind, some, of in zip(*gmsh.model.mesh.getElements(3)):
        elements += list(some)
        nodes += [list(of[8 * place : 8 * place + 8]) for place in range(len(some))]
    on_surface = set(moved)
    neighbours = {}
    near = {tag for tag, move in moved.items() if any(move)}
    for _ in range(3):  # the elements around the moved points, and those around these
        touched = [own for own in nodes if not near.isdisjoint(own)]
        near.update(tag for own in touched for tag in own)
    for own in touched:
        for a, b in EDGES:
            neighbours.setdefault(own[a], set()).add(own[b])
            neighbours.setdefault(own[b], set()).add(own[a])
    inside = sorted(tag for tag in neighbours if tag not in on_surface)
    full = dict(moved)
    shares = {tag: 1.0 for tag, move in full.items() if any(move)}
    limits = [min(QUALITY, 0.7 * quality) for quality in gmsh.model.mesh.getElementQualities(elements, "minSICN")]
    for attempt in range(12):
        for tag, share in shares.items():
            moved[tag] = [share * c for c in full[tag]]
        for _ in range(20):  # each point inside moves by the mean of its neighbours
            for tag in inside:
                around = [moved.get(other, (0.0, 0.0, 0.0)) for other in neighbours[tag]]
                moved[tag] = [sum(move[c] for move in around) / len(around) for c in range(3)]
        for tag, move in moved.items():
            if tag in neighbours:
                gmsh.model.mesh.setNode(tag, [a + b for a, b in zip(points[tag], move)], [])
        qualities = gmsh.model.mesh.getElementQualities(elements, "minSICN")
        poor = {tag for own, quality, limit in zip(nodes, qualities, limits) if quality < limit for tag in own}
        if not poor:
            break
        for tag in poor:  # half way, then not at all
            if shares.get(tag, 0.0) > 0.0:
                shares[tag] = 0.5 * shares[tag] if attempt < 4 else 0.0
            elif attempt >= 4 and tag not in on_surface:
                moved[tag] = (0.0, 0.0, 0.0)
        if attempt >= 4:
            inside = [tag for tag in inside if tag not in poor]
    short = [(1.0 - share) * sum(c * c for c in full[tag]) ** 0.5 for tag, share in shares.items() if share < 1.0]
    if short:
        print(f"{body['mesh']}: {len(short)} points of curved faces lie up to {max(short):.2g} off, for better elements")


# Quality of tetrahedra, 1 if regular, below which their corners move, and how far those on the surface may, relative
# to the edges.
FLAT, FREEDOM = 0.2, 0.1

# Ways to move a point, along the axes and between them, and lengths of a move, relative to the edges.
WAYS = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z]
REACHES = (0.1, 0.05, 0.02, 0.01)


def tetrahedron_quality(a, b, c, d):
    """6 √2 V / l³ with the root mean square l of the edges."""
    u, v, w = ([q - p for p, q in zip(a, other)] for other in (b, c, d))
    volume = sum(u[k] * (v[k - 2] * w[k - 1] - v[k - 1] * w[k - 2]) for k in range(3)) / 6.0
    edges = ((a, b), (a, c), (a, d), (b, c), (b, d), (c, d))
    square = sum((q - p) ** 2 for start, end in edges for p, q in zip(start, end)) / 6.0
    return 6.0 * 2.0**0.5 * volume / square**1.5 if square > 0.0 else 0.0


def raise_flat(body):
    """Moves corners of flat tetrahedra, as at necks of the material that are thinner than the edges, as long as the
    worst tetrahedron at a corner becomes better. Outer faces stay; other points of the surface hardly move."""
    held, free = set(), set()
    for _, surface in gmsh.model.getEntities(2):
        corners = gmsh.model.mesh.getElements(2, surface)[2]  # with those on borders, which have no curves of their own
        (free if surface in body["cut"] else held).update(tag for some in corners for tag in some)
    tags, flat, _ = gmsh.model.mesh.getNodes()
    points = {tag: [float(c) for c in flat[3 * place : 3 * place + 3]] for place, tag in enumerate(tags)}
    elements, around = [], {}
    for _, some, nodes in zip(*gmsh.model.mesh.getElements(3)):
        elements += [list(nodes[4 * place : 4 * place + 4]) for place in range(len(some))]
    for own in elements:
        for tag in own:
            around.setdefault(tag, []).append(own)
    uniform = body["longest"] <= body["size"]
    sizes = {}  # length of the edges at a corner: the mean one, or less where the mesh is finer

    def size_at(tag):
        if uniform:
            return body["size"]
        if tag not in sizes:
            ends = {other for own in around[tag] for other in own if other != tag}
            lengths = [sum((a - b) ** 2 for a, b in zip(points[tag], points[other])) ** 0.5 for other in ends]
            sizes[tag] = min(body["size"], max(lengths))
        return sizes[tag]

    def quality(own):
        return tetrahedron_quality(*(points[tag] for tag in own))

    def better_place(tag):
        now, best, place = points[tag], 1.01 * min(map(quality, around[tag])) + 1e-9, None
        size = size_at(tag)
        for reach in REACHES:
            for way in WAYS:
                to = [c + reach * size * w for c, w in zip(now, way)]
                off = sum((a - b) ** 2 for a, b in zip(to, origin.get(tag, now))) ** 0.5
                if tag in free and off > FREEDOM * size:
                    continue
                points[tag] = to
                found = min(map(quality, around[tag]))
                if found > best:
                    best, place = found, to
        points[tag] = now
        return place

    origin = {}
    for _ in range(40):
        poor = sorted((value, own) for own in elements if (value := quality(own)) < FLAT)
        moved = {}
        for tag in dict.fromkeys(tag for _, own in poor for tag in own if tag not in held):
            place = better_place(tag)
            if place:
                origin.setdefault(tag, points[tag])
                moved[tag] = points[tag] = place
        for tag, place in moved.items():
            gmsh.model.mesh.setNode(tag, place, [])
        if not moved:
            return


def mesh(body, hexahedra, algorithm, optimizers):
    """Writes the mesh of a body."""
    fill(body, algorithm)
    for optimizer in optimizers:
        gmsh.model.mesh.optimize(optimizer)
    raise_flat(body)
    if hexahedra:
        gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)
        gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 2)
        gmsh.model.mesh.refine()
        lift(body)
    said, worst = [], 1.0
    kinds, tags, _ = gmsh.model.mesh.getElements(3)
    for kind, elements in zip(kinds, tags):
        quality = min(gmsh.model.mesh.getElementQualities(elements, "minSICN"))
        if quality < USABLE:
            sys.exit(f"an element of quality {quality:.4f}")
        name = gmsh.model.mesh.getElementProperties(kind)[0]
        said.append(f"{body['mesh']}: {len(elements)} elements ({name}), worst quality {quality:.3f}")
        worst = min(worst, quality)
    gmsh.write(body["mesh"])
    print("\n".join(said))
    print(worst)


def attempt(body, hexahedra, number):
    """What a process does: one attempt for one body."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    try:
        mesh(body, hexahedra, *ATTEMPTS[number])
    except Exception as error:
        sys.exit(f"{error}")
    gmsh.finalize()


def main():
    os.chdir(os.path.dirname(os.path.abspath(__file__)))
    words = sys.argv[1:]
    unknown = [word for word in words if word != "--tetrahedra"]
    if unknown and "--attempt" not in words:
        sys.exit(f"error: {unknown[0]}: the only option is --tetrahedra\n    help: `slipstick export --case` has --size")
    hexahedra = "--tetrahedra" not in words
    if "--attempt" in words:
        at = words.index("--attempt")
        return attempt(BODIES[int(words[at + 1])], hexahedra, int(words[at + 2]))
    for place, body in enumerate(BODIES):
        said, best, kept = [], ("", 0.0), body["mesh"] + ".best"
        for file in (body["surface"], body["curved"]):
            if not os.path.isfile(file):
                sys.exit(f"error: there is no {file}\n    help: export the part again")
        for file in (body["mesh"], kept):  # of an earlier run
            if os.path.exists(file):
                os.remove(file)
        for number, (name, _) in enumerate(ATTEMPTS):
            again = [sys.executable, os.path.basename(__file__), *words, "--attempt", str(place), str(number)]
            done = subprocess.run(again, capture_output=True, text=True)
            lines = done.stderr.strip().splitlines()
            if done.returncode != 0:
                said.append(f"{name}: {lines[-1] if lines and done.returncode > 0 else 'crashed'}")
                continue
            *told, quality = done.stdout.strip().splitlines()
            # another algorithm may make five times as many elements, which must be worth it
            if float(quality) >= QUALITY or float(quality) > 1.5 * best[1]:
                best = ("\n".join(told), float(quality))
                os.replace(body["mesh"], kept)
            if float(quality) >= QUALITY:
                break
        if best[1] > 0.0:
            os.replace(kept, body["mesh"])
            print(best[0], flush=True)
            if best[1] < QUALITY:
                print(
                    f"warning: {body['mesh']} has elements of poor quality\n    help: `slipstick check` names the worst; "
                    "another --size (0.7 of this one, for instance) or --threshold of the export may avoid them",
                    file=sys.stderr,
                )
        else:
            sys.exit(
                f"error: Gmsh cannot fill {body['surface']} ({'; '.join(said)})\n"
                "    help: export again with another --size (0.7 of this one, for instance) or --threshold"
            )


if __name__ == "__main__":
    main()
