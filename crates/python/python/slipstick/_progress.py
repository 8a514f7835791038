"""Progress of analyses and of optimizations, in terminals, notebooks and files."""

from __future__ import annotations

import html
import math
import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any

Report = Callable[[int, int, "list[int]"], None]
"""Called after each (sub-)step with the steps so far, Newton iterations, and open, stick, slip."""

# the recent designs from which times and trends are taken
RECENT = 5


class Bar:
    """A bar over load steps, as a context manager; ``report`` is None if it is switched off.

    It is that of tqdm where it is installed, otherwise a line on a terminal.
    """

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


class Outlook:
    """How long an optimization still takes, from the designs so far.

    An optimization with N updates evaluates N + 1 designs. One that stops earlier, when the change,
    the optimality residual and the discreteness have fallen to their bounds, is expected to do so
    where the recent trends reach them.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._ends = [clock()]
        self._records: list[Mapping[str, Any]] = []
        self._plan: Mapping[str, Any] = {}

    def evaluated(self, record: Mapping[str, Any], seconds: float, plan: Mapping[str, Any]) -> None:
        """A design was evaluated and updated in this time."""
        now = self._clock()
        if not self._records:
            # what was built before it does not come again
            self._ends = [now - seconds]
        self._records.append(record)
        self._plan = plan
        self._ends.append(now)

    @property
    def updates(self) -> int | None:
        """The most updates; None before the first design."""
        return self._plan.get("iterations")

    @property
    def pace(self) -> float | None:
        """Seconds for each of the recent designs."""
        recent = self._ends[-RECENT - 1 :]
        return (recent[-1] - recent[0]) / (len(recent) - 1) if len(recent) > 1 else None

    @property
    def last(self) -> int | None:
        """The expected number of the last design; None before the first design."""
        if self.updates is None:
            return None
        now = self._records[-1]["iteration"]
        bounds = {name: bound for name, bound in self._plan["stop"].items() if bound is not None}
        if not bounds:
            return self.updates
        reached = [self._reaches(name, bound) for name, bound in bounds.items()]
        # the design after the one that meets all criteria is the last
        stops = max(max(reached), self._plan["scheduled"], now) + 1
        return self.updates if math.isinf(stops) else min(self.updates, math.ceil(stops))

    def _reaches(self, name: str, bound: float) -> float:
        """Where the logarithms of the recent values, on a line, reach that of a bound."""
        points: list[tuple[int, float]] = [
            (record["iteration"], record[name])
            for record in self._records[-2 * RECENT :]
            if record.get(name) is not None
        ]
        if not points:
            return math.inf
        at, value = points[-1]
        if value <= bound:
            return float(at)
        if bound <= 0.0 or len(points) < 3 or min(value for _, value in points) <= 0.0:
            return math.inf
        logs = [math.log(value) for _, value in points]
        middle, mean = sum(x for x, _ in points) / len(points), sum(logs) / len(points)
        slope = sum((x - middle) * (y - mean) for (x, _), y in zip(points, logs, strict=True))
        slope /= sum((x - middle) ** 2 for x, _ in points)
        return at + math.log(bound / value) / slope if slope < 0.0 else math.inf

    @property
    def remaining(self) -> float | None:
        """Seconds to go, less those spent on the present design; None before the first design."""
        if self.pace is None or self.last is None:
            return None
        designs = self.last - self._records[-1]["iteration"]
        spent = self._clock() - self._ends[-1]
        # a design that takes longer than the recent ones still takes some time
        return max(self.pace * designs - spent, 0.0) if designs > 0 else 0.0


class IterationBar:
    """Iterations of an optimization with the remaining time, as a context manager.

    A line that is overwritten on a terminal, a bar in a notebook, otherwise a line per design.
    """

    def __init__(self, shown: bool, steps: int, what: str) -> None:
        self._what = what
        self._steps = steps
        self._outlook = Outlook()
        self._latest: Mapping[str, Any] | None = None
        self._screen: Screen | None = _screen() if shown else None
        self.report: Report | None = self._reported if shown else None

    @property
    def shown(self) -> bool:
        """Whether it is not switched off."""
        return self._screen is not None

    def evaluated(self, record: Mapping[str, Any], seconds: float, plan: Mapping[str, Any]) -> None:
        """Called after each design."""
        self._latest = record
        self._outlook.evaluated(record, seconds, plan)
        if self._screen is not None:
            self._screen.show(self._fraction(0), self._text(0), True)

    def _reported(self, step: int, iterations: int, status: list[int]) -> None:
        if self._screen is not None:
            self._screen.show(self._fraction(step), self._text(step), False)

    def _fraction(self, step: int) -> float:
        last = self._outlook.last
        if last is None or self._latest is None:
            return 0.0
        done = self._latest["iteration"] + 1 + (step / self._steps if self._steps else 0.0)
        return float(min(done / (last + 1), 1.0))

    def _text(self, step: int) -> str:
        outlook = self._outlook
        # within a design, its own number
        number = 0 if self._latest is None else self._latest["iteration"] + (step > 0)
        of = "" if outlook.updates is None else f"/{outlook.updates}"
        if outlook.updates is not None:
            # the path of a result that is not the last design follows the last one
            number = min(number, outlook.updates)
        parts = [f"{self._what} {number}{of}"]
        if self._latest is not None:
            parts.append(f"θ {self._latest['objective']:.6g}")
        if step:
            parts.append(f"step {step}" + (f"/{self._steps}" if self._steps else ""))
        if outlook.pace is not None:
            parts.append(f"{duration(outlook.pace)} each")
        if outlook.remaining is not None:
            parts.append(f"{duration(outlook.remaining)} to go")
        return ", ".join(parts)

    def __enter__(self) -> IterationBar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._screen is not None:
            self._screen.close()


def duration(seconds: float) -> str:
    """A time in words of two digits or more: 0.52 s, 12 s, 3:07 min, 1:02:09 h."""
    if seconds < 10.0:
        return f"{seconds:.2g} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes == 0:
        return f"{rest} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02} h" if hours else f"{minutes}:{rest:02} min"


class Screen:
    """Where progress is shown; this one writes a line per design, as to a file."""

    def show(self, fraction: float, text: str, whole: bool) -> None:
        """Shows a fraction and text; ``whole`` after a design, otherwise within one."""
        if whole:
            print(text, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Nothing is shown after this."""


