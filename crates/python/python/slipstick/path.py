"""The states of a load path."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _slipstick
from .view import View

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = ["Contact", "Path", "Step"]


@dataclass(frozen=True, eq=False)
class SlaveNodes:
    """The slave nodes of all contact pairs, and their status."""

    node: NDArray[np.int64]
    pair: NDArray[np.int64]
    status: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Contact(SlaveNodes):
    """Contact at all slave nodes at the end of a load step, as a struct of arrays.

    Attributes
    ----------
    node : ndarray of int, shape (k,)
        The slave nodes, pair by pair.
    pair : ndarray of int, shape (k,)
        Number of the contact pair, from 0.
    status : ndarray of uint8, shape (k,)
        0 open, 1 stick, 2 slip.
    pressure : ndarray, shape (k,)
        Contact pressure per current area, at least 0 in compression. [F/L²]
    traction : ndarray, shape (k, 3)
        Normal and tangential traction on the slave, per current area. [F/L²]
    force : ndarray, shape (k, 3)
        Force that contact exerts on the node. [F]
    gap : ndarray, shape (k,)
        Weighted gap divided by tributary area, at least 0 where open; nan where no part of the
        master surface lies opposite. [L]
    slip : ndarray, shape (k, 2)
        Slip increment of the last (sub-)step in the node's tangent basis. [L]
    area : ndarray, shape (k,)
        Area of the overlap on which the node's multiplier acts. [L²]
    """

    pressure: NDArray[np.float64]
    traction: NDArray[np.float64]
    force: NDArray[np.float64]
    gap: NDArray[np.float64]
    slip: NDArray[np.float64]
    area: NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    """A load step and the state at its end. Arrays are computed when they are first read.

    Attributes
    ----------
    number : int
        Number of the load step, from 1, through all load cases.
    load_case : str or None
        Name of its load case, if load cases have names.
    time : float
        Pseudo-time at its end, within its load case; 1 is the end.
    increments : int
        Accepted (sub-)steps; more than 1 if the step was cut back.
    newton_iterations : int
        Newton iterations of these.
    """

    number: int
    load_case: str | None
    time: float
    increments: int
    newton_iterations: int
    _path: _slipstick.Path = field(repr=False)

    @cached_property
    def displacement(self) -> NDArray[np.float64]:
        """Displacements of all nodes, shape (nodes, 3). [L]"""
        return _arrays.frozen(self._path.displacement(self.number))

    @cached_property
    def contact(self) -> Contact:
        """Contact at all slave nodes."""
        found = self._path.contact(self.number)
        return Contact(**{name: _arrays.frozen(array) for name, array in found.items()})


class Path:
    """A solved load path.

    Attributes
    ----------
    steps : sequence of Step
        The load steps: ``steps[0]`` is load step 1, ``steps[-1]`` the last one.
    density : ndarray, shape (elements,)
        The densities of the path.

    Examples
    --------
    >>> import slipstick as ss
    >>> path = ss.Case.template("cube-on-cuboid").build().solve()
    >>> len(path.steps), path.steps[-1].displacement.shape
    (10, (28, 3))
    >>> path.steps[-1].contact.status
    array([0, 1, 0, 1], dtype=uint8)
    >>> path.quantities["reaction_cube_ymax_y"].shape
    (10,)
    """

    def __init__(self, path: _slipstick.Path) -> None:
        self._path = path
        self.steps: Sequence[Step] = tuple(
            Step(number, *step, path) for number, step in enumerate(path.steps(), start=1)
        )
        self.density: NDArray[np.float64] = _arrays.frozen(path.density())

    @property
    def objective(self) -> float | None:
        """Value of the case's objective; ``None`` without one."""
        return self._path.value

    @cached_property
    def _table(self) -> tuple[list[str], list[str], NDArray[np.float64]]:
        names, units, values = self._path.quantities()
        return names, units, _arrays.frozen(values)

    @cached_property
    def quantities(self) -> Mapping[str, NDArray[np.float64]]:
        """All quantities by name, shape (steps,) each, at the ends of the load steps.

        They are the columns of the program's ``quantities.csv``.
        """
        names, _, values = self._table
        return {name: values[:, column] for column, name in enumerate(names)}

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the quantities in force F and length L; empty for dimensionless numbers."""
        names, units, _ = self._table
        return dict(zip(names, units, strict=True))

    def view(self, *, height: int = 640) -> View:
        """The interactive 3D view of ``slipstick report``, for notebooks.

        Parameters
        ----------
        height : int
            Height in the notebook, in pixels.

        Returns
        -------
        View

        Examples
        --------
        >>> import slipstick as ss
        >>> view = ss.Case.template("cube-on-cuboid").build().solve().view()
        >>> view.save("path.html")  # doctest: +SKIP
        """
        with tempfile.TemporaryDirectory(prefix="slipstick-") as folder:
            # a folder that does not exist yet takes the files of a run
            page = self._path.view(FilePath(folder) / "run", ["python", *sys.argv])
        return View(page, height)

    def to_dataframe(self) -> pandas.DataFrame:
        """The quantities as a table with a row for each load step (needs pandas).

        Returns
        -------
        pandas.DataFrame
            Indexed by load step, with the pseudo-time, the load case if there are several, and a
            column for each quantity.
        """
        import pandas

        index = pandas.Index([step.number for step in self.steps], name="step")
        columns: dict[str, object] = {"time": [step.time for step in self.steps]}
        if any(step.load_case is not None for step in self.steps):
            columns["load_case"] = [step.load_case for step in self.steps]
        return pandas.DataFrame({**columns, **self.quantities}, index=index)

    def to_xarray(self) -> xarray.Dataset:
        """Quantities and displacements with named dimensions (needs xarray).

        Returns
        -------
        xarray.Dataset
            The quantities over ``step``; ``displacement`` over ``step``, ``node`` and
            ``component``.
        """
        import xarray

        coordinates = {
            "step": [step.number for step in self.steps],
            "time": ("step", [step.time for step in self.steps]),
            "component": ["x", "y", "z"],
        }
        variables = {name: ("step", values) for name, values in self.quantities.items()}
        moved = np.stack([step.displacement for step in self.steps])
        return xarray.Dataset(
            {**variables, "displacement": (("step", "node", "component"), moved)}, coordinates
        )

    def __repr__(self) -> str:
        return f"<Path: {len(self.steps)} load steps>"
