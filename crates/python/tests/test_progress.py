"""Progress of optimizations: the remaining time, and what terminals, notebooks and files show."""

from __future__ import annotations

import re
import sys
from typing import Any

import pytest
import slipstick as ss
from slipstick import _progress
from slipstick._progress import IterationBar, Notebook, Outlook, duration


class Clock:
    """Seconds that pass when told."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def plan(iterations: int, scheduled: int = 0, **stop: float) -> dict[str, Any]:
    return {"iterations": iterations, "scheduled": scheduled, "stop": stop}


def test_the_remaining_time_is_that_of_the_recent_designs() -> None:
    clock = Clock()
    outlook = Outlook(clock)
    assert outlook.remaining is None
    # the first designs are slow, after a minute of building
    clock.now += 60.0
    for number in range(12):
        seconds = 10.0 if number < 6 else 2.0
        clock.now += seconds
        outlook.evaluated({"iteration": number}, seconds, plan(20))
        if number == 0:
            assert outlook.remaining == pytest.approx(20 * 10.0)
    # iterations 12 to 20 at 2 s each, as far as the present one has not used them
    assert outlook.remaining == pytest.approx(9 * 2.0)
    clock.now += 1.5
    assert outlook.remaining == pytest.approx(9 * 2.0 - 1.5)


def test_criteria_for_stopping_end_the_trend() -> None:
    """A change that is halved by every update reaches 0.01 = 0.5^n between n = 6 and 7."""
    clock = Clock()
    outlook = Outlook(clock)
    for number in range(5):
        clock.now += 1.0
        record = {"iteration": number, "change": 0.5**number, "optimality": None}
        outlook.evaluated(record, 1.0, plan(100, change=0.01))
    # met in iteration 7, and the design after it is the last
    assert outlook.last == 8 and outlook.remaining == pytest.approx(4.0)
    # nothing stops before the schedule ends, and never after the last update
    outlook.evaluated({"iteration": 5, "change": 0.5**5}, 1.0, plan(100, 30, change=0.01))
    assert outlook.last == 31
    outlook.evaluated({"iteration": 6, "change": 0.5**6}, 1.0, plan(7, change=0.01))
    assert outlook.last == 7
    # a criterion without a trend promises nothing
    outlook.evaluated({"iteration": 7, "change": 0.5**7}, 1.0, plan(100, optimality=1e-3))
    assert outlook.last == 100


def test_durations() -> None:
    found = [duration(seconds) for seconds in (0.0312, 5.25, 59.4, 187.0, 3729.0)]
    assert found == ["0.031 s", "5.2 s", "59 s", "3:07 min", "1:02:09 h"]


def test_a_terminal_shows_iterations_and_time(
    case: ss.Case, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "90")
    case.build().optimize(progress=True)
    lines = capsys.readouterr().err.split("\r")
    assert all(len(line.rstrip("\n")) <= 89 for line in lines) and lines[-1].endswith("\n")
    assert any(
        re.search(r"iteration 2/3, θ -[\d.]+, step 3/4, [\d.]+ s each", line) for line in lines
    )
    assert re.search(r"\[#+\] iteration 3/3, θ .*, 0 s to go", lines[-1]), lines[-1]


def test_a_file_has_a_line_per_design(
    case: ss.Case, capsys: pytest.CaptureFixture[str], tmp_path: Any
) -> None:
    case.build().optimize(progress=True, directory=tmp_path / "run", iterations=2)
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in lines] == [f"iteration {k}/2" for k in range(3)]
    ss.resume(tmp_path / "run", iterations=3, progress=True)
    # the last design is evaluated again for its update
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in lines] == ["iteration 2/3", "iteration 3/3"]
    case.build().optimize(iterations=1)
    assert not capsys.readouterr().err


def test_a_notebook_updates_one_output(case: ss.Case, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[dict[str, str]] = []

    class Handle:
        def update(self, data: dict[str, str], raw: bool) -> None:
            assert raw
            shown.append(data)

    def display(data: dict[str, str], raw: bool, display_id: bool) -> Handle:
        assert raw and display_id and not shown
        shown.append(data)
        return Handle()

    monkeypatch.setattr(_progress, "_screen", lambda: Notebook(display))
    case.build().optimize(progress=True)
    assert shown[-1]["text/plain"].startswith("iteration 3/3, θ ")
    assert '<progress value="1.0000" max="1">' in shown[-1]["text/html"]
    with IterationBar(False, 4, "iteration") as bar:
        assert bar.report is None and not bar.shown
