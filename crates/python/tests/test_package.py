"""The package itself: examples in docstrings, type stubs, version, import."""

from __future__ import annotations

import doctest
import importlib
import importlib.metadata
import importlib.util
import inspect
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest
import slipstick as ss
from conftest import needs_wheel

PACKAGE = Path(ss.__file__).parent
HERE = Path(__file__).parent.parent


def modules() -> list[str]:
    names = [found.name for found in pkgutil.iter_modules([str(PACKAGE)])]
    # optional extras have tests of their own
    return [
        "slipstick",
        *(f"slipstick.{name}" for name in names if name not in ("__main__", "jax", "torch")),
    ]


@pytest.mark.parametrize("name", modules())
def test_examples_of_docstrings(name: str) -> None:
    module = importlib.import_module(name)
    results = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert results.failed == 0


def test_there_are_examples() -> None:
    finder = doctest.DocTestFinder()
    tests = [test for name in modules() for test in finder.find(importlib.import_module(name))]
    assert sum(len(test.examples) > 0 for test in tests) >= 12


def test_everything_public_is_documented() -> None:
    """Numpy style: a summary; the parameters of every function, and nothing else."""
    for name in ss.__all__:
        if name in ("jax", "torch"):
            continue
        thing = getattr(ss, name)
        if inspect.ismodule(thing) or isinstance(thing, str):
            continue
        assert inspect.getdoc(thing), name
        if not inspect.isclass(thing):
            check_parameters(name, thing)
            continue
        for member, value in vars(thing).items():
            if member.startswith("_"):
                continue
            if isinstance(value, classmethod):
                value = value.__func__
            if inspect.isfunction(value):
                check_parameters(f"{name}.{member}", value)
            elif isinstance(value, property):
                assert value.__doc__, f"{name}.{member}"


def check_parameters(name: str, function: object) -> None:
    doc = inspect.getdoc(function)
    assert doc, name
    if not inspect.isfunction(function):
        return
    parameters = [p for p in inspect.signature(function).parameters if p not in ("self", "cls")]
    section = doc.partition("Parameters\n----------\n")[2].partition("\n\n")[0]
    described = re.findall(r"^([\w, ]+?)(?: : .*)?$", section, re.MULTILINE)
    described = [
        part for line in described if not line.startswith(" ") for part in line.split(", ")
    ]
    assert described == parameters, f"{name}: {described} instead of {parameters}"


@needs_wheel
def test_version_comes_from_the_workspace() -> None:
    assert importlib.metadata.version("slipstick") == ss.__version__
    workspace = HERE.parent.parent / "Cargo.toml"
    if workspace.exists():
        version = re.search(r'^version = "(.*)"', workspace.read_text(), re.MULTILINE)
        assert version is not None and version[1] == ss.__version__


def test_licences_are_those_of_the_repository() -> None:
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        original = HERE.parent.parent / name
        if not original.exists():
            pytest.skip("the package is tested without its repository")
        assert (HERE / name).read_bytes() == original.read_bytes()


def test_import_is_quick_and_light() -> None:
    # processor time, which a busy machine does not change
    code = (
        "import numpy, time, sys; start = time.process_time(); from slipstick import *; "
        "print(time.process_time() - start); "
        "print(*[m for m in ('pandas', 'jax', 'torch', 'pyvista') if m in sys.modules])"
    )
    shown = [
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split("\n")
        for _ in range(3)
    ]
    assert min(float(lines[0]) for lines in shown) < 0.2
    assert shown[0][1] == ""


def test_types_are_strict() -> None:
    pytest.importorskip("mypy", reason="mypy is not installed: types are not checked")
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "-p", "slipstick"],
        cwd=HERE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert checked.returncode == 0, checked.stdout


def test_stubs_are_those_of_the_extension() -> None:
    pytest.importorskip("mypy", reason="mypy is not installed: stubs are not checked")
    checked = subprocess.run(
        [
            sys.executable,
            "-m",
            "mypy.stubtest",
            "slipstick._slipstick",
            "--concise",
            "--mypy-config-file",
            "pyproject.toml",
        ],
        cwd=HERE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_the_reference_is_up_to_date() -> None:
    for package in ("jax", "torch"):
        pytest.importorskip(package, reason=f"{package} is not installed: docs are not checked")
    script = HERE / "api.py"
    if not (HERE.parent.parent / "docs").exists():
        pytest.skip("the package is tested without its repository")
    checked = subprocess.run(
        [sys.executable, str(script), "--check"], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stderr


def test_the_program_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With one iteration instead of forty."""
    page = HERE / "README.md"
    if not page.exists():
        pytest.skip("the package is tested without its repository")
    monkeypatch.chdir(tmp_path)
    found = re.search(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)
    assert found is not None
    code = found[1].replace("problem.optimize(", "problem.optimize(iterations=1, ")
    exec(compile(code, str(page), "exec"), {})
    assert (tmp_path / "picture.png").exists() and (tmp_path / "part.stl").exists()


def test_the_code_of_the_chapter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = HERE.parent.parent / "docs" / "python.md"
    if not page.exists():
        pytest.skip("the package is tested without its repository")
    pytest.importorskip("pandas", reason="pandas is not installed: the chapter is not run")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    blocks = re.findall(r"^```python ?(\w*)\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)
    ran = []
    for needs, code in blocks:
        if needs and not importlib.util.find_spec(needs):
            continue
        exec(compile(code, str(page), "exec"), names)
        ran.append(needs)
    assert ran.count("") >= 6
    assert (tmp_path / "design.png").exists() and (tmp_path / "part.stl").exists()


def test_the_program_starts_without_numpy() -> None:
    """`slipstick --version`, as the entry point of the wheel calls it."""
    code = (
        "import time; start = time.process_time(); import sys; sys.argv[1:] = ['--version']; "
        "from slipstick._program import main; main(); "
        "print(time.process_time() - start, 'numpy' in sys.modules)"
    )
    shown = [
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split()
        for _ in range(3)
    ]
    assert shown[0][:2] == ["slipstick", ss.__version__]
    assert {lines[3] for lines in shown} == {"False"}
    assert min(float(lines[2]) for lines in shown) < 0.1


def test_names_are_found_where_they_are_used() -> None:
    for name in ss.__all__:
        assert getattr(ss, name) is not None
    assert {*ss.__all__, "jax", "torch"} <= set(dir(ss))
    with pytest.raises(AttributeError, match="no attribute 'Cas'"):
        ss.Cas  # noqa: B018
