"""Takes a STEP file of two parts through the page of `slipstick ui` in Chromium, and makes one picture of it.

SLIPSTICK_PYTHON=python3 python3 docs/measure/ui/film.py PROGRAM FOLDER [PICTURE]

PROGRAM is slipstick; screenshots of a narrow page, whose parts lie below each other, go to FOLDER, and a cut of each to
PICTURE. Needs Chromium, and Python with Gmsh (pip install gmsh). Every step fails if the page does not show what it
should.
"""

from __future__ import annotations

import base64
import json
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

from chromium import Browser, page

# A saddle of 40 × 20 × 12 mm with a round seat, and a rounded shaft that rests in it, with a gap of 0 to 0.3 mm.
PARTS = r"""
import gmsh, re
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
occ.cut([(3, occ.addBox(-20, -20, 0, 40, 20, 12))], [(3, occ.addCylinder(0, 2, -1, 0, 0, 14, 9))])
shaft = occ.addCylinder(0, 1, 0, 0, 0, 12, 8)
occ.intersect([(3, shaft)], [(3, occ.addBox(-6, -10, 0, 12, 14, 12))])
occ.synchronize()
gmsh.write("part.step")
text = open("part.step").read()
for number, name in ((1, "saddle"), (2, "shaft")):
    text = re.sub(rf"'Open CASCADE STEP translator [0-9. ]*\.{number}'", f"'{name}'", text)
open("part.step", "w").write(text)
"""

# What is changed in the case that the program proposes: the shaft is pressed in and not slid, in six steps, and there
# are fewer iterations, with a sharpness that rises earlier and in larger steps.
CHANGES = (
    ("    { t = 1.0, u = [0.6, -0.11, 0.0] },   # then slid\n", ""),
    ("{ t = 0.5, u =", "{ t = 1.0, u ="),
    ("steps = 10", "steps = 6"),
    ("iterations = 40", "iterations = 9"),
    ("[[0, 1], [10, 2], [17, 4], [24, 8], [31, 16]]", "[[0, 1], [4, 4], [6, 16]]"),
)

PATIENCE = 900.0  # seconds
WIDTH, HEIGHT = 560, 440  # of each cut


def main(program: str, folder: Path, picture: Path | None) -> None:
    """Operates the page from the STEP file of two parts to that of the optimized one."""
    program = str(Path(program).resolve())
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        place = Path(name)
        subprocess.run([sys.executable, "-c", PARTS], cwd=place, check=True, stdout=subprocess.DEVNULL)
        with page(program, place, "part.step") as (browser, url):
            frames = operate(browser, url, place, folder)
            if picture:
                strip(browser, frames, picture)


Frame = tuple[Path, str, float]


