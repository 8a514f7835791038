"""The examples with optimizers of other packages find better designs."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"


@pytest.fixture
def example(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module of an example, if the packages that it needs are installed."""
    name, *needs = request.param
    for package in needs:
        pytest.importorskip(package, reason=f"{package} is not installed: {name} is not run")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    yield importlib.import_module(name)
    for module in EXAMPLES.glob("*.py"):
        sys.modules.pop(module.stem, None)


@pytest.mark.parametrize("example", [("scipy_slsqp", "scipy")], indirect=True)
def test_scipy(example: Any) -> None:
    found = example.main()
    assert found["grip"] == pytest.approx(found["bound"], rel=1e-3)
    assert found["volume"] < 0.4, "the slab at the start has 0.9"


@pytest.mark.parametrize("example", [("nlopt_mma", "scipy", "nlopt")], indirect=True)
def test_nlopt(example: Any) -> None:
    found = example.main()
    # the optimizer of slipstick, with as many evaluations
    own = example.CASE.build().optimize(iterations=len(found["history"]) - 1)
    assert found["objective"] < 1.2 * found["history"][0] < 0.0
    assert found["objective"] == pytest.approx(own.objective, rel=0.05)
    assert found["volume"] <= 0.7 + 1e-6


@pytest.mark.parametrize("example", [("torch_density", "scipy", "torch")], indirect=True)
def test_torch(example: Any) -> None:
    found = example.main()
    assert found["history"][-1] < 1.4 * found["history"][0] < 0.0
    assert found["volume"] == pytest.approx(0.7, abs=1e-9)
