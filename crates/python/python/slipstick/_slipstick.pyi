"""The extension module. Not part of the public interface."""

from collections.abc import Callable
from os import PathLike
from pathlib import Path as FilePath
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Numbers = NDArray[np.int64]
_Progress = Callable[[int, int, list[int]], None] | None
_Steps = list[int] | None
_Definition = tuple[Any, str, tuple[int, int], list[str], bool]
_Own = (
    tuple[
        list[_Definition],
        list[tuple[str, _Steps, float]],
        list[tuple[str, _Steps, float | None, float | None]],
        str,
    ]
    | None
)
_Record = Callable[[str, float, str], None] | None

__all__ = [
    "VERSION",
    "Case",
    "Linearization",
    "Path",
    "Problem",
    "Run",
    "main",
    "optimize",
    "read_mesh",
    "resume",
    "second_order_elements",
    "set_threads",
    "templates",
    "threads",
    "volumes",
]

VERSION: str

def templates() -> list[tuple[str, str, str]]: ...
def set_threads(threads: int) -> None:
    """Set the number of compute threads. Call this before any computation."""

def threads() -> int:
    """Number of compute threads; starts them if necessary."""

def main(line: list[str], launcher: list[str]) -> int: ...
def volumes(nodes: _Floats, elements: _Numbers) -> _Floats: ...
def second_order_elements(
    nodes: _Floats, hexahedra: _Numbers, wedges: _Numbers
) -> tuple[_Floats, _Numbers, _Numbers]: ...
def read_mesh(
    file: str | PathLike[str],
) -> tuple[
    _Floats,
    list[tuple[str, _Numbers, _Numbers]],
    dict[str, _Numbers],
    dict[str, _Numbers],
    dict[str, _Numbers],
    list[str],
]: ...
def optimize(
    case: Case,
    density: _Floats | None,
    iterations: int | None,
    directory: str | PathLike[str],
    force: bool,
    command: list[str],
    own: _Own,
    callback: _Record = None,
    progress: _Progress = None,
) -> Run: ...
def resume(
    directory: str | PathLike[str],
    iterations: int | None,
    command: list[str],
    own: _Own,
    callback: _Record = None,
    progress: _Progress = None,
) -> Run: ...

@final
class Case:
    @staticmethod
    def load(file: str | PathLike[str], ignored: list[str]) -> Case: ...
    @staticmethod
    def of_text(
        text: str, name: str, file: str | PathLike[str], files: dict[str, bytes]
    ) -> Case: ...
    def replace(self, values: list[str], files: dict[str, bytes]) -> Case: ...
    @property
    def files(self) -> dict[str, bytes]: ...
    @property
    def text(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def file(self) -> FilePath: ...
    def deck(self) -> str | None: ...
    def json(self) -> str: ...
    def moduli(self, body: int, youngs_modulus: float) -> list[tuple[str, str]]: ...
    def build(self) -> tuple[Problem, str]: ...
    def check(self) -> tuple[str, str]: ...

@final
class Problem:
    @property
    def element_count(self) -> int: ...
    def require_objective(self) -> None: ...
    def nodes(self) -> _Floats: ...
    def elements(self, nodes: int) -> tuple[_Numbers, _Numbers]: ...
    def bodies(self) -> list[tuple[str, tuple[int, int], tuple[int, int]]]: ...
    def sets(self) -> dict[str, _Numbers]: ...
    def surfaces(self) -> dict[str, _Numbers]: ...
    def initial_density(self) -> _Floats: ...
    def load_design(self, results: FilePath) -> tuple[_Floats, _Floats | None]: ...
    def designed(self) -> _Numbers: ...
    def times(self) -> list[float]: ...
    def load_cases(self) -> list[str]: ...
    def quantities(self) -> list[str]: ...
    def add(
        self,
        adapter: Any,
        name: str,
        dimension: tuple[int, int],
        reads: list[str],
        accumulates: bool,
    ) -> None: ...
    def parameters(self) -> list[tuple[str, str, float]]: ...
    def with_parameters(self, values: list[tuple[str, str, float]]) -> Problem: ...
    def volume_fraction(self, density: _Floats) -> float | None: ...
    def solve(
        self, density: _Floats, progress: _Progress = None, friction: float | None = None
    ) -> tuple[Path, str | None]: ...
    def value_and_gradient(
        self, density: _Floats, parameters: bool = False, progress: _Progress = None
    ) -> tuple[float, _Floats, list[tuple[str, str, float]], str | None]: ...
    def linearize(
        self, density: _Floats, names: list[str], progress: _Progress = None
    ) -> Linearization: ...
    def check_gradient(
        self,
        density: _Floats,
        name: str | None,
        directions: int,
        elements: int,
        step: float,
        halvings: int,
        tolerance: float,
        progress: _Progress = None,
    ) -> str: ...

@final
class Path:
    @property
    def value(self) -> float | None: ...
    def steps(self) -> list[tuple[str | None, float, int, int]]: ...
    def displacement(self, step: int) -> _Floats: ...
    def contact(self, step: int) -> dict[str, Any]: ...
    def quantities(self) -> tuple[list[str], list[str], _Floats]: ...
    def density(self) -> _Floats: ...
    def view(self, folder: str | PathLike[str], command: list[str]) -> str: ...

@final
class Linearization:
    def values(self) -> _Floats: ...
    def pull_back(
        self, weights: _Floats, parameters: bool
    ) -> tuple[_Floats, list[tuple[str, str, float]]]: ...

@final
class Run:
    @staticmethod
    def open(directory: str | PathLike[str]) -> Run: ...
    @property
    def directory(self) -> FilePath: ...
    @property
    def warnings(self) -> list[str]: ...
    def history(self) -> str: ...
    def result_iteration(self) -> int: ...
    def constraints(self) -> list[str]: ...
    def density(self, iteration: int | None = None) -> _Floats: ...
    def render(
        self,
        file: str | PathLike[str],
        field: str | None,
        step: int | None,
        iteration: int | None,
        view: str | None,
        deformed: float | None,
        threshold: float | None,
        smooth: bool,
        bodies: list[str] | None,
        plain: bool,
        size: tuple[int, int],
    ) -> str: ...
    def report(self, file: str | PathLike[str]) -> list[str]: ...
    def view(self) -> str: ...
    def export(
        self,
        file: str | PathLike[str],
        iteration: int | None,
        threshold: float | None,
        smooth: int,
        keep_surfaces: bool,
        bodies: list[str],
    ) -> tuple[float, float, float]: ...
