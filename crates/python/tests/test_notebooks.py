"""The notebooks in docs/notebooks run, cell by cell."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[3] / "docs" / "notebooks").glob("*.ipynb"))


def run(code: str, names: dict[str, Any]) -> Any:
    """The value of the last expression, as a notebook shows it."""
    tree = ast.parse(code)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return (
        None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    )


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
    shown = [run("".join(cell["source"]), names) for cell in cells if cell["cell_type"] == "code"]
    assert len(shown) >= 2
    globals()[notebook.stem](names, shown)
    assert not any(cell.get("outputs") for cell in cells), (
        "notebooks are kept without their outputs"
    )
