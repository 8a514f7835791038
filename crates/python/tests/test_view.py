"""Interactive views in notebooks."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import slipstick as ss


def data(page: str) -> dict[str, Any]:
    """The input of the page's script."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S)
    assert found, "a page without data"
    values: dict[str, Any] = json.loads(found[1])
    return values


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    import base64

    codes = np.frombuffer(base64.b64decode(packed["data"]), "u1" if packed["bits"] == 8 else "<u2")
    return packed["low"] + packed["step"] * codes


def test_a_path_is_shown_with_its_displacements(problem: ss.Problem) -> None:
    """The page has the numbers of the path, to the accuracy of its 16 bits."""
    path = problem.solve()
    view = path.view()
    shown = data(view.html)
    # the first is the start
    assert [step["number"] for step in shown["steps"]] == [0, 1, 2, 3, 4] and shown["view_only"]
    for step, found in zip(path.steps, shown["steps"][1:], strict=True):
        packed = found["displacement"]
        expected = step.displacement.ravel()
        assert np.allclose(unpacked(packed), expected, rtol=0, atol=0.51 * packed["step"])
        assert found["time"] == step.time
    # a page for another design, whose state the problem then has, is still that of the path
    problem.solve(np.full(problem.mesh.elements, 0.7))
    assert data(path.view().html)["steps"] == shown["steps"]


def test_a_result_is_shown_with_its_designs(problem: ss.Problem, tmp_path: Path) -> None:
    result = problem.optimize(iterations=1, directory=tmp_path / "run")
    view = result.view(height=300)
    shown = data(view.html)
    assert [design["number"] for design in shown["designs"]] == [0, 1] and shown["steps"]
    designed = unpacked(shown["designs"][1]["density"])
    assert np.allclose(designed, result.density, rtol=0, atol=0.5001 / 255)
    # tables and the case are those of the report
    assert shown["history"] is None and shown["case_text"] == ""


def test_a_notebook_shows_a_document_of_its_own(problem: ss.Problem, tmp_path: Path) -> None:
    view = problem.solve().view(height=300)
    cell = view._repr_html_()
    frame = re.fullmatch(r'<iframe ([^>]*) srcdoc="([^"]*)"></iframe>', cell)
    assert frame and 'height="300"' in frame[1] and 'sandbox="allow-scripts"' in frame[1]
    assert html.unescape(frame[2]) == view.html
    # nothing is fetched: the page names no other file
    assert "default-src 'none'" in view.html
    assert view.save(tmp_path / "view.html").read_text(encoding="utf-8") == view.html
    with pytest.raises(FileExistsError, match="overwrite=True"):
        view.save(tmp_path / "view.html")
    with pytest.raises(ValueError, match=r"ends in \.html"):
        view.save(tmp_path / "view.png")
    with pytest.raises(ValueError, match="200 or more"):
        problem.solve().view(height=20)
