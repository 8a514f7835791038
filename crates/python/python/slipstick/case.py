"""Cases: descriptions of problems, as text, as a dict or as a file."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from . import _slipstick, _toml
from .errors import CaseWarning, Diagnostic, InputError, diagnostics_of

if TYPE_CHECKING:
    from .problem import Problem

__all__ = ["Case", "Inspection", "templates"]


def templates() -> dict[str, str]:
    """The templates by name, each with a one-line description.

    Examples
    --------
    >>> import slipstick as ss
    >>> ss.templates()["cube-on-cuboid"]
    'five elements, for studying forces and gradients'
    """
    return {name: about for name, about, _ in _slipstick.templates()}


@dataclass(frozen=True)
class Inspection:
    """Facts about a case that are known before anything is solved.

    Attributes
    ----------
    bodies : list of dict
        Name, elements, nodes, volume, worst quality and free rigid motions of each body.
    contacts : list of dict
        Surfaces, facets, slave nodes, smallest gap and search radius of each contact pair.
    sets : dict of str to int
        Number of nodes of each node set and surface.
    unknowns : int
        Free unknowns of a load step.
    designed : int
        Elements whose density is a design variable.
    steps : int
        Load steps.
    peak_bytes : float
        Predicted peak memory of a run.
    warnings : list of Diagnostic
        Probable mistakes.
    data : dict
        All facts, as printed by ``slipstick check --json``.
    """

    bodies: list[dict[str, Any]]
    contacts: list[dict[str, Any]]
    sets: dict[str, int]
    unknowns: int
    designed: int
    steps: int
    peak_bytes: float
    warnings: list[Diagnostic]
    data: dict[str, Any] = field(repr=False)


class Case:
    """A checked case: bodies, contact, motions, loads, design and objective.

    Make one with :meth:`load`, :meth:`from_dict`, :meth:`from_text` or :meth:`template`. A case is
    immutable; :meth:`replace` returns a modified copy.

    Examples
    --------
    >>> import slipstick as ss
    >>> case = ss.Case.template("cube-on-cuboid").replace({"contact[0].friction": 0.2})
    >>> case.resolved["contact"][0]["friction"]
    0.2
    """

    _case: _slipstick.Case

    def __init__(self) -> None:
        raise TypeError("use Case.load, Case.from_dict, Case.from_text or Case.template")

    @classmethod
    def _of(cls, case: _slipstick.Case) -> Case:
        self = cls.__new__(cls)
        self._case = case
        return self

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, ignore: Iterable[str] = ()) -> Case:
        """Read a case file or a deck, and the mesh files that it names.

        Parameters
        ----------
        path : path-like
            A case file (TOML), or a deck of CalculiX or Abaqus (``.inp``). Paths of mesh files in
            it are relative to its folder.
        ignore : iterable of str
            Keywords of the deck that are left out, such as ``"MPC"``; :attr:`deck` shows
            which were used.

        Raises
        ------
        OSError
            If the file cannot be read.
        CaseError
            If it has errors; all of them are reported at once.
        """
        if isinstance(ignore, str):
            raise TypeError("ignore must be an iterable of keywords, not a single string")
        return cls._of(_slipstick.Case.load(FilePath(path), list(ignore)))

    @property
    def deck(self) -> list[dict[str, Any]] | None:
        """How each keyword of the case's deck is treated; None for a case without a deck.

        Every entry has ``keyword``, ``file``, ``line``, ``use`` (for example ``"used"``) and
        ``how``, an explanation. A case read from :attr:`text` has None as well.
        """
        uses = self._case.deck()
        return None if uses is None else json.loads(uses)

    @classmethod
    def from_text(
        cls, text: str, *, name: str = "case.toml", folder: str | os.PathLike[str] = "."
    ) -> Case:
        """Read the text of a case file.

        Parameters
        ----------
        text : str
            A case in TOML.
        name : str
            The name used in messages.
        folder : path-like
            The folder to which paths of mesh files are relative.

        Raises
        ------
        CaseError
            If the text has errors.
        """
        return cls._read(text, name, folder, {})

    @classmethod
    def _read(
        cls, text: str, name: str, folder: str | os.PathLike[str], files: dict[str, bytes]
    ) -> Case:
        file = FilePath(folder) / FilePath(name).name
        return cls._of(_slipstick.Case.of_text(text, name, file, files))

    @classmethod
    def from_dict(
        cls,
        case: Mapping[str, Any],
        *,
        name: str = "case.toml",
        folder: str | os.PathLike[str] = ".",
    ) -> Case:
        """Make a case from nested dicts and lists, with the keys of a case file.

        Parameters
        ----------
        case : mapping
            Values may be strings, paths, numbers, booleans, lists, numpy arrays and mappings. The
            ``mesh`` of a body, or its ``file``, may be a :class:`Mesh`.
        name : str
            The name used in messages. Line numbers in messages refer to :attr:`text`.
        folder : path-like
            The folder to which paths of mesh files are relative.

        Raises
        ------
        CaseError
            If the case has errors.
        TypeError
            If a value has no counterpart in a case file.

        Examples
        --------
        >>> import slipstick as ss
        >>> steel = {"neo_hooke": {"youngs_modulus": 1000.0, "poisson_ratio": 0.3}}
        >>> box = {"min": [0, 0, 0], "max": [1, 1, 1], "elements": [2, 2, 2]}
        >>> case = ss.Case.from_dict({
        ...     "body": [{"name": "block", "box": box, "material": steel}],
        ...     "dirichlet": [
        ...         {"set": "block_ymin"},
        ...         {"set": "block_ymax", "motion": [{"t": 1.0, "u": [0.0, -0.1, 0.0]}]},
        ...     ],
        ...     "load_path": {"steps": 2},
        ... })
        >>> path = case.build().solve()
        >>> round(float(path.quantities["reaction_block_ymax_y"][-1]), 2)
        -125.56
        """
        if not isinstance(case, Mapping):
            raise TypeError(
                f"case is of type {type(case).__name__}: give a dict with the keys of a case file"
            )
        files: dict[str, bytes] = {}
        text = _toml.document(case, files)
        return cls._read(text, name, folder, files)

    @classmethod
    def template(cls, name: str) -> Case:
        """A commented case that runs without changes; :func:`templates` lists all templates.

        Parameters
        ----------
        name : str
            Name of a template, such as ``"half-ball"``.

        Raises
        ------
        InputError
            If there is no template with this name.
        """
        wanted = name.replace("_", "-")
        for known, _, text in _slipstick.templates():
            if known == wanted:
                return cls.from_text(text, name=f"{known.replace('-', '_')}.toml")
        names = ", ".join(templates())
        raise InputError._because(f"there is no template called `{name}`", f"templates: {names}")

    def replace(self, values: Mapping[str, Any]) -> Case:
        """The same case with other values.

        Parameters
        ----------
        values : mapping of str to value
            Keys are paths such as ``"contact[0].friction"`` or ``"load_path.steps"``; entries of
            lists are counted from 0. Keys that the case does not have are added.

        Returns
        -------
        Case

        Raises
        ------
        InputError
            If a path cannot be resolved in the case.
        CaseError
            If a value is wrong.

        Examples
        --------
        >>> import slipstick as ss
        >>> case = ss.Case.template("cube-on-cuboid")
        >>> case.replace({"load_path.steps": 4, "contact[0].friction": 0.1}).build().steps
        4
        """
        for key in values:
            if not isinstance(key, str):
                raise TypeError(
                    f"values has the key {key!r}: keys are strings such as 'contact[0].friction'"
                )
        files: dict[str, bytes] = {}
        lines = [f"{key} = {_toml.value(value, key, files)}" for key, value in values.items()]
        return Case._of(self._case.replace(lines, files))

    @property
    def text(self) -> str:
        """The text of the case, in TOML."""
        return self._case.text

    @property
    def name(self) -> str:
        """The name used in messages."""
        return self._case.name

    @property
    def resolved(self) -> dict[str, Any]:
        """The case with all defaults filled in, as by ``slipstick check --resolved --json``."""
        resolved: dict[str, Any] = json.loads(self._case.json())
        return resolved

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write :attr:`text` to a file.

        Parameters
        ----------
        path : path-like
            The file, which must not exist yet. Meshes that exist only in memory are written next to
            it; mesh files are not copied.

        Raises
        ------
        FileExistsError
            If the file exists.
        """
        with open(path, "x", encoding="utf-8") as file:
            file.write(self.text)
        for name, data in self._case.files.items():
            # the name is a hash of the contents
            (FilePath(path).parent / name).write_bytes(data)

    def build(self) -> Problem:
        """Mesh the bodies and set up the model.

        Returns
        -------
        Problem

        Raises
        ------
        CaseError
            If the case cannot be built, or a body can move freely.

        Warns
        -----
        CaseWarning
            For probable mistakes.
        """
        from .problem import Problem

        problem, found = self._case.build()
        _warn(diagnostics_of(found))
        return Problem._of(self, problem)

    def check(self) -> Inspection:
        """Inspect the case before anything is solved, as ``slipstick check`` does.

        Returns
        -------
        Inspection

        Raises
        ------
        CaseError
            If the case cannot be built, or a body can move freely.

        Examples
        --------
        >>> import slipstick as ss
        >>> inspection = ss.Case.template("cube-on-cuboid").check()
        >>> inspection.unknowns, inspection.contacts[0]["slave_nodes"], inspection.warnings
        (54, 4, [])
        """
        found, warned = self._case.check()
        data: dict[str, Any] = json.loads(found)
        names = ("bodies", "contacts", "unknowns", "designed", "steps", "peak_bytes")
        figures = {name: data[name] for name in names}
        return Inspection(
            **figures, sets=dict(data["sets"]), warnings=diagnostics_of(warned), data=data
        )

    def __repr__(self) -> str:
        return f"<Case {self.name}>"

    def __reduce__(self) -> tuple[Any, ...]:
        # for processes that compute in parallel
        file = self._case.file.absolute()
        return _restored, (self.text, self.name, file, self._case.files)


def _restored(text: str, name: str, file: FilePath, files: dict[str, bytes]) -> Case:
    return Case._of(_slipstick.Case.of_text(text, name, file, files))


def _warn(diagnostics: Sequence[Diagnostic]) -> None:
    for diagnostic in diagnostics:
        # at the caller of Case.build
        warnings.warn(CaseWarning(diagnostic), stacklevel=3)