def operate(browser: Browser, url: str, place: Path, folder: Path) -> list[Frame]:
    """The screenshots, what they show, and the height at which their cuts begin."""
    frames: list[Frame] = []

    def shot(words: str, part: str) -> None:
        """Takes a screenshot, of which the picture shows what begins with this element."""
        file = folder / f"film_{len(frames) + 1}.png"
        # the name of a temporary folder says nothing
        browser.value("element('folder').style.visibility = 'hidden'")
        # the bar of commands stays at the top of what is visible
        browser.value("scrollTo(0, 0)")
        top = browser.value(f"element('{part}').getBoundingClientRect().y + scrollY - 4")
        browser.picture(file)
        frames.append((file, f"{len(frames) + 1}. {words}", top))

    def press(command: str) -> None:
        browser.until(f"!document.querySelector('[data-command={command}]').disabled", PATIENCE)
        browser.value(f"document.querySelector('[data-command={command}]').click()")

    def done(command: str) -> None:
        browser.until(f"element('status').textContent === '{command}: done'", PATIENCE)

    def loaded(view: str) -> None:
        browser.until(f"element('frame').dataset.shows.includes('{view}')", PATIENCE)
        # the end of a run loads it again
        time.sleep(5.0)
        browser.until("!element('frame').classList.contains('loading')", PATIENCE)

    def pair() -> None:
        """Marks the surfaces of the contact pair."""
        browser.value("""[...document.querySelectorAll('#outline button')]
          .find(b => b.textContent.includes(' on ')).click()""")

    def look(view: str, words: str, hidden: str = "", least: float = 0.0) -> None:
        """Shows a field in a view, without one of the bodies, and without elements of lower density."""
        shows = browser.inside(
            view,
            f"""(() => {{
              const labels = [...document.querySelectorAll('#controls label')];
              const options = [...document.querySelectorAll('#controls option')];
              const option = options.find(option => option.textContent.includes('{words}'));
              if (!option) return options.map(option => option.textContent).join();
              const select = option.closest('select');
              select.value = option.value; select.dispatchEvent(new Event('change'));
              const label = labels.find(of => of.textContent.trim() === '{hidden}');
              if (label && label.querySelector('input').checked) label.querySelector('input').click();
              const slider = labels.find(of => of.textContent.includes('density above'))?.querySelector('input');
              if ({least} && !slider) return document.querySelector('#controls').innerHTML;
              if ({least}) {{ slider.value = {least}; slider.dispatchEvent(new Event('input')); }}
              element('canvas').scrollIntoView();
              return 'shown';
            }})()""",
        )
        assert shows == "shown", shows

    # high enough that the views, which are drawn only where they are visible, are above the end
    browser.size(WIDTH, 3600)
    browser.send("Page.navigate", url=url)
    browser.until("document.documentElement.dataset.ready === 'true'", PATIENCE)
    browser.until("element('verdict').textContent.includes('part.step is a STEP file')", PATIENCE)
    press("new")
    browser.until("element('text-title').textContent === 'part.toml'", PATIENCE)
    loaded("model?case=part.toml")
    browser.until("element('outline').textContent.includes('Contacts')", PATIENCE)
    pair()
    look("model?case=part.toml", "bodies", hidden="shaft")
    shot("The case of part.step: meshed, with the contact\npair that the program found (the shaft is hidden)", "frames")
    text = browser.value("source.value")
    for old, new in CHANGES:
        assert old in text, old
        text = text.replace(old, new, 1)
    set_text = f"source.focus(); source.value = {json.dumps(text)}"
    browser.value(f"{{ {set_text}; source.dispatchEvent(new Event('input')) }}")
    browser.until("changed() && now.checked && now.checked.text === source.value", PATIENCE)
    press("check")
    done("check")
    line = text[: text.index("    { t = 1.0, u =")].count("\n")
    # one line more than the page shows
    browser.value(f"element('editor').style.height = '26rem'; element('editor').scrollTop = {line} * LINE")
    shot("Four values of the text changed: motion, steps,\niterations, sharpness", "text-title")
    press("solve")
    done("solve")
    loaded("report?run=part_solve")
    look("report?run=part_solve", "von Mises stress")
    shot("Solved: the stress before the optimization", "frames")
    press("optimize")
    done("optimize")
    assert "warning" not in browser.value("element('log').textContent")
    loaded("report?run=part&")
    look("report?run=part&", "density", hidden="shaft", least=0.5)
    shot("Optimized for the largest contact force with 40 %\nof the volume: what has a density above 0.5", "frames")
    shot("The objective over the iterations; more charts and\nthe log follow", "progress")
    browser.value("element('kind').value = 'step'")
    press("export")
    done("export")
    exported = place / "part_optimized.step"
    print(f"{exported.name}: {exported.stat().st_size / 1e6:.2f} MB")
    browser.value("names()")
    choose = f"element('case').value = {json.dumps(exported.name)}"
    browser.until(
        f"[...element('case').options].some(option => option.value === {json.dumps(exported.name)})"
    )
    browser.value(f"{{ {choose}; element('case').dispatchEvent(new Event('change')) }}")
    browser.until(f"element('verdict').textContent.includes({json.dumps(exported.name)})")
    press("new")
    browser.until(f"element('text-title').textContent === '{exported.stem}.toml'", PATIENCE)
    loaded(f"model?case={exported.stem}.toml")
    shot(
        "The export, the saddle only, opened and meshed;\nthe block on it is a guess of the program",
        "frames",
    )
    return frames


