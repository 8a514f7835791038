"""Models of `contact4` and `beamcontact` of CalculiX' test suite on finer meshes, in CalculiX and in slipstick.

    python3 coarse.py FOLDER

writes the decks to a folder, solves them with both programs, and tabulates the deviation of all displacements; needs
`ccx` and `slipstick` on the path.
"""

import subprocess
import sys
from pathlib import Path

sys.argv, folder = sys.argv[:1], Path(sys.argv[1])
exec(Path(__file__).with_name("suite.py").read_text().replace("\nmain()\n", "\n"))

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
LAW = """*SURFACE INTERACTION, NAME=LAW
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
%g
*MATERIAL, NAME=STEEL
*ELASTIC
210000, %g
*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL
"""


class Deck:
    def __init__(self, kind):
        self.kind, self.nodes, self.elements, self.sets = kind, [], [], {}

    def box(self, low, size, counts):
        """A box of elements of its own nodes; returns the elements by their places."""
        ids, found = {}, {}

        def node(place):
            if place not in ids:
                self.nodes.append([low[c] + size[c] * place[c] / (2 * counts[c]) for c in range(3)])
                ids[place] = len(self.nodes)
            return ids[place]

        places = [(i, j, k) for k in range(counts[2]) for j in range(counts[1]) for i in range(counts[0])]
        for place in places:
            corners = [tuple(2 * (place[c] + corner[c]) for c in range(3)) for corner in CORNERS]
            nodes = [node(corner) for corner in corners]
            if self.kind == "C3D20":
                middles = [tuple((corners[a][c] + corners[b][c]) // 2 for c in range(3)) for a, b in EDGES]
                nodes += [node(middle) for middle in middles]
            self.elements.append(nodes)
            found[place] = len(self.elements)
        return found

    def at(self, component, value, among):
        """The nodes of some elements in a plane."""
        nodes = {n for element in among for n in self.elements[element - 1]}
        return sorted(n for n in nodes if abs(self.nodes[n - 1][component] - value) < 1e-9)

    def text(self, keywords):
        rows = ["*NODE, NSET=NODES"] + ["%d, %.12g, %.12g, %.12g" % (i, *x) for i, x in enumerate(self.nodes, 1)]
        rows.append("*ELEMENT, TYPE=%s, ELSET=ALL" % self.kind)
        for i, nodes in enumerate(self.elements, 1):
            words = [str(n) for n in [i] + nodes]
            rows += [", ".join(words)] if len(words) < 12 else [", ".join(words[:11]) + ",", ", ".join(words[11:])]
        for (sort, name), members in self.sets.items():
            rows += ["*%s, %s=%s" % (sort, sort, name)] + ["%d," % member for member in members]
        return "\n".join(rows) + "\n" + keywords


def blocks(kind, n):
    """A cube of half the edge, pressed onto a cube: `contact4` with n elements along each edge."""
    deck = Deck(kind)
    below = deck.box((0, 0, 0), (1, 1, 1), (n, n, n))
    above = deck.box((0.25, 0.25, 1), (0.5, 0.5, 0.5), (n, n, n))
    layer = lambda box, k: [element for place, element in box.items() if place[2] == k]
    deck.sets = {
        ("ELSET", "UP"): layer(below, n - 1),
        ("ELSET", "DOWN"): layer(above, 0),
        ("ELSET", "LID"): layer(above, n - 1),
        ("NSET", "BASE"): deck.at(2, 0, below.values()),
        ("NSET", "TOP"): deck.at(2, 1.5, above.values()),
    }
    return deck.text(
        "*SURFACE, NAME=SLAVE\nDOWN, S1\n*SURFACE, NAME=MASTER\nUP, S2\n" + LAW % (1e7, 0.0)
        + "*CONTACT PAIR, INTERACTION=LAW, TYPE=SURFACE TO SURFACE\nSLAVE, MASTER\n*BOUNDARY\nBASE, 1, 3\nTOP, 1, 2\n"
        "*STEP, NLGEOM\n*STATIC\n0.5, 1\n*DLOAD\nLID, P2, 100\n*NODE FILE\nU\n*END STEP\n"
    )


def beam(n):
    """A clamped beam whose end leans on two tools that begin at z = 7.5: `beamcontact` with elements of edge 1/n."""
    deck = Deck("C3D8")
    body = deck.box((0, 0, 0), (1, 1.5, 8), (n, 3 * n // 2, 8 * n))
    tools = [list(deck.box((x, -0.5, 7.5), (0.1, 2.5, 1), (1, 1, 1)).values())[0] for x in (-0.1, 1)]
    side = lambda i: [element for place, element in body.items() if place[0] == i and place[2] >= 7 * n]
    held = deck.at(2, 0, body.values()) + sorted(n for tool in tools for n in deck.elements[tool - 1])
    deck.sets = {("ELSET", "LEFT"): side(0), ("ELSET", "RIGHT"): side(n - 1), ("NSET", "HELD"): held}
    loaded = next(i for i, x in enumerate(deck.nodes, 1) if max(abs(x[0]), abs(x[1] - 0.75), abs(x[2] - 4)) < 1e-9)
    return deck.text(
        "*SURFACE, NAME=S1\nLEFT, S6\n*SURFACE, NAME=S2\nRIGHT, S4\n*SURFACE, NAME=M1\n%d, S4\n" % tools[0]
        + "*SURFACE, NAME=M2\n%d, S6\n" % tools[1] + LAW % (1e8, 0.3)
        + "*CONTACT PAIR, INTERACTION=LAW, TYPE=SURFACE TO SURFACE\nS1, M1\nS2, M2\n*BOUNDARY\nHELD, 1, 3\n"
        "*STEP, NLGEOM\n*STATIC\n0.999, 1\n*CLOAD\n%d, 1, 1000\n*NODE FILE\nU\n*END STEP\n" % loaded
    )


def compared(name, text, *words):
    """The deviation of a deck, in percent."""
    deck = folder / (name + ".inp")
    deck.write_text(text)
    for command in (["ccx", "-i", name], ["slipstick", "solve", deck.name, "--quiet", "--force", *words]):
        subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=600)
    return 100 * deviation(deck.resolve())[0]


def tabulate():
    folder.mkdir(exist_ok=True)
    # pressures at the points, as decks are read, and at nodes with two shapes of multipliers
    nodes = ["--set", 'contact[*].enforcement.penalty.pressure_at="nodes"', "--set"]
    ways = [[]] + [nodes + ['contact[*].multiplier_shape="%s"' % shape] for shape in ("dual", "standard")]
    print("| model | points | nodes, dual | nodes, standard |\n|---|--:|--:|--:|")
    rows = [("blocks, %d³ `%s` each" % (n, kind), blocks(kind, n)) for kind in ("C3D20", "C3D8") for n in (1, 2, 4)]
    rows += [("beam, `C3D8` of edge 1/%d" % n, beam(n)) for n in (4, 8)]
    for k, (name, text) in enumerate(rows):
        all_ways = [compared("m%d" % k, text, *words) for words in ways]
        print("| %s | %.2g %% | %.2g %% | %.2g %% |" % (name, *all_ways), flush=True)


tabulate()
