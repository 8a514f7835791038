"""Topology optimization of bodies in finite-deformation frictional contact.

A :class:`Case` describes the problem. Its `build` makes a :class:`Problem`, which solves load
paths, differentiates any quantity with respect to the densities of the elements, and optimizes
them. Names are those of the case file, load steps are counted from 1, and any consistent system of
units may be used.

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
from typing import TYPE_CHECKING, Any

from .errors import (
    AnalysisError,
    CaseError,
    CaseWarning,
    Diagnostic,
    InputError,
    InternalError,
    SlipstickError,
    SlipstickWarning,
    StudyError,
)

if TYPE_CHECKING:
    from . import errors, gradient, mesh, path
    from . import jax as jax
    from . import torch as torch
    from ._slipstick import VERSION as __version__
    from ._slipstick import set_threads, threads
    from .case import Case, Inspection, templates
    from .design_map import DesignMap, MappedProblem
    from .evaluation import Evaluation, Evaluations
    from .gradient import GradientCheck, Parameter, PullBack
    from .mesh import Body, Mesh
    from .path import Contact, Path, Step
    from .problem import Problem
    from .quantity import ContactState, PreviousState, Quantity, State
    from .response import Bound, Term
    from .result import Iteration, Result, open_run, resume
    from .study import Study, StudyRun, run_study
    from .view import View

# Where the other names are defined. They are imported when they are first used, so that the program
# starts without numpy.
_HOMES = {
    "_slipstick": ("set_threads", "threads"),
    "case": ("Case", "Inspection", "templates"),
    "design_map": ("DesignMap", "MappedProblem"),
    "evaluation": ("Evaluation", "Evaluations"),
    "gradient": ("GradientCheck", "Parameter", "PullBack"),
    "mesh": ("Body", "Mesh"),
    "path": ("Contact", "Path", "Step"),
    "problem": ("Problem",),
    "quantity": ("ContactState", "PreviousState", "Quantity", "State"),
    "response": ("Bound", "Term"),
    "result": ("Iteration", "Result", "open_run", "resume"),
    "study": ("Study", "StudyRun", "run_study"),
    "view": ("View",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
# jax and torch are not in __all__: `from slipstick import *` must not need them
_MODULES = ("errors", "gradient", "jax", "mesh", "path", "torch")

__all__ = [
    "AnalysisError",
    "Body",
    "Bound",
    "Case",
    "CaseError",
    "CaseWarning",
    "Contact",
    "ContactState",
    "DesignMap",
    "Diagnostic",
    "Evaluation",
    "Evaluations",
    "GradientCheck",
    "InputError",
    "Inspection",
    "InternalError",
    "Iteration",
    "MappedProblem",
    "Mesh",
    "Parameter",
    "Path",
    "PreviousState",
    "Problem",
    "PullBack",
    "Quantity",
    "Result",
    "SlipstickError",
    "SlipstickWarning",
    "State",
    "Step",
    "Study",
    "StudyError",
    "StudyRun",
    "Term",
    "View",
    "__version__",
    "errors",
    "gradient",
    "mesh",
    "open_run",
    "path",
    "resume",
    "run_study",
    "set_threads",
    "templates",
    "threads",
]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    if name == "__version__":
        value = importlib.import_module("._slipstick", __name__).VERSION
    elif name in _HOME_OF:
        value = getattr(importlib.import_module(f".{_HOME_OF[name]}", __name__), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *_MODULES, *globals()})
