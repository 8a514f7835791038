"""Gradients and their check against finite differences."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _slipstick

if TYPE_CHECKING:
    import pandas

__all__ = ["GradientCheck", "Parameter", "PullBack", "Quotient"]


@dataclass(frozen=True)
class Parameter:
    """A parameter of the model other than the densities.

    Attributes
    ----------
    kind : str
        ``"friction"``, ``"youngs_modulus"`` or ``"amplitude"`` (a factor on a motion or a load).
    of : str
        Its place in the case, or for a modulus, the name of the body.
    """

    kind: str
    of: str


def _derivatives(entries: list[tuple[str, str, float]]) -> dict[Parameter, float]:
    return {Parameter(kind, of): derivative for kind, of, derivative in entries}


class PullBack:
    """The transposed derivative of quantities at all load steps: from weights to a gradient.

    It keeps the load path, and the factors that speed up the sweep, as long as it lives. Each call
    sweeps once along the path, whatever the number of quantities and steps.

    Attributes
    ----------
    names : tuple of str
        The quantities.
    steps : int
        Number of load steps.
    """

    def __init__(
        self, linearization: _slipstick.Linearization, names: Sequence[str], elements: int
    ) -> None:
        self._linearization = linearization
        self._elements = elements
        self.names = tuple(names)
        self.steps: int = linearization.values().shape[1]

    def _weights(self, weights: Mapping[str, ArrayLike] | ArrayLike) -> NDArray[np.float64]:
        shape = (len(self.names), self.steps)
        if not isinstance(weights, Mapping):
            return _arrays.real(
                weights, "weights", shape, "a row for each quantity, a column for each load step"
            )
        unknown = [name for name in weights if name not in self.names]
        if unknown:
            known = ", ".join(self.names)
            raise ValueError(
                f"weights has `{unknown[0]}`, which was not differentiated: give weights of {known}"
            )
        rows = np.zeros(shape)
        for row, name in enumerate(self.names):
            if name in weights:
                place = f"weights[{name!r}]"
                rows[row] = _arrays.real(
                    weights[name], place, (self.steps,), "one for each load step"
                )
        return rows

    def __call__(self, weights: Mapping[str, ArrayLike] | ArrayLike) -> NDArray[np.float64]:
        """The gradient of the weighted sum of all values.

        Parameters
        ----------
        weights : mapping of str to array, or array of shape (quantities, steps)
            A weight for each load step of each quantity; quantities that a mapping leaves out have
            the weight 0.

        Returns
        -------
        ndarray, shape (elements,)
            Derivatives of Σ weight · value with respect to the densities.
        """
        gradient, _ = self._linearization.pull_back(self._weights(weights), False)
        return gradient

    def with_parameters(
        self, weights: Mapping[str, ArrayLike] | ArrayLike
    ) -> tuple[NDArray[np.float64], dict[Parameter, float]]:
        """The same, and the derivatives with respect to friction, moduli and amplitudes.

        Parameters
        ----------
        weights : mapping of str to array, or array of shape (quantities, steps)
            As for a call.

        Returns
        -------
        gradient : ndarray, shape (elements,)
        parameters : dict of Parameter to float
            Coefficients of friction that are 0 are left out, because the values have a kink there.
        """
        gradient, parameters = self._linearization.pull_back(self._weights(weights), True)
        return gradient, _derivatives(parameters)


@dataclass(frozen=True)
class Quotient:
    """A difference quotient along a direction.

    Attributes
    ----------
    direction : str
        The varied elements.
    verdict : str
        The conclusion about the direction: ``"right"``, ``"off"``, or why it is inconclusive.
    adjoint : float
        Derivative along the direction, from the gradient.
    step : float
        Step in density.
    difference : float
        The difference quotient.
    relative_error : float
        Their difference, relative to the size of the gradient along the direction.
    round_off : float
        The part of it that round-off explains.
    order : float
        Observed order of the error under halving of the step, 2 where the objective is smooth; nan
        where unknown.
    kinked, cut_back : bool
        Whether a node changes its status within the step, or the path is cut back differently;
        such a quotient says nothing.
    """

    direction: str
    verdict: str
    adjoint: float
    step: float
    difference: float
    relative_error: float
    round_off: float
    order: float
    kinked: bool
    cut_back: bool


@dataclass(frozen=True)
class GradientCheck:
    """A gradient compared with finite differences, as by ``slipstick verify gradient``.

    Attributes
    ----------
    value : float
        The differentiated value.
    gradient_norm : float
        Norm of the gradient over the designed elements.
    worst : float or None
        Largest error of the conclusive directions, relative to the gradient; ``None`` if there is
        none.
    tolerance : float
        The error up to which a direction is right.
    quotients : list of Quotient
        All difference quotients, direction by direction.
    data : dict
        The comparison as the program writes it to ``verify.json``.
    """

    value: float
    gradient_norm: float
    worst: float | None
    tolerance: float
    quotients: list[Quotient]
    data: dict[str, Any] = field(repr=False)

    @classmethod
    def _of(cls, text: str, tolerance: float) -> GradientCheck:
        data = json.loads(text)
        quotients = [
            Quotient(
                direction=direction["name"],
                verdict=direction["verdict"],
                adjoint=direction["adjoint"],
                step=at["step"],
                difference=at["difference"],
                relative_error=at["relative_error"],
                round_off=at["round_off"],
                order=math.nan if at["order"] is None else at["order"],
                kinked=at["kinked"],
                cut_back=at["cut_back"],
            )
            for direction in data["directions"]
            for at in direction["quotients"]
        ]
        return cls(
            data["objective"], data["gradient_norm"], data["worst"], tolerance, quotients, data
        )

    @property
    def passed(self) -> bool:
        """Whether at least one direction is conclusive, and none shows an error."""
        verdicts = [direction["verdict"] for direction in self.data["directions"]]
        return "right" in verdicts and "off" not in verdicts

    def to_dataframe(self) -> pandas.DataFrame:
        """The quotients as a table (needs pandas)."""
        import pandas

        return pandas.DataFrame([vars(quotient) for quotient in self.quotients])

    def __str__(self) -> str:
        lines = []
        direction = None
        for at in self.quotients:
            if at.direction != direction:
                direction = at.direction
                lines.append(f"{direction}: adjoint {at.adjoint:.10e}, {at.verdict}")
                lines.append(
                    f"  {'step':>9} {'difference':>18} {'error':>8} {'round-off':>9} {'order':>6}"
                )
            order = "" if math.isnan(at.order) else f"{at.order:.2f}"
            remark = "  kink" if at.kinked else "  cut back differently" if at.cut_back else ""
            lines.append(
                f"  {at.step:9.2e} {at.difference:18.10e} {at.relative_error:8.1e}"
                f" {at.round_off:9.1e} {order:>6}{remark}"
            )
        worst = (
            "nothing could be compared" if self.worst is None else f"largest error {self.worst:.1e}"
        )
        return "\n".join([*lines, f"{worst}, tolerance {self.tolerance:.1e}"])
