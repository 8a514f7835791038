"""Topology optimization of bodies in finite-deformation frictional contact.

A :class:`Case` says what is solved. It is built into a :class:`Problem`, which solves load paths,
differentiates any quantity with respect to the densities of the elements, and optimizes them.
Names are those of the case file, load steps are counted from 1, and any consistent system of units
may be used.

Examples
--------
>>> import slipstick as ss
>>> case = ss.Case.template("cube-on-cuboid")
>>> problem = case.replace({"contact[0].friction": 0.2}).build()
>>> path = problem.solve()
>>> path.steps[-1].contact.status                 # all four slave nodes slip
array([2, 2, 2, 2], dtype=uint8)
>>> value, gradient = problem.value_and_gradient()
>>> gradient.shape
(5,)
"""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import TYPE_CHECKING

from . import errors, gradient, mesh, path
from ._slipstick import VERSION as __version__
from ._slipstick import set_threads, threads
from .case import Case, Inspection, templates
from .errors import (
    AnalysisError,
    CaseError,
    CaseWarning,
    Diagnostic,
    InputError,
    InternalError,
    SlipstickError,
    SlipstickWarning,
)
from .gradient import GradientCheck, Parameter, PullBack
from .mesh import Body, Mesh
from .path import Contact, Path, Step
from .problem import Problem
from .quantity import ContactState, Quantity, State
from .result import Iteration, Result, open_run, resume

if TYPE_CHECKING:
    from . import jax, torch

__all__ = [
    "AnalysisError",
    "Body",
    "Case",
    "CaseError",
    "CaseWarning",
    "Contact",
    "ContactState",
    "Diagnostic",
    "GradientCheck",
    "InputError",
    "Inspection",
    "InternalError",
    "Iteration",
    "Mesh",
    "Parameter",
    "Path",
    "Problem",
    "PullBack",
    "Quantity",
    "Result",
    "SlipstickError",
    "SlipstickWarning",
    "State",
    "Step",
    "__version__",
    "errors",
    "gradient",
    "jax",
    "mesh",
    "open_run",
    "path",
    "resume",
    "set_threads",
    "templates",
    "threads",
    "torch",
]


def __getattr__(name: str) -> ModuleType:
    """The optional modules, which import large packages, are imported where they are used."""
    if name in ("jax", "torch"):
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
