"""Writes the outlines of some characters of a font as a table, `inter.txt`.

    pip install fonttools
    python outlines.py Inter-Regular.otf > inter.txt

A line per character: the character, its advance width, and its outline as relative SVG path data, with y
upwards from the baseline, in 500ths of the font's size. The committed table comes from Inter 4.0 beta 7
(Debian's fonts-inter 4.0~beta7+ds-1).
"""

import sys

from fontTools.pens.basePen import BasePen
from fontTools.ttLib import TTFont

UNITS_PER_EM = 500

CHARACTERS = (
    "".join(map(chr, range(0x20, 0x7F)))
    + "".join(chr(code) for code in range(0xA1, 0x100) if code != 0xAD)
    + "ΓΔΘΛΞΠΣΦΨΩ"
    + "".join(chr(code) for code in range(0x3B1, 0x3CA))
    + "–—…−≤≥≠≈→←↑↓√∞∂∑∫′″⁰⁴⁵⁶⁷⁸⁹⁺⁻₀₁₂₃₄₅₆₇₈₉‰"
)


class Relative(BasePen):
    """Path data with rounded coordinates, relative to the rounded point before."""

    def __init__(self, glyphs, scale):
        super().__init__(glyphs)
        self.scale, self.at, self.path = scale, (0, 0), ""

    def write(self, command, points):
        numbers = []
        end = self.at
        for point in points:
            end = tuple(round(self.scale * c) for c in point)
            numbers += [end[0] - self.at[0], end[1] - self.at[1]]
        self.at = end
        text = "".join(str(n) if n < 0 else f" {n}" for n in numbers)
        self.path += command + text.lstrip()

    def _moveTo(self, point):
        self.write("m", [point])

    def _lineTo(self, point):
        self.write("l", [point])

    def _curveToOne(self, *points):
        self.write("c", points)

    def _closePath(self):
        self.path += "z"


def main():
    font = TTFont(sys.argv[1])
    glyphs, names = font.getGlyphSet(), font.getBestCmap()
    scale = UNITS_PER_EM / font["head"].unitsPerEm
    for character in CHARACTERS:
        name = names[ord(character)]
        pen = Relative(glyphs, scale)
        glyphs[name].draw(pen)
        print(character, round(scale * glyphs[name].width), pen.path, sep="\t")


main()
