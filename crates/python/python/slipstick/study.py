"""Studies: lists of runs in a file, with tables and pictures."""

from __future__ import annotations

import contextlib
import csv
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import IO, TYPE_CHECKING, TextIO

from .errors import InputError, StudyError

if TYPE_CHECKING:
    import pandas

    from .result import Result

__all__ = ["Study", "StudyRun", "run_study"]

# exit codes of the program
_BAD_INPUT = 2
_INTERRUPTED = 4


@dataclass(frozen=True)
class StudyRun:
    """A finished run of a study.

    Attributes
    ----------
    name : str
        Its name in the study.
    directory : pathlib.Path
        Its files.
    seconds : float
        Wall time, summed over all its parts.
    numbers : mapping of str to float
        Its results, such as ``"objective"`` or ``"objective at 0.3"``.
    """

    name: str
    directory: FilePath
    seconds: float
    numbers: Mapping[str, float]

    def open(self) -> Result:
        """The result of an optimization, as by :func:`slipstick.open_run`."""
        from .result import open_run

        return open_run(self.directory)


@dataclass(frozen=True)
class Study:
    """The finished runs of a study.

    Attributes
    ----------
    directory : pathlib.Path
        The directory of all runs, with ``numbers.csv`` and ``tables.md``.
    runs : mapping of str to StudyRun
        The finished runs by name, in the order of the study.
    """

    directory: FilePath
    runs: Mapping[str, StudyRun]

    def to_dataframe(self) -> pandas.DataFrame:
        """The numbers as a table with a row for each run (needs pandas)."""
        import pandas

        index = pandas.Index(list(self.runs), name="run")
        return pandas.DataFrame([dict(run.numbers) for run in self.runs.values()], index=index)

    def grid(self, name: str) -> pandas.DataFrame:
        """The runs of a grid with their values and numbers, as in ``grid_NAME.csv`` (needs pandas).

        Parameters
        ----------
        name : str
            The name of the run with the grid.

        Returns
        -------
        pandas.DataFrame
            A row for each run, indexed by its name. Runs that have not finished have no numbers.

        Raises
        ------
        ValueError
            If no finished run belongs to a grid of this name.
        """
        import pandas

        table = self.directory / f"grid_{name}.csv"
        if not table.is_file():
            grids = sorted(
                file.stem.removeprefix("grid_") for file in self.directory.glob("grid_*.csv")
            )
            raise ValueError(f"there is no grid {name!r}; available: {', '.join(grids) or 'none'}")
        return pandas.read_csv(table, index_col="run")


def run_study(
    path: str | os.PathLike[str], *, only: Sequence[str] = (), quiet: bool = False
) -> Study:
    """Execute the runs of a study that have not finished yet, as ``slipstick study`` does.

    Every run is a separate process. A finished run is repeated only if its inputs have changed; an
    interrupted optimization is resumed.

    Parameters
    ----------
    path : path-like
        A study file (TOML). The results are in a directory next to it, which has the name of the
        file without ``.toml``.
    only : sequence of str
        Names of the runs or grids to execute; by default all of them.
    quiet : bool
        Whether to suppress messages.

    Returns
    -------
    Study
        All finished runs of the study, including those of earlier calls.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If the study file has errors.
    StudyError
        If runs failed, or numbers differ from what the study expects; its ``study`` contains the
        finished runs.
    KeyboardInterrupt
        After Ctrl-C; finished runs are kept, and the next call continues with the rest.
    """
    file = FilePath(path)
    if isinstance(only, str):
        raise TypeError(f"only is the string {only!r}: give a list of names")
    if not file.is_file():
        raise FileNotFoundError(f"there is no study file {os.fspath(path)!r}")
    command = [sys.executable, "-m", "slipstick", "study", os.fspath(file)]
    if only:
        command += ["--only", ",".join(only)]
    # in a session of its own, so that Ctrl-C reaches the study and its runs once, from here
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        start_new_session=True,
    )
    said: list[str] = []
    reader = threading.Thread(target=_forward, args=(process.stdout, None if quiet else sys.stdout))
    reader.start()
    try:
        _forward(process.stderr, None if quiet else sys.stderr, said)
        code = process.wait()
    except KeyboardInterrupt:
        if process.poll() is None:
            if sys.platform == "win32":
                process.terminate()
            else:
                os.killpg(process.pid, signal.SIGINT)
        process.wait()
        raise KeyboardInterrupt("finished runs are kept; the same call continues") from None
    finally:
        reader.join()
    if code == 0:
        return _finished(file)
    message = "".join(said).strip().removeprefix("error: ")
    message = message or f"the study ended with exit code {code}"
    if code == _INTERRUPTED:
        raise KeyboardInterrupt("finished runs are kept; the same call continues")
    if code == _BAD_INPUT:
        raise InputError._of(message, message.rpartition("help: ")[2])
    study = _finished(file)
    failed = [name for name in _names(file) if name not in study.runs]
    raise StudyError._of(message, study, failed)


def _forward(source: IO[str] | None, to: TextIO | None, keep: list[str] | None = None) -> None:
    """Copies lines to a stream, and keeps them."""
    with source or contextlib.nullcontext(()) as lines:
        for line in lines:
            if keep is not None:
                keep.append(line)
            if to is not None:
                to.write(line)


def _names(file: FilePath) -> list[str]:
    """The runs that have a record."""
    return [entry.stem for entry in sorted((file.parent / file.stem).glob("*.json"))]


def _finished(file: FilePath) -> Study:
    directory = file.parent / file.stem
    runs: dict[str, StudyRun] = {}
    table = directory / "numbers.csv"
    if not table.is_file():
        return Study(directory, runs)
    with table.open(encoding="utf-8", newline="") as rows:
        for row in csv.DictReader(rows):
            name = row["run"]
            record = directory / f"{name}.json"
            if name in runs or not record.is_file():
                continue
            data = json.loads(record.read_text(encoding="utf-8"))
            numbers = {key: float(value) for key, value in data["numbers"].items()}
            runs[name] = StudyRun(name, directory / name, float(data["seconds"]), numbers)
    return Study(directory, runs)
