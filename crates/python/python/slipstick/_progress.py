"""Progress bars: those of tqdm where it is installed, otherwise a line on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import TracebackType
from typing import Any

Report = Callable[[int, int, "list[int]"], None]
"""Called after each (sub-)step with the steps so far, Newton iterations, and open, stick, slip."""


class Bar:
    """A bar over load steps, as a context manager; ``report`` is None if it is switched off."""

    def __init__(self, shown: bool, steps: int, what: str) -> None:
        self._bar: Any = None
        self._what = what
        # 0: unknown
        self._of = f" of {steps}" if steps else ""
        self.report: Report | None = None
        if not shown:
            return
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self.report = self._line
        else:
            self._bar = tqdm(total=steps or None, desc=what, unit="step")
            self.report = self._update

    def _update(self, step: int, iterations: int, status: list[int]) -> None:
        self._bar.n = step
        self._bar.set_postfix_str(_words(iterations, status))

    def _line(self, step: int, iterations: int, status: list[int]) -> None:
        text = f"{self._what}: step {step}{self._of}, {_words(iterations, status)}"
        print(f"\r{text:<78}", end="", file=sys.stderr, flush=True)

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()
        elif self.report is not None:
            print(file=sys.stderr)


def _words(iterations: int, status: list[int]) -> str:
    opened, stick, slip = status
    return f"Newton {iterations}, open {opened}, stick {stick}, slip {slip}"
