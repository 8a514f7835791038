"""Problems: forward analysis, gradients, optimization."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _slipstick
from ._progress import Bar, IterationBar
from .design_map import DesignMap, MappedProblem
from .errors import AnalysisError, SlipstickWarning
from .evaluation import Evaluation, Evaluations, in_words
from .gradient import GradientCheck, Parameter, PullBack, Values, chosen
from .mesh import Mesh
from .path import Path
from .quantity import Quantity, definition, name_of
from .response import Bound, Term, own
from .result import Iteration, Result, run

if TYPE_CHECKING:
    from .case import Case

__all__ = ["Problem"]


class Problem:
    """A built case: mesh, model, load path, design and objective.

    Densities are arrays over the elements of the mesh, in [0, 1]. Those outside the design have no
    effect on the states and should stay at 1; :attr:`designed` lists the elements that an
    optimization changes.

    Results are bit-identical for any number of threads, and after any earlier calls.

    Examples
    --------
    >>> import slipstick as ss
    >>> problem = ss.Case.template("cube-on-cuboid").build()
    >>> value, gradient = problem.value_and_gradient(problem.initial_density)
    >>> round(value, 6), gradient.shape
    (-8.308292, (5,))
    """

    _problem: _slipstick.Problem
    _case: Case
    _parameters: Values
    _changed: dict[Parameter, float]
    _added: dict[str, Quantity]

    def __init__(self) -> None:
        raise TypeError("use Case.build")

    @classmethod
    def _of(cls, case: Case, problem: _slipstick.Problem, values: Values | None = None) -> Problem:
        self = cls.__new__(cls)
        self._case = case
        self._problem = problem
        self._parameters = values or Values(
            {Parameter(kind, of): value for kind, of, value in problem.parameters()}
        )
        self._changed = {}
        self._added = {}
        return self

    @cached_property
    def case(self) -> Case:
        """The case that was built, with the values of :meth:`with_parameters`."""
        if not self._changed:
            return self._case
        return self._case.replace(_entries(self._case, self._changed))

    @cached_property
    def mesh(self) -> Mesh:
        """The mesh of all bodies."""
        return Mesh._of(self._problem)

    @property
    def initial_density(self) -> NDArray[np.float64]:
        """Initial densities, shape (elements,): 1 outside the design."""
        return self._problem.initial_density()

    def load_design(self, results: str | os.PathLike[str], *, variables: bool = False) -> NDArray[np.float64]:
        """The design of an earlier run, or of a table, on this mesh.

        The design of a run with another mesh is mapped by position: each element takes the mean of
        the run's elements around it, in the body of the same name. A table must match the mesh.

        Parameters
        ----------
        results : path-like
            Directory of an optimization, or a table of densities (CSV).
        variables : bool
            Whether to return the design variables, from which :meth:`optimize` starts, instead of
            the densities. If the results list none, they are the densities.

        Returns
        -------
        ndarray, shape (elements,)

        Raises
        ------
        InputError
            If the design does not fit the mesh.
        """
        density, found = self._problem.load_design(FilePath(results))
        return found if variables and found is not None else density

    @cached_property
    def designed(self) -> NDArray[np.int64]:
        """Numbers of the elements whose density is a design variable, ascending."""
        return _arrays.frozen(self._problem.designed())

    @property
    def steps(self) -> int:
        """Number of load steps, through all load cases."""
        return len(self.times)

    @cached_property
    def times(self) -> NDArray[np.float64]:
        """Ends of the load steps in pseudo-time, shape (steps,); load case k starts at 2 k."""
        return _arrays.frozen(np.asarray(self._problem.times()))

    @property
    def load_cases(self) -> list[str]:
        """Names of the load cases; empty if there is only one, without a name."""
        return self._problem.load_cases()

    @property
    def quantities(self) -> list[str]:
        """Names of the quantities available to :meth:`vjp`: those of the case, and added ones."""
        return self._problem.quantities()

    def add(self, quantity: Quantity) -> None:
        """Register a custom quantity after checking its derivative.

        Parameters
        ----------
        quantity : Quantity
            The quantity. It becomes one of :attr:`quantities`.

        Raises
        ------
        InputError
            If the derivative does not agree with differences of the value, or the name is taken.
        """
        self._problem.add(*definition(quantity))
        self._added[name_of(quantity)] = quantity

    @property
    def parameters(self) -> dict[Parameter, float]:
        """The parameters other than the densities, with their values.

        Amplitudes are factors on the case's motions, loads, forces of bolts and changes of
        temperature, initially 1.
        """
        return dict(self._parameters)

    def with_parameters(self, values: Mapping[Parameter | str, float]) -> Problem:
        """The same problem with other values of some parameters.

        Parameters
        ----------
        values : mapping of Parameter or str to float
            Keys are those of :attr:`parameters`, or their names, such as
            ``"contact[0].friction"``. Friction must be at least 0, moduli must be positive, and
            amplitudes must not be 0.

        Returns
        -------
        Problem
            A problem with the same mesh, the same added quantities, and these values, which its
            :attr:`case` contains, too.

        Raises
        ------
        ValueError
            If a key is not a parameter, or a value is out of range: friction must be at least 0,
            moduli must be positive, amplitudes must not be 0.

        Examples
        --------
        >>> import slipstick as ss
        >>> problem = ss.Case.template("cube-on-cuboid").build()
        >>> other = problem.with_parameters({"contact[0].friction": 0.05})
        >>> [round(one.value_and_gradient()[0], 3) for one in (problem, other)]
        [-8.308, -7.705]
        """
        wanted = self._parameters.checked(values, "values")
        # all that differ from the case, so that amplitudes are factors on its own motions and loads
        changed = {**self._changed, **wanted}
        new = Problem._of(
            self._case,
            self._problem.with_parameters([(p.kind, p.of, v) for p, v in changed.items()]),
            Values({**self._parameters, **wanted}),
        )
        new._added = dict(self._added)
        new._changed = changed
        return new

    def with_map(self, map: DesignMap, start: ArrayLike) -> MappedProblem:
        """The problem as a function of variables other than the densities.

        The map replaces the density filter and the projection of the case.

        Parameters
        ----------
        map : DesignMap
            Maps variables to the densities of all elements.
        start : array_like, shape (variables,)
            Variables to start from, at which the map is compared with its transpose.

        Returns
        -------
        MappedProblem

        Raises
        ------
        InputError
            If ``map.pull_back`` is not the transposed derivative of ``map.apply``.
        """
        if not isinstance(map, DesignMap):
            raise TypeError(
                f"map is of type {type(map).__name__}: derive its class from slipstick.DesignMap"
            )
        checked = _arrays.real(start, "start", (None,), "one number for each variable")
        mapped = MappedProblem(self, map, checked.copy())
        mapped._check()
        return mapped

    def volume_fraction(self, density: ArrayLike | None = None) -> float | None:
        """Fraction of the volume of the design domain that is filled.

        Parameters
        ----------
        density : array_like, shape (elements,), optional
            Densities in [0, 1]; by default the initial ones.

        Returns
        -------
        float or None
            ``None`` without a design.
        """
        return self._problem.volume_fraction(self._density(density))

    def evaluate(
        self,
        density: ArrayLike | None = None,
        *,
        friction: float | Sequence[float] | None = None,
        progress: bool = False,
    ) -> Evaluations:
        """Analyse a design with other coefficients of friction, as ``slipstick evaluate`` does.

        Parameters
        ----------
        density : array_like, shape (elements,), optional
            Densities in [0, 1]; by default the initial ones.
        friction : float or sequence of float, optional
            Coefficients of friction, each for all contact pairs in all load cases; by default those
            of the problem.
        progress : bool
            Whether to show a progress bar for each analysis.

        Returns
        -------
        Evaluations
            A sequence with an :class:`Evaluation` for each coefficient. A load path that cannot be
            completed does not stop the others: its evaluation has an ``error``.

        Warns
        -----
        SlipstickWarning
            For each path that cannot be completed.

        Examples
        --------
        >>> import slipstick as ss
        >>> problem = ss.Case.template("cube-on-cuboid").build()
        >>> for one in problem.evaluate(friction=[0.0, 0.1, 0.2]):
        ...     print(one.friction, round(one.objective, 3))
        0.0 -7.687
        0.1 -7.743
        0.2 -7.877
        """
        values = self._density(density)
        asked: list[float | None] = [None]
        if friction is not None:
            given = np.atleast_1d(np.asarray(friction))
            entries = _arrays.real(given, "friction", (given.size,), "a list of coefficients")
            if (entries < 0.0).any():
                raise ValueError(f"friction has {entries.min()}: coefficients are 0 or more")
            asked = [float(entry) for entry in entries]
        fraction = self._problem.volume_fraction(values)
        found = []
        for coefficient in asked:
            path, error = None, None
            words = in_words(coefficient)
            with Bar(progress, self.steps, words) as bar:
                try:
                    marched, notice = self._problem.solve(values, bar.report, coefficient)
                    path = Path(marched)
                except AnalysisError as failure:
                    error, notice = failure, f"with {words}: {failure}"
            _warn(notice)
            found.append(Evaluation(coefficient, path, error, fraction))
        return Evaluations(tuple(found))

    def _density(self, density: ArrayLike | None) -> NDArray[np.float64]:
        if density is None:
            return self.initial_density
        return _arrays.density(density, self._problem.element_count)

    def solve(self, density: ArrayLike | None = None, *, progress: bool = False) -> Path:
        """Solve the load path.

        Parameters
        ----------
        density : array_like, shape (elements,), optional
            Densities in [0, 1]; by default the initial ones.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        Path

        Raises
        ------
        AnalysisError
            If a load step does not converge.
        KeyboardInterrupt
            After Ctrl-C.

        Examples
        --------
        >>> import slipstick as ss
        >>> path = ss.Case.template("cube-on-cuboid").build().solve()
        >>> round(path.objective, 6)
        -8.308292
        """
        with Bar(progress, self.steps, "solve") as bar:
            path, notice = self._problem.solve(self._density(density), bar.report)
        _warn(notice)
        return Path(path)

    @overload
    def value_and_gradient(
        self,
        density: ArrayLike | None = ...,
        *,
        parameters: Literal[False] = ...,
        progress: bool = ...,
    ) -> tuple[float, NDArray[np.float64]]: ...

    @overload
    def value_and_gradient(
        self, density: ArrayLike | None = ..., *, parameters: Literal[True], progress: bool = ...
    ) -> tuple[float, NDArray[np.float64], dict[Parameter, float]]: ...

    def value_and_gradient(
        self, density: ArrayLike | None = None, *, parameters: bool = False, progress: bool = False
    ) -> (
        tuple[float, NDArray[np.float64]]
        | tuple[float, NDArray[np.float64], dict[Parameter, float]]
    ):
        """The case's objective and its derivatives.

        Parameters
        ----------
        density : array_like, shape (elements,), optional
            Densities in [0, 1]; by default the initial ones.
        parameters : bool
            Whether to differentiate also with respect to friction, moduli and amplitudes.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        value : float
            The objective θ, which an optimization minimizes.
        gradient : ndarray, shape (elements,)
            Derivatives with respect to all densities, 0 outside the design. They are exact for the
            current status of the contact nodes; the sensitivity filter is not applied.
        parameters : dict of Parameter to float
            Only if requested.

        Raises
        ------
        InputError
            If the case has no objective.
        AnalysisError
            If a load step does not converge.
        """
        value, gradient, found = self._differentiated(self._density(density), parameters, progress)
        return (value, gradient, found) if parameters else (value, gradient)

    def _differentiated(
        self, density: NDArray[np.float64], parameters: bool, progress: bool
    ) -> tuple[float, NDArray[np.float64], dict[Parameter, float]]:
        with Bar(progress, self.steps, "solve") as bar:
            value, gradient, named, notice = self._problem.value_and_gradient(
                density, parameters, bar.report
            )
        _warn(notice, 1)
        return value, gradient, self._parameters.derivatives(named)

    def _require_objective(self) -> None:
        """Raises the InputError of a case without an objective."""
        self._problem.require_objective()

    def vjp(
        self,
        density: ArrayLike | None = None,
        names: str | Sequence[str] | None = None,
        *,
        progress: bool = False,
    ) -> tuple[dict[str, NDArray[np.float64]], PullBack]:
        """Quantities at every load step, and a function that maps weights to a gradient.

        Parameters
        ----------
        density : array_like, shape (elements,), optional
            Densities in [0, 1]; by default the initial ones.
        names : str or sequence of str, optional
            Quantities of the case; by default all of them.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        values : dict of str to ndarray, shape (steps,)
            The quantities at the ends of the load steps.
        pullback : PullBack
            ``pullback(weights)`` returns the gradient of the sum of all values times their weights.

        Raises
        ------
        InputError
            If the case has no quantity with one of the names.
        AnalysisError
            If a load step does not converge.

        Examples
        --------
        >>> import numpy as np
        >>> import slipstick as ss
        >>> grip = {"name": "grip", "contact_force": {"slave": "cube_ymin", "component": "normal"}}
        >>> case = ss.Case.template("cube-on-cuboid").replace({"quantity": [grip]})
        >>> problem = case.build()
        >>> values, pullback = problem.vjp(problem.initial_density, ["grip"])
        >>> bool(np.all(np.diff(values["grip"][:5]) > 0))
        True
        >>> pullback({"grip": np.full(10, 0.1)}).shape    # of the mean over the load steps
        (5,)
        """
        wanted = chosen(names, self.quantities)
        with Bar(progress, self.steps, "solve") as bar:
            linearization = self._problem.linearize(self._density(density), wanted, bar.report)
        values = dict(zip(wanted, linearization.values(), strict=True))
        return values, PullBack(linearization, wanted, self._parameters)

    def check_gradient(
        self,
        density: ArrayLike | None = None,
        *,
        quantity: str | None = None,
        directions: int = 3,
        elements: int = 0,
        step: float = 1e-3,
        halvings: int = 4,
        tolerance: float = 1e-5,
        progress: bool = False,
    ) -> GradientCheck:
        """Compare a gradient with finite differences.

        The gradient is that with respect to the densities, also if the case filters or projects
        variables.

        Parameters
        ----------
        density : array_like, shape (elements,), optional
            Densities in [0, 1]; by default the initial ones.
        quantity : str, optional
            The quantity whose value at the last load step, summed over the load cases, is
            differentiated; by default the objective.
        directions : int
            Number of random directions over all designed elements.
        elements : int
            Number of individual elements, spread over the design.
        step : float
            Largest step in density; smaller ones are obtained by halving it.
        halvings : int
            How many times the step is halved.
        tolerance : float
            Largest relative error at which a direction counts as correct.
        progress : bool
            Whether to show a progress bar.

        Returns
        -------
        GradientCheck
            ``print`` shows it as a table.

        Examples
        --------
        >>> import slipstick as ss
        >>> check = ss.Case.template("cube-on-cuboid").build().check_gradient(directions=1)
        >>> check.passed
        True
        """
        for name, number in (
            ("directions", directions),
            ("elements", elements),
            ("halvings", halvings),
        ):
            if number < 0:
                raise ValueError(f"{name} is {number}: give 0 or more")
        if directions + elements == 0:
            raise ValueError(
                "there is nothing to compare: give at least 1 for directions or elements"
            )
        if not 0.0 < step <= 0.25:
            raise ValueError(f"step is {step}: give a step in density above 0, and at most 0.25")
        if not tolerance > 0.0:
            raise ValueError(f"tolerance is {tolerance}: give a number above 0")
        with Bar(progress, self.steps, "check") as bar:
            found = self._problem.check_gradient(
                self._density(density),
                quantity,
                directions,
                elements,
                step,
                halvings,
                tolerance,
                bar.report,
            )
        return GradientCheck._of(found, tolerance)

    def optimize(
        self,
        density: ArrayLike | None = None,
        *,
        objective: str | Term | Sequence[Term] | None = None,
        constraints: Sequence[Bound] = (),
        iterations: int | None = None,
        directory: str | os.PathLike[str] | None = None,
        overwrite: bool = False,
        callback: Callable[[Iteration], object] | None = None,
        progress: bool = False,
    ) -> Result:
        """Optimize the design, as ``slipstick optimize`` does, from the start.

        Parameters
        ----------
        density : array_like, shape (elements,), optional
            Densities to start from; by default those of the case. Passive elements keep the
            densities that the case prescribes. If the case filters or projects its variables, these
            are the initial variables.
        objective : str, Term or sequence of Term, optional
            The objective to minimize instead of that of the case: quantities of the case, or those
            added with :meth:`add`.
        constraints : sequence of Bound
            Bounds on quantities, in addition to those of the case.
        iterations : int, optional
            Number of updates; by default that of the case.
        directory : path-like, optional
            Directory for the files of the run, from which :func:`resume` continues; by default a
            temporary one, which exists as long as the result.
        overwrite : bool
            Whether to replace the files of another run in the directory.
        callback : callable, optional
            Called with an :class:`Iteration` after each evaluated design. An exception that it
            raises stops the optimization.
        progress : bool
            Whether to show iterations and the remaining time: on a terminal, in a notebook, or as a
            line per design in a file. The time is that of the recent designs for those to come, up
            to the number of updates, or to where the recent trends meet ``optimizer.stop``.

        Returns
        -------
        Result

        Raises
        ------
        CaseError
            If the case lacks a design, an objective or an optimizer.
        AnalysisError
            If a design cannot be analysed; finished iterations remain in the directory.
        KeyboardInterrupt
            After Ctrl-C; finished iterations remain in the directory.

        Examples
        --------
        >>> import slipstick as ss
        >>> case = ss.Case.template("cube-on-cuboid").replace(
        ...     {"design.volume_fraction": 0.5, "design.simp.min": 1e-3, "optimizer.iterations": 2}
        ... )
        >>> def show(it):
        ...     print(it.iteration, round(it.objective, 3))
        >>> result = case.build().optimize(callback=show)
        0 -8.366
        1 -13.147
        2 -20.248
        """
        responses = own(objective, constraints, list(self._added.values()))
        if iterations is not None and iterations < 1:
            raise ValueError(f"iterations is {iterations}: give 1 or more")
        start = None if density is None else self._density(density)
        return run(
            lambda path, record, report: _slipstick.optimize(
                self.case._case,
                start,
                iterations,
                path,
                overwrite,
                ["python", *sys.argv],
                responses,
                record,
                report,
            ),
            directory,
            callback,
            IterationBar(progress, self.steps, "iteration"),
        )

    def __repr__(self) -> str:
        elements = self._problem.element_count
        return f"<Problem of {self._case.name}: {elements} elements, {self.steps} load steps>"


def _entries(case: Case, values: Mapping[Parameter, float]) -> dict[str, Any]:
    """Parameters as entries of their case, whose motions and loads amplitudes multiply."""
    tables = case.resolved
    entries: dict[str, Any] = {}
    for parameter, value in values.items():
        if parameter.kind == "friction":
            entries[parameter.of] = value
        elif parameter.kind == "youngs_modulus":
            names = [body["name"] for body in tables["body"]]
            body = names.index(parameter.of)
            moduli = case._case.moduli(body, value)
            entries.update({key: json.loads(modulus) for key, modulus in moduli})
        elif parameter.kind == "thermal_expansion":
            names = [body["name"] for body in tables["body"]]
            index = names.index(parameter.of)
            body = tables["body"][index]
            entries[f"body[{index}].thermal_expansion"] = value
            for k, section in enumerate(body.get("section", [])):
                own = section.get("thermal_expansion")
                if own is not None:
                    key = f"body[{index}].section[{k}].thermal_expansion"
                    entries[key] = own * value / body["thermal_expansion"]
        else:
            # dirichlet[1].motion, bolt[0].force, load[0] or temperature[0]
            table, _, key = parameter.of.partition("].")
            section, _, number = table.rstrip("]").partition("[")
            key = key or "amplitude"
            points = tables[section][int(number)][key]
            entries[f"{section}[{number}].{key}"] = [_multiplied(point, value) for point in points]
    return entries


def _multiplied(point: Mapping[str, Any], factor: float) -> dict[str, Any]:
    """A waypoint of a motion, a load or a bolt, with the amplitude multiplied."""
    changed = dict(point)
    if "u" in point:
        changed["u"] = [factor * entry for entry in point["u"]]
    for name in {"angle", "factor", "force"} & point.keys():
        changed[name] = factor * point[name]
    return changed


def _warn(notice: str | None, deeper: int = 0) -> None:
    if notice is not None:
        warnings.warn(SlipstickWarning(notice), stacklevel=3 + deeper)