class Terminal(Screen):
    """A line that is overwritten."""

    def show(self, fraction: float, text: str, whole: bool) -> None:
        width = shutil.get_terminal_size().columns - 1
        bar = max(0, min(24, width - len(text) - 3))
        full = round(fraction * bar)
        line = f"[{'#' * full}{'-' * (bar - full)}] {text}" if bar > 4 else text
        print(f"\r{line[:width]:<{width}}", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        print(file=sys.stderr)


class Notebook(Screen):
    """A bar in the output of a cell, which needs no widgets."""

    # pages are redrawn at most this often
    PAUSE = 0.2

    def __init__(self, display: Callable[..., Any]) -> None:
        self._display = display
        self._handle: Any = None
        self._shown = -math.inf
        self._last: Sequence[Any] = ()

    def show(self, fraction: float, text: str, whole: bool) -> None:
        self._last = (fraction, text)
        if not whole and time.monotonic() - self._shown < self.PAUSE:
            return
        self._draw()

    def _draw(self) -> None:
        if not self._last:
            return
        fraction, text = self._last
        page = f'<progress value="{fraction:.4f}" max="1"></progress> {html.escape(text)}'
        data = {"text/html": page, "text/plain": text}
        if self._handle is None:
            self._handle = self._display(data, raw=True, display_id=True)
        else:
            self._handle.update(data, raw=True)
        self._shown = time.monotonic()

    def close(self) -> None:
        self._draw()


def _screen() -> Screen:
    # only a running kernel has imported this module
    kernel = sys.modules.get("ipykernel")
    shell = sys.modules.get("IPython")
    if kernel is not None and shell is not None and shell.get_ipython() is not None:
        from IPython.display import display

        return Notebook(display)
    return Terminal() if sys.stderr.isatty() else Screen()
