"""The program that the wheel installs."""

from __future__ import annotations

import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest
import slipstick as ss
from conftest import needs_wheel

pytestmark = needs_wheel

PROGRAM = Path(sysconfig.get_path("scripts")) / "slipstick"


def run(*words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(PROGRAM), *words], capture_output=True, text=True, check=False, cwd=cwd
    )


def test_it_is_installed() -> None:
    shown = run("--version")
    assert (shown.returncode, shown.stdout) == (0, f"slipstick {ss.__version__}\n")
    assert "Usage: slipstick" in run("--help").stdout


def test_exit_codes(tmp_path: Path) -> None:
    assert run("no-such-command").returncode == 2
    missing = run("solve", str(tmp_path / "nothing.toml"))
    assert missing.returncode == 2 and "cannot read the case file" in missing.stderr
    assert run("new", "cube-on-cuboid", cwd=tmp_path).returncode == 0
    solved = run("solve", "cube_on_cuboid.toml", cwd=tmp_path)
    assert solved.returncode == 0 and "Newton iterations" in solved.stdout


def test_studies_start_the_program_again(tmp_path: Path) -> None:
    assert run("new", "cube-on-cuboid", cwd=tmp_path).returncode == 0
    study = """
[[run]]
name = "rough"
case = "cube_on_cuboid.toml"
command = "solve"
"""
    (tmp_path / "study.toml").write_text(study)
    done = run("study", "study.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
def test_control_c_ends_it_with_its_own_code(tmp_path: Path, long_case: ss.Case) -> None:
    long_case.save(tmp_path / "case.toml")
    process = subprocess.Popen(
        [str(PROGRAM), "solve", "case.toml", "--json"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    for line in process.stdout:
        if '"step"' in line:
            break
    process.send_signal(signal.SIGINT)
    start = time.monotonic()
    _, complaint = process.communicate(timeout=30)
    assert process.returncode == 4 and time.monotonic() - start < 10
    assert "Traceback" not in complaint and "stopping when" in complaint
