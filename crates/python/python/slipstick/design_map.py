"""Design maps: from custom variables to densities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from .errors import InputError
from .evaluation import Evaluations
from .gradient import Parameter, PullBack
from .path import Path

if TYPE_CHECKING:
    from .problem import Problem

__all__ = ["DesignMap", "MappedProblem"]


class DesignMap:
    """A map from variables to densities: derive a class and define `apply` and `pull_back`.

    :meth:`slipstick.Problem.with_map` checks that the two are consistent.

    Examples
    --------
    >>> import numpy as np
    >>> import slipstick as ss
    >>> class Halves(ss.DesignMap):
    ...     "One variable for all designed elements with small x, one for the others."
    ...     def __init__(self, problem):
    ...         nodes, corners = problem.mesh.nodes, problem.mesh.hexahedra
    ...         x = nodes[corners].mean(axis=1)[problem.designed, 0]
    ...         self.side = (x > np.median(x)).astype(int)
    ...         self.designed, self.elements = problem.designed, problem.mesh.elements
    ...     def apply(self, x):
    ...         density = np.ones(self.elements)
    ...         density[self.designed] = x[self.side]
    ...         return density
    ...     def pull_back(self, x, gradient):
    ...         return np.bincount(self.side, gradient[self.designed], minlength=2)
    >>> problem = ss.Case.template("cube-on-cuboid").build()
    >>> mapped = problem.with_map(Halves(problem), [0.5, 0.8])
    >>> value, gradient = mapped.value_and_gradient([0.5, 0.8])
    >>> gradient.shape
    (2,)
    """

    def apply(self, x: NDArray[np.float64]) -> ArrayLike:
        """The densities at given variables.

        Parameters
        ----------
        x : ndarray, shape (variables,)
            The variables.

        Returns
        -------
        array, shape (elements,)
            Densities of all elements of the mesh, in [0, 1].
        """
        raise NotImplementedError(f"{type(self).__name__} has no method `apply`")

    def pull_back(self, x: NDArray[np.float64], gradient: NDArray[np.float64]) -> ArrayLike:
        """The transposed derivative of `apply` times a vector.

        Parameters
        ----------
        x : ndarray, shape (variables,)
            The variables.
        gradient : ndarray, shape (elements,)
            Derivatives with respect to the densities.

        Returns
        -------
        array, shape (variables,)
            The derivatives with respect to the variables.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method `pull_back`")


class MappedPullBack:
    """The transposed derivative of quantities at all load steps, to the variables of a map."""

    def __init__(self, mapped: MappedProblem, x: NDArray[np.float64], inner: PullBack) -> None:
        self._mapped = mapped
        self._x = x
        self._inner = inner

    def __call__(self, weights: Mapping[str, ArrayLike] | ArrayLike) -> NDArray[np.float64]:
        """The gradient of the weighted sum of all values, shape (variables,)."""
        return self._mapped._pull_back(self._x, self._inner(weights))

    def with_parameters(
        self, weights: Mapping[str, ArrayLike] | ArrayLike
    ) -> tuple[NDArray[np.float64], dict[Parameter, float]]:
        """The same, and the derivatives with respect to friction, moduli and amplitudes."""
        gradient, parameters = self._inner.with_parameters(weights)
        return self._mapped._pull_back(self._x, gradient), parameters


