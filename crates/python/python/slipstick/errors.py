"""Exceptions and warnings, with the program's messages and the data behind them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .study import Study

__all__ = [
    "AnalysisError",
    "CaseError",
    "CaseWarning",
    "Diagnostic",
    "InputError",
    "InternalError",
    "SlipstickError",
    "SlipstickWarning",
    "StudyError",
]


@dataclass(frozen=True)
class Diagnostic:
    """An error or a warning at its place in a case.

    Attributes
    ----------
    severity : str
        ``"error"`` or ``"warning"``.
    code : str
        A stable code; see ``slipstick explain CODE``.
    file : str
        Name of the case.
    line, column : int
        Position in the text of the case, both from 1.
    message : str
        What is wrong.
    help : str
        The remedy; may be empty.
    """

    severity: str
    code: str
    file: str
    line: int
    column: int
    message: str
    help: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}"
        text = f"{place}: {self.severity}: {self.message} [{self.code}]"
        return f"{text}\n    help: {self.help}" if self.help else text


def diagnostics_of(text: str) -> list[Diagnostic]:
    """Diagnostics from the extension's JSON."""
    return [Diagnostic(**entry) for entry in json.loads(text)]


class SlipstickError(Exception):
    """The base of all exceptions of this package."""


class CaseError(SlipstickError, ValueError):
    """A case has errors. ``str()`` returns the program's message, which lists all of them.

    Attributes
    ----------
    diagnostics : sequence of Diagnostic
        The errors in the order of the file.

    Examples
    --------
    >>> import slipstick as ss
    >>> try:
    ...     ss.Case.template("cube-on-cuboid").replace({"contact[0].friction": -1})
    ... except ss.CaseError as error:
    ...     print(error.diagnostics[0].code, error.diagnostics[0].message, sep=": ")
    slipstick::case::friction: `friction` must not be negative
    """

    diagnostics: Sequence[Diagnostic] = ()

    @classmethod
    def _of(cls, text: str, diagnostics: str) -> CaseError:
        error = cls(text)
        error.diagnostics = diagnostics_of(diagnostics)
        return error


class InputError(SlipstickError, ValueError):
    """An input other than the case is wrong: an argument, a file, a directory.

    Attributes
    ----------
    help : str
        The remedy; may be empty.
    """

    help: str = ""

    @classmethod
    def _of(cls, text: str, help: str) -> InputError:
        error = cls(text)
        error.help = help
        return error

    @classmethod
    def _because(cls, message: str, help: str) -> InputError:
        """The error with the text that the extension gives its own."""
        return cls._of(f"{message}\n    help: {help}", help)


class AnalysisError(SlipstickError, RuntimeError):
    """An analysis failed. ``str()`` says where and why, what was tried, and what may help.

    Attributes
    ----------
    step : int or None
        The load step that failed, from 1; ``None`` if no load step failed.
    cause : str
        Why it failed.
    cures : list of str
        Changes that may help.
    report : dict
        All data of the message: places, iterations, attempts.
    """

    step: int | None = None
    cause: str = ""
    cures: Sequence[str] = ()
    report: dict[str, Any]

    @classmethod
    def _of(cls, text: str, report: str) -> AnalysisError:
        error = cls(text)
        error.report = json.loads(report)
        error.step = error.report.get("step")
        error.cause = error.report.get("cause", "")
        error.cures = error.report.get("cures", [])
        return error


class StudyError(SlipstickError, RuntimeError):
    """Runs of a study failed, or numbers differ from what the study expects.

    Attributes
    ----------
    study : slipstick.Study
        The finished runs.
    failed : sequence of str
        Names of the runs that were started but did not finish.
    """

    study: Study
    failed: Sequence[str] = ()

    @classmethod
    def _of(cls, text: str, study: Study, failed: Sequence[str]) -> StudyError:
        error = cls(text)
        error.study = study
        error.failed = failed
        return error


class InternalError(SlipstickError, RuntimeError):
    """A defect of slipstick. Please report it, with the case."""

    @classmethod
    def _of(cls, text: str) -> InternalError:
        return cls(text)


class SlipstickWarning(UserWarning):
    """A result that is probably not what you wanted."""


class CaseWarning(SlipstickWarning):
    """Something in a case is probably a mistake. ``str()`` returns the program's message.

    Attributes
    ----------
    diagnostic : Diagnostic
        The warning as data.
    """

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(str(diagnostic))
        self.diagnostic = diagnostic
