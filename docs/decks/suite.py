"""Compares slipstick with CalculiX on the decks of a folder; see suite.sh.

    python3 suite.py FOLDER [DECK ...]             decks with contact or ties
    python3 suite.py FOLDER --without-contact      static decks of solid elements and springs without them
"""

import re
import struct
import subprocess
import sys
from pathlib import Path

CONTACT = re.compile(r"^\*\s*(contact\s*pair|tie)\b", re.IGNORECASE | re.MULTILINE)
# analyses that are not static, and other elements than solid ones
OTHER = re.compile(
    r"^\*\s*(frequency|buckle|heat transfer|cfd|dynamic|modal dynamic|steady state dynamics|coupled temperature|"
    r"uncoupled|electromagnetics|visco|shell section|beam section|membrane section|gap|dashpot|user|fluid section|"
    r"cyclic symmetry|substructure|sensitivity|complex frequency|green|submodel|refine|correlation|network|crack|"
    r"creep|design)",
    re.IGNORECASE | re.MULTILINE,
)
TYPE = re.compile(r"^\*\s*element.*?type\s*=\s*(\w+)", re.IGNORECASE | re.MULTILINE)


def run(words, folder, seconds):
    """Exit status and output of a program; None if it takes too long."""
    try:
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, errors="replace", timeout=seconds)
        return done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        return None, ""


def of_ccx(file):
    """Positions of the nodes and their last displacements, by number."""
    points, last, part = {}, {}, None
    for line in file.read_text(errors="replace").splitlines():
        if line.startswith("    2C"):
            part = points
        elif line.startswith(" -4  DISP"):
            last = part = {}
        elif line.startswith(" -3"):
            part = None
        elif line.startswith(" -1") and part is not None:
            part[int(line[3:13])] = [float(line[13 + 12 * i : 25 + 12 * i]) for i in range(3)]
        elif line.startswith(" -4"):
            part = None
    return points, last


def of_slipstick(folder):
    """Positions of the nodes and their last displacements."""
    data = sorted(folder.glob("path_*.vtu"))[-1].read_bytes()
    start = data.index(b"_", data.index(b"<AppendedData")) + 1

    def array(name):
        offset = int(re.search(rb'Name="%s"[^>]*offset="(\d+)"' % name, data).group(1))
        size = struct.unpack_from("<Q", data, start + offset)[0]
        values = struct.unpack_from("<%dd" % (size // 8), data, start + offset + 8)
        return [values[i : i + 3] for i in range(0, len(values), 3)]

    return array(b"Points"), array(b"displacement")


def deviation(deck):
    """L2 norm of the difference over that of CalculiX' displacements, and the number of nodes."""
    points, there = of_ccx(deck.with_suffix(".frd"))
    positions, here = of_slipstick(deck.parent / (deck.stem + "_solve"))
    size = max(abs(x) for point in points.values() for x in point) or 1.0
    key = lambda x: tuple(round(c / size * 1e5) for c in x)
    # nodes at the same place belong to different bodies: the nearest displacement is that of the same body
    places = {}
    for x, u in zip(positions, here):
        places.setdefault(key(x), []).append(u)
    difference = total = count = 0
    for number, u in there.items():
        near = [v for shift in neighbours(key(points[number])) for v in places.get(shift, [])]
        if near:
            difference += min(sum((a - b) ** 2 for a, b in zip(u, v)) for v in near)
            total += sum(a * a for a in u)
            count += 1
    return (difference / total) ** 0.5 if total else 0.0, count


def neighbours(key):
    shifts = (-1, 0, 1)
    return [(key[0] + i, key[1] + j, key[2] + k) for i in shifts for j in shifts for k in shifts]


def row(deck):
    """What becomes of a deck."""
    code, text = run(["slipstick", "check", deck.name], deck.parent, 60)
    if code != 0:
        error = re.search(r"error: (.*?)( \[|$)", text, re.MULTILINE)
        return "refused", error.group(1) if error else "too slow"
    source = deck.read_text(errors="replace")
    asked = re.sub(r"(?im)^\*\s*end\s*step", "*NODE FILE\nU\n*END STEP", source)
    copy = deck.with_name("with_output_" + deck.name)
    copy.write_text(asked)
    code, text = run(["ccx", "-i", copy.stem], deck.parent, 120)
    if code != 0 or not copy.with_suffix(".frd").exists():
        return "read", "CalculiX fails"
    copy.with_suffix(".frd").rename(deck.with_suffix(".frd"))
    code, text = run(["slipstick", "solve", deck.name, "--quiet", "--force"], deck.parent, 300)
    if code != 0:
        error = re.search(r"error: (.*)", text)
        return "read", "fails: " + (error.group(1)[:100] if error else "too slow")
    found, nodes = deviation(deck)
    return "solved", "%.2g %% at %d nodes" % (100 * found, nodes)


def is_static(text):
    """Whether a deck without contact is a static one of solid elements and springs."""
    types = TYPE.findall(text)
    solid = types and all(name.upper().startswith(("C3D", "SPRING")) for name in types)
    return bool(solid) and not CONTACT.search(text) and not OTHER.search(text)


def main():
    folder = Path(sys.argv[1]).resolve()
    without = "--without-contact" in sys.argv
    named = [word for word in sys.argv[2:] if not word.startswith("--")]
    known = sorted(path.name for path in folder.glob("*.inp") if not path.name.startswith("with_output_"))
    decks = [folder / name for name in named or known]
    wanted = is_static if without else CONTACT.search
    decks = [deck for deck in decks if wanted(deck.read_text(errors="replace"))]
    print("| deck | | deviation, or why not |\n|---|---|---|")
    counts = {}
    for deck in decks:
        what, why = row(deck)
        counts[what] = counts.get(what, 0) + 1
        print("| %s | %s | %s |" % (deck.stem, what, why), flush=True)
    print("\n%d decks: %s" % (len(decks), ", ".join("%d %s" % (n, what) for what, n in sorted(counts.items()))))


main()
