"""Cases for the tests: small, without symmetry, with sticking and slipping nodes."""

from __future__ import annotations

import importlib.metadata
import signal

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray

# a shell's background job ignores Ctrl-C, and Python then does not raise it
signal.signal(signal.SIGINT, signal.default_int_handler)

# for tests of what a wheel installs besides the package
needs_wheel = pytest.mark.skipif(
    "slipstick" not in importlib.metadata.packages_distributions(),
    reason="the package is not installed from a wheel",
)

MATERIAL = {"neo_hooke": {"youngs_modulus": 1000.0, "poisson_ratio": 0.3}}

DRAGGED = {
    "title": "A block is pressed onto a slab and dragged along it",
    "body": [
        {
            "name": "slab",
            "box": {"min": [0.0, 0.0, 0.0], "max": [4.0, 1.0, 1.3], "elements": [4, 1, 2]},
            "material": MATERIAL,
        },
        {
            "name": "block",
            "box": {"min": [0.6, 1.0, 0.2], "max": [1.7, 1.8, 1.0], "elements": [2, 1, 1]},
            "material": MATERIAL,
        },
    ],
    "contact": [
        {
            "slave": "block_ymin",
            "master": "slab_ymax",
            "friction": 0.3,
            "enforcement": {"lagrange": {}},
        }
    ],
    "dirichlet": [
        {"set": "slab_ymin"},
        {
            "set": "block_ymax",
            "motion": [{"t": 0.5, "u": [0.0, -0.08, 0.0]}, {"t": 1.0, "u": [0.15, -0.08, 0.04]}],
        },
    ],
    "load_path": {"steps": 4, "tolerance": {"relative": 1e-11}},
    "design": {"bodies": ["slab"], "volume_fraction": 0.5, "simp": {"p": 3.0, "min": 0.01}},
    "objective": {"contact_force": {"steps": "all"}},
    "optimizer": {"iterations": 3},
    "quantity": [
        {"name": "grip", "contact_force": {"slave": "block_ymin", "component": "normal"}},
        {"name": "drag", "reaction": {"set": "block_ymax", "component": "x"}},
        {"name": "work", "friction_work": {"slave": "block_ymin"}},
        {"name": "energy", "strain_energy": {"body": "slab"}},
    ],
}


@pytest.fixture
def case() -> ss.Case:
    return ss.Case.from_dict(DRAGGED, name="dragged.toml")


@pytest.fixture
def problem(case: ss.Case) -> ss.Problem:
    return case.build()


@pytest.fixture
def density(problem: ss.Problem) -> NDArray[np.float64]:
    """Different in every element, so that no error hides behind symmetry."""
    density = problem.initial_density
    random = np.random.default_rng(1)
    density[problem.designed] = random.uniform(0.4, 0.9, len(problem.designed))
    return density


@pytest.fixture
def direction(problem: ss.Problem) -> NDArray[np.float64]:
    """A direction in the space of the design."""
    direction = np.zeros(problem.mesh.elements)
    direction[problem.designed] = np.random.default_rng(2).uniform(-1.0, 1.0, len(problem.designed))
    return direction


@pytest.fixture
def long_case() -> ss.Case:
    """A case that computes for many seconds."""
    return ss.Case.template("half-ball").replace({"load_path.steps": 400})