class MappedProblem:
    """A problem as a function of the variables of a map; made by :meth:`Problem.with_map`.

    It has the methods `solve`, `evaluate`, `value_and_gradient`, `vjp`, `volume_fraction` and
    `with_parameters` of a :class:`Problem`, and its attributes `quantities`, `steps` and
    `parameters`; densities are replaced by variables. ``slipstick.jax`` and ``slipstick.torch``
    accept it, too.

    Attributes
    ----------
    problem : Problem
        The problem, as a function of densities.
    map : DesignMap
        The map.
    start : ndarray, shape (variables,)
        The variables at which the map was checked.
    """

    def __init__(self, problem: Problem, map: DesignMap, start: NDArray[np.float64]) -> None:
        self.problem = problem
        self.map = map
        self.start = _arrays.frozen(start)

    def _require_objective(self) -> None:
        self.problem._require_objective()

    def _x(self, x: ArrayLike | None) -> NDArray[np.float64]:
        """The variables as an array that nobody changes."""
        if x is None:
            return self.start
        meaning = "one number for each variable of the map"
        return _arrays.frozen(_arrays.real(x, "x", self.start.shape, meaning).copy())

    def density(self, x: ArrayLike | None = None) -> NDArray[np.float64]:
        """The densities at given variables.

        Parameters
        ----------
        x : array_like, shape (variables,), optional
            The variables; by default the initial ones.

        Returns
        -------
        ndarray, shape (elements,)
        """
        found = self.map.apply(self._x(x))
        name = f"{type(self.map).__name__}.apply(x)"
        return _arrays.density(found, self.problem.mesh.elements, name)

    def _pull_back(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        found = self.map.pull_back(x, gradient)
        name = f"{type(self.map).__name__}.pull_back(x, gradient)"
        return _arrays.real(found, name, self.start.shape, "one number for each variable")

    def _check(self) -> None:
        """Compares the map with its transpose at the start."""
        x = self.start
        size_of_x = float(np.abs(x).max(initial=0.0)) or 1.0
        density = self.density(x)
        random = np.random.default_rng(0)
        weights = random.uniform(-1.0, 1.0, len(density))
        gradient = self._pull_back(x, weights)
        for _ in range(2):
            direction = size_of_x * random.uniform(-1.0, 1.0, x.shape)
            adjoint = float(gradient @ direction)
            size = float(np.abs(gradient) @ np.abs(direction))
            errors = []
            for step in (1e-4, 1e-5, 1e-6):
                ahead, behind = (
                    np.asarray(self.map.apply(x + sign * step * direction)) for sign in (1, -1)
                )
                difference = float(weights @ (ahead - behind)) / (2.0 * step)
                noise = 1e-14 * float(np.abs(weights) @ np.abs(ahead)) / step
                # a bound that belongs to the size of the numbers, whatever cancels
                scale = max(size, abs(difference), 1e-300)
                errors.append((max(abs(difference - adjoint) - noise, 0.0) / scale, difference))
            best, difference = min(errors)
            if best > 1e-5:
                name = type(self.map).__name__
                raise InputError._because(
                    f"{name}.pull_back gives {adjoint:.6e} along a direction in which differences "
                    f"of {name}.apply give {difference:.6e}",
                    "return the transposed derivative of `apply` at x times the gradient",
                )

    @property
    def quantities(self) -> list[str]:
        """Names of the quantities available to :meth:`vjp`."""
        return self.problem.quantities

    @property
    def steps(self) -> int:
        """Number of load steps, through all load cases."""
        return self.problem.steps

    @property
    def parameters(self) -> dict[Parameter, float]:
        """The parameters other than the variables, with their values."""
        return self.problem.parameters

    def with_parameters(self, values: Mapping[Parameter | str, float]) -> MappedProblem:
        """The same problem with other parameter values; see :meth:`Problem.with_parameters`.

        Parameters
        ----------
        values : mapping of Parameter or str to float
            The values.

        Returns
        -------
        MappedProblem
        """
        return MappedProblem(self.problem.with_parameters(values), self.map, self.start)

    def volume_fraction(self, x: ArrayLike | None = None) -> float | None:
        """Fraction of the volume of the design domain that is filled; ``None`` without a design.

        Parameters
        ----------
        x : array_like, shape (variables,), optional
            The variables; by default the initial ones.

        Returns
        -------
        float or None
        """
        return self.problem.volume_fraction(self.density(x))

    def solve(self, x: ArrayLike | None = None, *, progress: bool = False) -> Path:
        """Solve the load path; see :meth:`Problem.solve`.

        Parameters
        ----------
        x : array_like, shape (variables,), optional
            The variables; by default the initial ones.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        Path
        """
        return self.problem.solve(self.density(x), progress=progress)

    def evaluate(
        self,
        x: ArrayLike | None = None,
        *,
        friction: float | Sequence[float] | None = None,
        progress: bool = False,
    ) -> Evaluations:
        """Analyse a design with other coefficients of friction; see :meth:`Problem.evaluate`.

        Parameters
        ----------
        x : array_like, shape (variables,), optional
            The variables; by default the initial ones.
        friction : float or sequence of float, optional
            Coefficients of friction.
        progress : bool
            Whether to show a progress bar for each analysis.

        Returns
        -------
        Evaluations
        """
        return self.problem.evaluate(self.density(x), friction=friction, progress=progress)

    @overload
    def value_and_gradient(
        self, x: ArrayLike | None = ..., *, parameters: Literal[False] = ..., progress: bool = ...
    ) -> tuple[float, NDArray[np.float64]]: ...

    @overload
    def value_and_gradient(
        self, x: ArrayLike | None = ..., *, parameters: Literal[True], progress: bool = ...
    ) -> tuple[float, NDArray[np.float64], dict[Parameter, float]]: ...

    def value_and_gradient(
        self, x: ArrayLike | None = None, *, parameters: bool = False, progress: bool = False
    ) -> (
        tuple[float, NDArray[np.float64]]
        | tuple[float, NDArray[np.float64], dict[Parameter, float]]
    ):
        """The case's objective and its derivatives; see :meth:`Problem.value_and_gradient`.

        Parameters
        ----------
        x : array_like, shape (variables,), optional
            The variables; by default the initial ones.
        parameters : bool
            Whether to differentiate also with respect to friction, moduli and amplitudes.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        value : float
            The objective.
        gradient : ndarray, shape (variables,)
            Its derivatives with respect to the variables.
        parameters : dict of Parameter to float
            Only if requested.
        """
        at = self._x(x)
        value, gradient, found = self.problem._differentiated(
            self.density(at), parameters, progress
        )
        mapped = value, self._pull_back(at, gradient)
        return (*mapped, found) if parameters else mapped

    def vjp(
        self,
        x: ArrayLike | None = None,
        names: str | Sequence[str] | None = None,
        *,
        progress: bool = False,
    ) -> tuple[dict[str, NDArray[np.float64]], MappedPullBack]:
        """Quantities at every load step, and a function that maps weights to a gradient.

        Parameters
        ----------
        x : array_like, shape (variables,), optional
            The variables; by default the initial ones.
        names : str or sequence of str, optional
            Quantities; by default all of them.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        values : dict of str to ndarray, shape (steps,)
            The quantities at the ends of the load steps.
        pullback : callable
            ``pullback(weights)`` returns a gradient with respect to the variables; see
            :class:`PullBack`.
        """
        at = self._x(x)
        values, pullback = self.problem.vjp(self.density(at), names, progress=progress)
        return values, MappedPullBack(self, at, pullback)

    def __repr__(self) -> str:
        return f"<{self.problem!r} as a function of {len(self.start)} variables>"
