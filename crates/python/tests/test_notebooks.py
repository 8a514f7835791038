"""The notebooks in docs/notebooks run, cell by cell, and give the results stored in them."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[3] / "docs" / "notebooks").glob("*.ipynb"))


def run(code: str, names: dict[str, Any]) -> tuple[Any, str]:
    """The value of the last expression, as a notebook shows it, and what the cell prints."""
    tree = ast.parse(code)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, "cell", "exec"), names)
        value = last and eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    return value, printed.getvalue()


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", text)]


def agrees(stored: str, found: str) -> bool:
    """Whether the words are the same, and the numbers but for round-off."""
    a, b = numbers(stored), numbers(found)
    return len(a) == len(b) and b == pytest.approx(a, rel=1e-4, abs=1e-6)


def check_outputs(cell: dict[str, Any], value: Any, printed: str) -> None:
    """Every number stored with a cell is that of this run; of pictures, there is one."""
    kept = cell["outputs"]
    text = "".join("".join(output["text"]) for output in kept if output["output_type"] == "stream")
    assert agrees(text, printed), f"stored {text!r}, printed {printed!r}"
    results = [output["data"] for output in kept if output["output_type"] != "stream"]
    assert value is None or results, "a value is shown, but none is stored"
    for data in results:
        if not any(kind.startswith("image/") for kind in data):
            stored = "".join(data["text/plain"])
            assert agrees(stored, repr(value)), f"stored {stored!r}, found {value!r}"


@pytest.mark.skipif(not NOTEBOOKS, reason="the notebooks are only in the repository")
def test_there_are_notebooks() -> None:
    found = {notebook.stem for notebook in NOTEBOOKS}
    assert found == {"first_design", *NEEDS}


# packages that a notebook needs, and a fact that its results must show
NEEDS = {
    "custom_objective": ["pandas"],
    "force_displacement": ["pandas", "matplotlib"],
    "jax_gradient": ["jax"],
    "path_animation": ["pyvista", "imageio"],
}


def first_design(names: dict[str, Any], shown: list[Any]) -> None:
    assert shown[-1]._repr_png_().startswith(b"\x89PNG"), "it ends with its picture"


def custom_objective(names: dict[str, Any], shown: list[Any]) -> None:
    history = names["result"].history
    assert history["objective"].iloc[-1] < 0.95 * history["objective"].iloc[0]
    assert history["press"].iloc[-1] > 0.49 * names["start"]


def force_displacement(names: dict[str, Any], shown: list[Any]) -> None:
    forces = names["forces"]
    assert list(forces.index) == [0.0, 0.1, 0.2, 0.3] and forces.is_monotonic_increasing
    # the secant between the neighbours of the coefficient at which the tangent is drawn
    secant = (forces[0.3] - forces[0.1]) / 0.2
    assert names["slope"] == pytest.approx(secant, rel=0.2)


def jax_gradient(names: dict[str, Any], shown: list[Any]) -> None:
    for name, value in names["truth"].items():
        assert names["identified"][name] == pytest.approx(value, rel=5e-3)


def path_animation(names: dict[str, Any], shown: list[Any]) -> None:
    animation = Path("path.gif").read_bytes()
    assert animation.startswith(b"GIF") and animation.count(b"\x21\xf9\x04") == 5


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in NEEDS.get(notebook.stem, []):
        pytest.importorskip(package, reason=f"{package} is not installed: a notebook is not run")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {}
    shown = []
    for cell in (cell for cell in cells if cell["cell_type"] == "code"):
        value, printed = run("".join(cell["source"]), names)
        check_outputs(cell, value, printed)
        shown.append(value)
    assert len(shown) >= 2
    globals()[notebook.stem](names, shown)
