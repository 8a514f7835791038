"""Ctrl-C, threads, memory, and what happens when callbacks fail."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray


class ControlC:
    """Sends the signal of Ctrl-C to this process after a while."""

    def __init__(self, delay: float) -> None:
        self._timer = threading.Timer(delay, lambda: signal.raise_signal(signal.SIGINT))
        self.delay = delay

    def __enter__(self) -> ControlC:
        self.start = time.monotonic()
        self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()

    @property
    def late(self) -> float:
        return time.monotonic() - self.start - self.delay


def test_control_c_stops_a_march(long_case: ss.Case) -> None:
    problem = long_case.build()
    for call in (problem.solve, problem.value_and_gradient, problem.check_gradient):
        with ControlC(0.5) as control, pytest.raises(KeyboardInterrupt):
            call()
        assert control.late < 2.0


def test_control_c_stops_a_sweep() -> None:
    """The march is complete before; what is left is several seconds of sweeping."""
    case = ss.Case.template("half-ball").replace({"load_path.steps": 40, "adjoint.memory": "0"})
    text = case.text + '\n[[quantity]]\nname = "energy"\nstrain_energy = {}\n'
    _, pullback = ss.Case.from_text(text).build().vjp(names="energy")
    start = time.monotonic()
    pullback({"energy": np.ones(40)})
    whole = time.monotonic() - start
    with ControlC(0.1 * whole) as control, pytest.raises(KeyboardInterrupt):
        pullback({"energy": np.ones(40)})
    assert control.late < 0.5 * whole


def test_the_interpreter_is_free_during_a_march(long_case: ss.Case) -> None:
    problem = long_case.build()
    ticks = 0
    done = threading.Event()

    def count() -> None:
        nonlocal ticks
        while not done.wait(0.01):
            ticks += 1

    counter = threading.Thread(target=count)
    counter.start()
    try:
        with ControlC(1.0), pytest.raises(KeyboardInterrupt):
            problem.solve()
    finally:
        done.set()
        counter.join()
    assert ticks > 20


def test_two_problems_in_two_threads(case: ss.Case) -> None:
    cases = [case, case.replace({"contact[0].friction": 0.1})]
    alone = [one.build().value_and_gradient() for one in cases]
    found: list[list[tuple[float, NDArray[np.float64]]]] = [[], []]

    def work(number: int) -> None:
        problem = cases[number].build()
        found[number] += [problem.value_and_gradient() for _ in range(5)]

    threads = [threading.Thread(target=work, args=(number,)) for number in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for (value, gradient), all_found in zip(alone, found, strict=True):
        assert len(all_found) == 5
        assert all(v == value and np.array_equal(g, gradient) for v, g in all_found)


def test_one_problem_in_two_threads(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    expected = [problem.value_and_gradient()[0], problem.value_and_gradient(density)[0]]
    assert expected[0] != expected[1]
    found: list[list[float]] = [[], []]

    def work(number: int) -> None:
        at = [None, density][number]
        found[number] += [problem.value_and_gradient(at)[0] for _ in range(5)]

    threads = [threading.Thread(target=work, args=(number,)) for number in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [[expected[0]] * 5, [expected[1]] * 5]


def test_control_c_stops_waiting_for_another_thread(problem: ss.Problem) -> None:
    entered, leave = threading.Event(), threading.Event()

    class Slow(ss.Quantity):
        def value(self, state: ss.State) -> float:
            if threading.current_thread() is not threading.main_thread():
                entered.set()
                leave.wait(20.0)
            return 0.0

        def derivative(self, state: ss.State) -> dict[str, NDArray[np.float64]]:
            return {}

    problem.add(Slow())
    busy = threading.Thread(target=lambda: problem.vjp(names="Slow"))
    busy.start()
    assert entered.wait(10.0)
    try:
        with ControlC(0.5) as control, pytest.raises(KeyboardInterrupt):
            problem.solve()
        assert control.late < 2.0
    finally:
        leave.set()
        busy.join()


def test_results_do_not_depend_on_the_number_of_threads(case: ss.Case, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    case.save(file)
    code = (
        "import sys, slipstick as ss; ss.set_threads(int(sys.argv[1])); "
        "assert ss.threads() == int(sys.argv[1]); "
        "value, gradient = ss.Case.load(sys.argv[2]).build().value_and_gradient(); "
        "print(value.hex(), gradient.tobytes().hex())"
    )
    shown = [
        subprocess.run(
            [sys.executable, "-c", code, threads, str(file)],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in ("1", "3")
    ]
    assert shown[0] == shown[1] and len(shown[0]) > 100


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_memory_does_not_grow(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    def resident() -> int:
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")

    def work(times: int) -> None:
        for _ in range(times):
            path = problem.solve(density)
            assert path.steps[-1].contact.pressure.size and path.quantities["grip"].size
            _, pullback = problem.vjp(density, "grip")
            pullback({"grip": np.ones(4)})

    work(30)
    before = resident()
    work(100)
    # a path of this problem alone has 10 kB; 100 of them would be 1 MB, and the factors far more
    assert resident() - before < 1_000_000


def test_exceptions_of_callbacks_come_through(problem: ss.Problem, tmp_path: Path) -> None:
    class Enough(Exception):
        pass

    def stop(iteration: ss.Iteration) -> None:
        if iteration.iteration == 1:
            raise Enough("after two designs")

    with pytest.raises(Enough, match="after two designs"):
        problem.optimize(directory=tmp_path / "run", callback=stop)
    assert len(ss.open_run(tmp_path / "run").iterations) == 2
