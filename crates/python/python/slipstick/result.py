"""Results of optimizations, in memory and on disk."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import sys
import tempfile
import warnings
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _slipstick
from ._files import free
from ._progress import IterationBar, Report
from .errors import SlipstickWarning
from .quantity import Quantity
from .response import recorded
from .view import View

if TYPE_CHECKING:
    import pandas

__all__ = ["Iteration", "Result", "open_run", "resume"]


@dataclass(frozen=True)
class Iteration:
    """An evaluated design of an optimization.

    Attributes
    ----------
    iteration, objective, volume_fraction, change, optimality, violation, discreteness, seconds
        Columns of the program's ``history.csv``; ``None`` where they are empty. ``seconds`` is
        ``None`` in a history read from disk.
    parts : list of dict
        Value and multiplier of each function whose largest is the objective: worst of load cases,
        or of an eroded, the nominal and a dilated design. Empty if there is only one.
    constraints : list of dict
        Value and multiplier of each constraint, the bound on the volume first.
    newton_iterations, failed_iterations, uzawa_iterations, increments, halvings : int
        Effort of the analysis, and how many times the update was halved.
    status : list of int
        Slave nodes open, sticking, slipping at the end of the path.
    """

    iteration: int
    objective: float
    volume_fraction: float
    change: float | None
    optimality: float | None
    violation: float
    constraints: list[dict[str, float | None]]
    discreteness: float
    newton_iterations: int
    failed_iterations: int
    uzawa_iterations: int
    increments: int
    halvings: int
    status: list[int]
    parts: list[dict[str, float | None]] = dataclasses.field(default_factory=list)
    seconds: float | None = None

    @classmethod
    def _of(cls, record: dict[str, Any], seconds: float | None = None) -> Iteration:
        names = {field.name for field in dataclasses.fields(cls)}
        known = {name: value for name, value in record.items() if name in names}
        return cls(**{**known, "seconds": seconds})


class Result:
    """A finished optimization, in its directory.

    Attributes
    ----------
    directory : pathlib.Path
        The directory of the run.
    """

    def __init__(self, run: _slipstick.Run, temporary: bool = False) -> None:
        self._run = run
        self.directory = FilePath(run.directory)
        if temporary:
            weakref.finalize(self, shutil.rmtree, self.directory, ignore_errors=True)

    @property
    def density(self) -> NDArray[np.float64]:
        """Densities of the resulting design, shape (elements,)."""
        return self._run.density()

    def density_of(self, iteration: int) -> NDArray[np.float64]:
        """Densities of an earlier design.

        Parameters
        ----------
        iteration : int
            Its number; ``output.every`` in the case sets how often designs are kept.

        Returns
        -------
        ndarray, shape (elements,)
        """
        return self._run.density(iteration)

    @property
    def iterations(self) -> Sequence[Iteration]:
        """All evaluated designs."""
        return [Iteration._of(record) for record in json.loads(self._run.history())]

    @property
    def objective(self) -> float:
        """Objective of the resulting design."""
        return self.iterations[self.iteration].objective

    @property
    def iteration(self) -> int:
        """Iteration of the resulting design.

        The last one, unless it violates a constraint or is worse than the best design that meets all.
        """
        return self._run.result_iteration()

    @property
    def history(self) -> pandas.DataFrame | list[dict[str, Any]]:
        """All evaluated designs as a table, indexed by iteration; without pandas, a list of dicts.

        Each constraint has a column with its values, under its name.
        """
        names = self._run.constraints()
        rows = []
        for iteration in self.iterations:
            row = dataclasses.asdict(iteration)
            del row["seconds"]
            row["open"], row["stick"], row["slip"] = row.pop("status")
            for name, constraint in zip(names, row.pop("constraints"), strict=True):
                if name not in row:
                    row[name] = constraint["value"]
            rows.append(row)
        try:
            import pandas
        except ImportError:
            return rows
        return pandas.DataFrame(rows).set_index("iteration")

    def render(
        self,
        file: str | os.PathLike[str],
        *,
        field: str | None = None,
        step: int | None = None,
        iteration: int | None = None,
        view: str | None = None,
        deformed: float | None = None,
        threshold: float | None = None,
        smooth: bool = False,
        bodies: Sequence[str] | None = None,
        plain: bool = False,
        size: tuple[int, int] = (1200, 900),
        overwrite: bool = False,
    ) -> FilePath:
        """Draw the design, or a field, as a PNG picture, as ``slipstick render`` does.

        Parameters
        ----------
        file : path-like
            The picture to write, ``*.png``.
        field : str, optional
            Name of a field, or a word that identifies it, such as ``"pressure"``; by default the
            smooth surface of the design.
        step, iteration : int, optional
            The state at the end of a load step, or the undeformed design of an iteration; by
            default the newest design.
        view : str, optional
            Name of a view, such as ``"front"``.
        deformed : float, optional
            Scale factor for displacements.
        threshold : float, optional
            Elements with this density or less are hidden.
        smooth : bool
            Whether to draw the smooth surface that :meth:`export` writes; without field and
            threshold, a design is drawn so anyway.
        bodies : sequence of str, optional
            The bodies to show.
        plain : bool
            Whether to leave out supports, motions, loads, planes of symmetry, the undeformed shape
            and the scale bar.
        size : tuple of int
            Width and height in pixels.
        overwrite : bool
            Whether to replace an existing file.

        Returns
        -------
        pathlib.Path
            The picture.
        """
        path = free(file, overwrite, (".png",))
        names = None if bodies is None else list(bodies)
        self._run.render(
            path, field, step, iteration, view, deformed, threshold, smooth, names, plain, size
        )
        return path

    def report(self, file: str | os.PathLike[str], *, overwrite: bool = False) -> FilePath:
        """Write the run as a single web page, as ``slipstick report`` does.

        Parameters
        ----------
        file : path-like
            The page to write, ``*.html``.
        overwrite : bool
            Whether to replace an existing file.

        Returns
        -------
        pathlib.Path
            The page.
        """
        path = free(file, overwrite, (".html", ".htm"))
        self._run.report(path)
        return path

    def view(self, *, height: int = 640) -> View:
        """The interactive 3D view of ``slipstick report``, for notebooks.

        It has the designs of all iterations that were kept, and the load path.

        Parameters
        ----------
        height : int
            Height in the notebook, in pixels.

        Returns
        -------
        View
        """
        return View(self._run.view(), height)

    def export(
        self,
        file: str | os.PathLike[str],
        *,
        iteration: int | None = None,
        threshold: float | None = None,
        smooth: int = 10,
        keep_surfaces: bool = True,
        bodies: Sequence[str] = (),
        overwrite: bool = False,
    ) -> FilePath:
        """Write the design as a closed surface, or as solids for CAD, as ``slipstick export`` does.

        Parameters
        ----------
        file : path-like
            The file to write; its extension selects STL, 3MF, OBJ, VTU or STEP.
        iteration : int, optional
            Number of a design; by default the newest.
        threshold : float, optional
            Density above which elements count as material; by default the one that preserves the
            volume.
        smooth : int
            Number of smoothing passes.
        keep_surfaces : bool
            Whether the outer faces of the bodies stay in place; in a STEP file, they always do.
        bodies : sequence of str
            The bodies to export; by default the designed ones.
        overwrite : bool
            Whether to replace an existing file.

        Returns
        -------
        pathlib.Path
            The file.
        """
        path = free(file, overwrite, (".stl", ".3mf", ".obj", ".vtu", ".step", ".stp"))
        self._run.export(path, iteration, threshold, smooth, keep_surfaces, list(bodies))
        return path

    def _repr_png_(self) -> bytes:
        """The picture that notebooks show."""
        with tempfile.TemporaryDirectory() as folder:
            return self.render(FilePath(folder) / "picture.png", size=(800, 600)).read_bytes()

    def __repr__(self) -> str:
        return f"<Result in {self.directory}>"


Record = Callable[[str, float, str], None]


def run(
    start: Callable[[FilePath, Record | None, Report | None], _slipstick.Run],
    directory: str | os.PathLike[str] | None,
    callback: Callable[[Iteration], object] | None,
    bar: IterationBar,
) -> Result:
    """Runs an optimization; finished iterations survive every exception."""
    temporary = directory is None
    path = (
        FilePath(tempfile.mkdtemp(prefix="slipstick-"))
        if directory is None
        else FilePath(directory)
    )

    def record(text: str, seconds: float, outlook: str) -> None:
        evaluated = json.loads(text)
        bar.evaluated(evaluated, seconds, json.loads(outlook))
        if callback is not None:
            callback(Iteration._of(evaluated, seconds))

    try:
        with bar:
            recorded_by = record if callback or bar.shown else None
            result = Result(start(path, recorded_by, bar.report), temporary)
    except BaseException as error:
        kept = _has_iterations(path)
        if temporary and not kept:
            shutil.rmtree(path, ignore_errors=True)
        if not isinstance(error, KeyboardInterrupt):
            raise
        continues = f"slipstick.resume({os.fspath(path)!r}) continues"
        said = f"finished iterations are kept: {continues}" if kept else "no iteration has finished"
        raise KeyboardInterrupt(said) from None
    for warning in result._run.warnings:
        warnings.warn(SlipstickWarning(warning), stacklevel=3)
    return result


def _has_iterations(directory: FilePath) -> bool:
    """Whether a run has finished an iteration, from which it can continue."""
    history = directory / "history.csv"
    if not history.is_file() or not (directory / "checkpoint.json").is_file():
        return False
    with history.open(encoding="utf-8") as rows:
        return sum(1 for _ in rows) > 1


def resume(
    directory: str | os.PathLike[str],
    *,
    iterations: int | None = None,
    quantities: Sequence[Quantity] = (),
    callback: Callable[[Iteration], object] | None = None,
    progress: bool = False,
) -> Result:
    """Continue an optimization from its last finished iteration, with bit-identical results.

    Parameters
    ----------
    directory : path-like
        The directory of a stopped optimization, started by this package or by the program.
    iterations : int, optional
        Total number of updates; by default the number with which the run was started.
    quantities : sequence of Quantity
        The custom quantities that its objective or its constraints use.
    callback : callable, optional
        Called with an :class:`Iteration` after each evaluated design.
    progress : bool
        Whether to show iterations and the remaining time.

    Returns
    -------
    Result

    Raises
    ------
    InputError
        If the directory contains no optimization, or its files were changed.
    ValueError
        If one of them is missing from `quantities`.
    """
    record_file = FilePath(directory) / "responses.json"
    responses = None
    if record_file.is_file():
        responses = recorded(record_file.read_text(encoding="utf-8"), quantities)
    if iterations is not None and iterations < 1:
        raise ValueError(f"iterations is {iterations}: give 1 or more")
    # the number of load steps is not known before the case is read
    bar = IterationBar(progress, 0, "iteration")
    return run(
        lambda path, record, report: _slipstick.resume(
            path, iterations, ["python", *sys.argv], responses, record, report
        ),
        directory,
        callback,
        bar,
    )


def open_run(directory: str | os.PathLike[str]) -> Result:
    """The result of an earlier optimization, run by this package or by the program.

    Parameters
    ----------
    directory : path-like
        Its directory.

    Returns
    -------
    Result

    Raises
    ------
    InputError
        If there is no run in the directory.
    """
    return Result(_slipstick.Run.open(FilePath(directory)))
