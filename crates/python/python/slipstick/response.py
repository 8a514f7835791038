"""Objectives and constraints of an optimization, other than those of its case."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import index
from typing import Any

from .quantity import Definition, Quantity, definition, name_of

__all__ = ["Bound", "Term"]


@dataclass(frozen=True)
class Term:
    """A term of an objective: a weighted sum of a quantity over load steps.

    Attributes
    ----------
    quantity : str
        Name of a quantity of the case, or of one that was added to the problem.
    weight : float
        Its factor; the sum of all terms is minimized, so a negative weight maximizes the quantity.
    steps : str or sequence of int
        The load steps that count in every load case: ``"last"``, ``"all"``, or their numbers, from
        1.
    """

    quantity: str
    weight: float = 1.0
    steps: str | Sequence[int] = "last"


@dataclass(frozen=True)
class Bound:
    """A bound on a quantity, at chosen load steps of each load case.

    Attributes
    ----------
    quantity : str
        Name of a quantity of the case, or of one that was added to the problem.
    min, max : float or None
        Smallest and largest allowed value; give at least one of them.
    steps : str or sequence of int
        ``"last"``, ``"all"``, or numbers of load steps, from 1.
    """

    quantity: str
    min: float | None = None
    max: float | None = None
    steps: str | Sequence[int] = "last"


Own = tuple[
    list[Definition],
    list[tuple[str, "list[int] | None", float]],
    list[tuple[str, "list[int] | None", "float | None", "float | None"]],
    str,
]


def own(
    objective: str | Term | Sequence[Term] | None,
    constraints: Sequence[Bound],
    quantities: Sequence[Quantity],
) -> Own | None:
    """The responses as the extension takes them; None if they are those of the case."""
    if objective is None and not constraints:
        return None
    if isinstance(objective, str):
        objective = Term(objective)
    terms = [] if objective is None else [objective] if isinstance(objective, Term) else objective
    if objective is not None and not terms:
        raise ValueError("objective is empty: give a term, or None for the objective of the case")
    for number, term in enumerate(terms):
        if not isinstance(term, Term):
            raise TypeError(
                f"objective[{number}] is of type {type(term).__name__}: "
                "give the name of a quantity, a slipstick.Term, or a list of these terms"
            )
        _finite(term.weight, f"objective[{number}].weight")
    for number, bound in enumerate(constraints):
        if not isinstance(bound, Bound):
            raise TypeError(
                f"constraints[{number}] is of type {type(bound).__name__}: give a slipstick.Bound"
            )
        if bound.min is None and bound.max is None:
            raise ValueError(f"constraints[{number}] has no bound: give min or max")
        for name, value in (("min", bound.min), ("max", bound.max)):
            if value is not None:
                _finite(value, f"constraints[{number}].{name}")
    used = {term.quantity for term in terms} | {bound.quantity for bound in constraints}
    record: dict[str, Any] = {
        "objective": [
            [term.quantity, _steps(term.steps, f"objective[{number}]"), float(term.weight)]
            for number, term in enumerate(terms)
        ],
        "constraints": [
            [
                bound.quantity,
                _steps(bound.steps, f"constraints[{number}]"),
                None if bound.min is None else float(bound.min),
                None if bound.max is None else float(bound.max),
            ]
            for number, bound in enumerate(constraints)
        ],
        "quantities": sorted(used & {name_of(quantity) for quantity in quantities}),
    }
    return recorded(json.dumps(record), quantities)


def recorded(text: str, quantities: Sequence[Quantity]) -> Own:
    """The responses of a record that a run keeps, with the quantities that it names."""
    record = json.loads(text)
    known = {name_of(quantity): quantity for quantity in quantities}
    missing = [name for name in record["quantities"] if name not in known]
    if missing:
        raise ValueError(
            "quantities lacks " + ", ".join(missing) + ": the optimization was started with "
            "quantities of these names, so give them again"
        )
    return (
        [definition(known[name]) for name in record["quantities"]],
        [(name, steps, weight) for name, steps, weight in record["objective"]],
        [(name, steps, least, most) for name, steps, least, most in record["constraints"]],
        text,
    )


def _steps(steps: str | Sequence[int], place: str) -> list[int] | None:
    """None for the last step, an empty list for all."""
    if isinstance(steps, str):
        if steps not in ("last", "all"):
            raise ValueError(
                f"{place}.steps is {steps!r}: give 'last', 'all', or numbers of load steps"
            )
        return None if steps == "last" else []
    try:
        numbers = sorted({index(step) for step in steps})
    except TypeError:
        numbers = []
    if not numbers or numbers[0] < 1:
        raise ValueError(f"{place}.steps is {steps!r}: give numbers of load steps, from 1")
    return numbers


def _finite(value: float, place: str) -> None:
    if not math.isfinite(float(value)):
        raise ValueError(f"{place} is {value}: give a finite number")
