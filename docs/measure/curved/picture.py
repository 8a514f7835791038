"""Draws the table of fits: python3 docs/measure/curved/picture.py fits.md fits.svg

For each number of elements of the shaft, the largest deviation of the mean pressure from Lamé's and the
largest scatter of the nodal pressures over all hubs, in percent, on logarithmic scales.
"""

import math
import re
import sys

COLOURS = {
    "linear, facets": ("#d55e00", ""),
    "quadratic, facets": ("#d55e00", "6 4"),
    "linear, surfaces": ("#0072b2", ""),
    "quadratic, surfaces": ("#0072b2", "6 4"),
}
LEAST, MOST = 0.01, 1000.0  # percent
WIDTH, HEIGHT = 440, 380
LEFT, TOP, RIGHT, BOTTOM = 70, 60, 425, 325


def read(path):
    """For each kind of row, {shaft: [(deviation, scatter) of each hub]}."""
    found = {name: {} for name in COLOURS}
    for line in open(path, encoding="utf-8"):
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) > 2 and cells[1] in found:
            pairs = [re.fullmatch(r"([-+.\d]+) \(([.\d]+)\)", cell).groups() for cell in cells[2:]]
            found[cells[1]][int(cells[0])] = [(abs(float(p)), float(s)) for p, s in pairs]
    return found


def across(shaft):
    return LEFT + (RIGHT - LEFT) * math.log(shaft / 11) / math.log(70 / 11)


def up(value):
    value = min(max(value, LEAST), MOST)
    return BOTTOM - (BOTTOM - TOP) * math.log(value / LEAST) / math.log(MOST / LEAST)


def panel(found, of, title):
    out = [f'<text x="{(LEFT + RIGHT) / 2}" y="{TOP - 14}" text-anchor="middle" font-size="14">{title}</text>']
    for power in range(-2, 4):
        y = up(10.0**power)
        out.append(f'<path d="M{LEFT} {y:.1f}H{RIGHT}" stroke="#ddd"/>')
        label = f"≤ {LEAST}" if power == -2 else f"{10.0**power:g}"
        out.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{label}</text>')
    shafts = sorted(next(iter(found.values())))
    for shaft in shafts:
        x = across(shaft)
        out.append(f'<path d="M{x:.1f} {BOTTOM}v5" stroke="#333"/>')
        shift = {12: -4, 13: 4}.get(shaft, 0)
        out.append(f'<text x="{x + shift:.1f}" y="{BOTTOM + 19}" text-anchor="middle">{shaft}</text>')
    for name, (colour, dashes) in COLOURS.items():
        points = [(across(s), up(max(pair[of] for pair in found[name][s]))) for s in shafts]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        out.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>')
        out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points]
    out.append(f'<path d="M{LEFT} {TOP}V{BOTTOM}H{RIGHT}" fill="none" stroke="#333"/>')
    middle = f'x="{(LEFT + RIGHT) / 2}" y="{BOTTOM + 40}"'
    out.append(f'<text {middle} text-anchor="middle">elements of the shaft on a quarter of the circle</text>')
    turned = f'transform="translate(20 {(TOP + BOTTOM) / 2}) rotate(-90)"'
    out.append(f'<text {turned} text-anchor="middle">percent, the worst of six hubs</text>')
    return out


def main():
    found = read(sys.argv[1])
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * WIDTH} {HEIGHT + 30}" font-family="sans-serif" '
        'font-size="12" role="img">',
        "<title>Pressures of fits between facets and between surfaces</title>",
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for n, title in enumerate(["Mean pressure: deviation from Lamé", "Nodal pressures: standard deviation / mean"]):
        out += [f'<g transform="translate({n * WIDTH} 0)">', *panel(found, n, title), "</g>"]
    for n, (name, (colour, dashes)) in enumerate(COLOURS.items()):
        x = 120 + 180 * n
        out.append(f'<path d="M{x} {HEIGHT + 8}h30" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>')
        out.append(f'<text x="{x + 36}" y="{HEIGHT + 12}">{name}</text>')
    out.append("</svg>")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n")


main()
