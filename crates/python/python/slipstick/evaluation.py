"""A design under several coefficients of friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, overload

from .errors import AnalysisError
from .path import Path

if TYPE_CHECKING:
    import pandas

__all__ = ["Evaluation", "Evaluations"]


@dataclass(frozen=True)
class Evaluation:
    """A design under one coefficient of friction.

    Attributes
    ----------
    friction : float or None
        The coefficient of all contact pairs; ``None`` for those of the case.
    path : Path or None
        The load path; ``None`` if it could not be completed.
    error : AnalysisError or None
        Why there is no path.
    volume_fraction : float or None
        Filled fraction of the design domain; ``None`` without a design.
    """

    friction: float | None
    path: Path | None
    error: AnalysisError | None
    volume_fraction: float | None

    @property
    def objective(self) -> float | None:
        """The objective; ``None`` without one, or without a path."""
        return None if self.path is None else self.path.objective


@dataclass(frozen=True, repr=False)
class Evaluations(Sequence[Evaluation]):
    """The evaluations of a design, in the order in which they were requested."""

    _all: tuple[Evaluation, ...] = field(repr=False)

    @overload
    def __getitem__(self, index: int) -> Evaluation: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Evaluation]: ...

    def __getitem__(self, index: int | slice) -> Evaluation | Sequence[Evaluation]:
        return self._all[index]

    def __len__(self) -> int:
        return len(self._all)

    def __repr__(self) -> str:
        return f"<Evaluations with {', '.join(in_words(one.friction) for one in self)}>"

    def to_dataframe(self) -> pandas.DataFrame:
        """A row for each evaluation, with the columns of ``slipstick evaluate`` (needs pandas).

        Evaluations without a path have missing values.
        """
        import pandas

        return pandas.DataFrame([_row(one) for one in self])


def in_words(friction: float | None) -> str:
    """A coefficient in messages."""
    return "the friction of the case" if friction is None else f"friction {friction}"


def _row(one: Evaluation) -> dict[str, object]:
    row: dict[str, object] = {"friction": one.friction, "objective": one.objective}
    row["volume_fraction"] = one.volume_fraction
    if one.objective is not None and one.volume_fraction:
        row["objective_over_volume_fraction"] = one.objective / one.volume_fraction
    if one.path is not None:
        steps = one.path.steps
        row["newton_iterations"] = sum(step.newton_iterations for step in steps)
        row["increments"] = sum(step.increments for step in steps)
        status = steps[-1].contact.status
        for number, name in enumerate(("open", "stick", "slip")):
            row[name] = int((status == number).sum())
    return row
