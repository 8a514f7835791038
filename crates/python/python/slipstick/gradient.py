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
        ``"friction"``, ``"youngs_modulus"``, ``"thermal_expansion"`` or ``"amplitude"`` (a factor
        on a motion, a load, the force of a bolt or a change of temperature).
    of : str
        Its place in the case or, for constants of a material, the name of the body.
    """

    kind: str
    of: str

    @property
    def name(self) -> str:
        """Its name as a string.

        Examples are ``"contact[0].friction"``, ``"plate.youngs_modulus"``,
        ``"plate.thermal_expansion"``, ``"dirichlet[1].motion"``, ``"bolt[0].force"``,
        ``"load[0]"`` and ``"temperature[0]"``.
        """
        of_body = self.kind in ("youngs_modulus", "thermal_expansion")
        return f"{self.of}.{self.kind}" if of_body else self.of


class Values(dict[Parameter, float]):
    """The parameters of a problem with their values."""

    def find(self, key: Parameter | str, argument: str) -> Parameter:
        """The parameter of this name; `argument` is for messages."""
        for parameter in self:
            if key == parameter or key == parameter.name:
                return parameter
        names = ", ".join(parameter.name for parameter in self)
        raise ValueError(f"{argument} has {key!r}, which is no parameter: give any of {names}")

    def checked(self, values: Mapping[Any, Any], argument: str) -> dict[Parameter, float]:
        """Other values of some parameters."""
        if not isinstance(values, Mapping):
            raise TypeError(
                f"{argument} is of type {type(values).__name__}: "
                "give a dict such as {'contact[0].friction': 0.2}"
            )
        found = {}
        for key, value in values.items():
            parameter = self.find(key, argument)
            place = f"{argument}[{parameter.name!r}]"
            number = float(_arrays.real(value, place, (), "one number"))
            if parameter.kind == "friction" and number < 0.0:
                raise ValueError(f"{place} is {number}: a coefficient of friction is 0 or more")
            if parameter.kind == "youngs_modulus" and number <= 0.0:
                raise ValueError(f"{place} is {number}: a modulus is greater than 0")
            if parameter.kind == "thermal_expansion" and number == 0.0:
                raise ValueError(
                    f"{place} is 0: a coefficient of thermal expansion is a number other than 0"
                )
            if parameter.kind == "amplitude" and number == 0.0:
                raise ValueError(
                    f"{place} is 0: an amplitude is a factor other than 0; "
                    "remove the motion or the load from the case"
                )
            if parameter.of.startswith("bolt[") and number < 0.0:
                raise ValueError(f"{place} is {number}: a bolt pulls its parts together")
            found[parameter] = number
        _once([self.find(key, argument).name for key in values], argument)
        return found

    def derivatives(self, entries: list[tuple[str, str, float]]) -> dict[Parameter, float]:
        """Derivatives with respect to the values; those of the extension belong to factors of 1."""
        found = {Parameter(kind, of): derivative for kind, of, derivative in entries}
        return {
            parameter: derivative / self[parameter] if parameter.kind == "amplitude" else derivative
            for parameter, derivative in found.items()
        }


def chosen(names: str | Sequence[str] | None, known: Sequence[str]) -> list[str]:
    """The quantities of these names; without any, all that are known."""
    if names is None:
        return list(known)
    wanted = [names] if isinstance(names, str) else list(names)
    _once(wanted, "names")
    return wanted


def _once(names: Sequence[str], argument: str) -> None:
    for position, name in enumerate(names):
        if name in names[:position]:
            raise ValueError(f"{argument} has {name!r} twice: give it once")


def vector(
    derivatives: Mapping[Parameter, float], wanted: Sequence[Parameter]
) -> NDArray[np.float64]:
    """The derivatives with respect to these parameters."""
    for parameter in wanted:
        if parameter not in derivatives:
            raise ValueError(
                f"parameters[{parameter.name!r}] is 0, where the values have a kink: "
                "differentiate at a coefficient of friction above 0"
            )
    return np.array([derivatives[parameter] for parameter in wanted])


class Variants:
    """A problem at changing values of its parameters; the latest ones are kept."""

    def __init__(self, problem: Any) -> None:
        self._problem = problem
        self._values = Values(problem.parameters)
        self._latest: tuple[tuple[Parameter, ...], tuple[float, ...], Any] | None = None

    def find(self, names: Sequence[Any]) -> tuple[Parameter, ...]:
        """The parameters of these names."""
        found = tuple(self._values.find(name, "parameters") for name in names)
        _once([parameter.name for parameter in found], "parameters")
        return found

    def at(self, wanted: tuple[Parameter, ...], values: NDArray[np.float64]) -> Any:
        """The problem with these values."""
        if not wanted:
            return self._problem
        key = tuple(float(value) for value in values)
        # other threads may replace it meanwhile
        latest = self._latest
        if latest is None or latest[:2] != (wanted, key):
            checked = self._values.checked(dict(zip(wanted, key, strict=True)), "parameters")
            self._latest = latest = (wanted, key, self._problem.with_parameters(checked))
        return latest[2]


class PullBack:
    """The transposed derivative of quantities at all load steps: maps weights to a gradient.

    It holds the load path and factorizations in memory as long as it exists. Each call costs one
    adjoint solve, whatever the number of quantities and steps.

    Attributes
    ----------
    names : tuple of str
        The quantities.
    steps : int
        Number of load steps.
    """

    def __init__(
        self, linearization: _slipstick.Linearization, names: Sequence[str], values: Values
    ) -> None:
        self._linearization = linearization
        self._parameters = values
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
            A weight for each load step of each quantity; quantities missing from a mapping have the
            weight 0.

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
        """The same gradient, and the derivatives with respect to the parameters.

        Parameters
        ----------
        weights : mapping of str to array, or array of shape (quantities, steps)
            As for a call.

        Returns
        -------
        gradient : ndarray, shape (elements,)
        parameters : dict of Parameter to float
            Coefficients of friction that are 0 are omitted, because the values have a kink there.
        """
        gradient, parameters = self._linearization.pull_back(self._weights(weights), True)
        return gradient, self._parameters.derivatives(parameters)


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
        The largest error at which a direction counts as correct.
    quotients : list of Quotient
        All difference quotients, direction by direction.
    data : dict
        The comparison, as the program writes it to ``verify.json``.
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
        """Whether at least one direction is conclusive and none shows an error."""
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
