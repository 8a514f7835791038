"""Measures how long Chromium takes to draw a frame of a large model in the page of `slipstick ui`.

python docs/measure/ui/frames.py PROGRAM    PROGRAM is slipstick

The model is a cube of 99,452 hexahedra. Times are the smallest of eight, in ms, with the full view and with the
coarser one that is shown during rotation.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from chromium import Browser

CASE = """[[body]]
name = "cube"
box = { min = [0, 0, 0], max = [46, 46, 47], elements = [46, 46, 47] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[dirichlet]]
set = "cube_ymin"
[load_path]
steps = 1
"""
# the viewer is found when it draws; a pixel can only be read once all is drawn
FIND = """(draw => { Viewer.prototype.draw = function () { window.found = this; draw.call(this); };
  element('canvas').dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' })); })(Viewer.prototype.draw)"""
MEASURE = """(coarse => {
  const viewer = window.found, pixel = new Uint8Array(4), times = [];
  viewer.coarse = coarse;
  for (let i = 0; i < 8; i++) {
    const begin = performance.now();
    viewer.yaw += 0.1;
    viewer.draw();
    viewer.gl.readPixels(0, 0, 1, 1, viewer.gl.RGBA, viewer.gl.UNSIGNED_BYTE, pixel);
    times.push(performance.now() - begin);
  }
  return Math.min(...times);
})"""


def main(program: str) -> None:
    """Prints the times."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / "cube.toml").write_text(CASE, encoding="utf-8")
        line = [str(Path(program).resolve()), "ui", "cube.toml", "--no-browser", "--json"]
        server = subprocess.Popen(line, cwd=folder, stdout=subprocess.PIPE, text=True)
        assert server.stdout
        url = json.loads(server.stdout.readline())["url"]
        browser = Browser(folder / "profile")
        try:
            browser.size(1400, 900)
            browser.send("Page.navigate", url=url)
            view = "model?case=cube.toml"
            browser.until_inside(view, "document.documentElement.dataset.ready === 'view'")
            browser.inside(view, f"({FIND}, 1)")
            browser.until_inside(view, "Boolean(window.found)")
            for name, coarse in (("full", "false"), ("coarse", "true"), ("full", "false")):
                print(f"{name}: {browser.inside(view, f'{MEASURE}({coarse})'):.0f} ms")
        finally:
            browser.close()
            server.terminate()
            server.wait()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