# Draws the cuts of all screenshots, two in a row with their captions, and returns the picture in 256 colours: the most frequent
# ones of 5 bits, and for the others the nearest of these.
COMPOSE = """(async () => {
  const [gap, line] = [8, 24], rows = Math.ceil(shots.length / 2), below = high + 2 * line + 2 * gap;
  const canvas = document.createElement('canvas'), draw = canvas.getContext('2d'), width = 2 * wide + gap;
  canvas.width = width; canvas.height = rows * below;
  draw.fillStyle = 'white'; draw.fillRect(0, 0, width, canvas.height);
  draw.font = '20px sans-serif';
  for (const [k, [data, words, top]] of shots.entries()) {
    const image = new Image(); image.src = 'data:image/png;base64,' + data; await image.decode();
    const x = k % 2 * (wide + gap), y = Math.floor(k / 2) * below;
    draw.drawImage(image, 0, top, wide, high, x, y, wide, high);
    draw.strokeStyle = '#bbb'; draw.strokeRect(x + 0.5, y + 0.5, wide - 1, high - 1);
    draw.fillStyle = '#222';
    words.split('\\n').forEach((part, n) => draw.fillText(part, x + 4, y + high + (n + 1) * line));
  }
  const pixels = draw.getImageData(0, 0, width, canvas.height).data, count = new Map();
  const key = i => (pixels[i] >> 3) << 10 | (pixels[i + 1] >> 3) << 5 | pixels[i + 2] >> 3;
  for (let i = 0; i < pixels.length; i += 4) {
    const k = key(i), of = count.get(k) || [0, 0, 0, 0];
    of[0]++; for (let c = 0; c < 3; c++) of[c + 1] += pixels[i + c];
    count.set(k, of);
  }
  const mean = of => [1, 2, 3].map(c => Math.round(of[c] / of[0]));
  const palette = [...count.values()].sort((a, b) => b[0] - a[0]).slice(0, 256).map(mean), index = new Map();
  for (const [k, of] of count) {
    const m = mean(of), off = p => p.reduce((sum, v, c) => sum + (v - m[c]) ** 2, 0);
    index.set(k, palette.reduce((best, p, j) => off(p) < off(palette[best]) ? j : best, 0));
  }
  let text = '';
  for (let i = 0; i < pixels.length; i += 4) text += String.fromCharCode(index.get(key(i)));
  window.composed = { width, height: canvas.height, palette: palette.flat(), pixels: btoa(text) };
})()"""


def strip(browser: Browser, frames: list[Frame], picture: Path) -> None:
    """One picture of all."""
    browser.send("Page.navigate", url="about:blank")
    browser.value(f"{{ window.shots = []; window.wide = {WIDTH}; window.high = {HEIGHT} }}")
    for file, words, top in frames:
        data = base64.b64encode(file.read_bytes()).decode()
        browser.value(f"{{ shots.push([{json.dumps(data)}, {json.dumps(words)}, {top}]) }}")
    browser.value(f"{{ {COMPOSE} }}")
    browser.until("window.composed !== undefined", PATIENCE)
    of = browser.value("composed")
    width, height = of["width"], of["height"]
    rows = base64.b64decode(of["pixels"])
    raw = b"".join(b"\0" + rows[y * width : (y + 1) * width] for y in range(height))

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    parts = (b"IHDR", head), (b"PLTE", bytes(of["palette"])), (b"IDAT", zlib.compress(raw, 9)), (b"IEND", b"")
    picture.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts))
    print(f"{picture}: {picture.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        raise SystemExit(__doc__)
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]) if len(sys.argv) > 3 else None)
