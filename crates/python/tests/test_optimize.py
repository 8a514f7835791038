"""Optimizations: their files are those of the program, and they resume bit for bit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import ArrayLike
from test_behaviour import ControlC
from test_solve import program


def test_an_optimization_is_that_of_the_program(case: ss.Case, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    case.save(file)
    program("optimize", str(file), "--out", str(tmp_path / "program"))
    seen: list[ss.Iteration] = []
    result = (
        ss.Case.load(file).build().optimize(directory=tmp_path / "package", callback=seen.append)
    )
    theirs = ss.open_run(tmp_path / "program")
    assert np.array_equal(result.density, theirs.density)
    assert list(result.iterations) == list(theirs.iterations)
    assert [it.iteration for it in seen] == [0, 1, 2, 3] and all(it.seconds for it in seen)
    assert [it.objective for it in seen] == [it.objective for it in result.iterations]
    assert result.objective == seen[-1].objective < seen[0].objective
    names = ["design.csv", "quantities.csv", "path.pvd", "case.toml"]
    for name in names:
        assert (result.directory / name).read_bytes() == (theirs.directory / name).read_bytes(), (
            name
        )
    record = json.loads((result.directory / "run.json").read_text())
    assert record["exit"] == "finished"


def test_a_stopped_optimization_resumes_bit_for_bit(case: ss.Case, tmp_path: Path) -> None:
    whole = case.build().optimize(directory=tmp_path / "whole")

    def stop(iteration: ss.Iteration) -> None:
        if iteration.iteration == 1:
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        case.build().optimize(directory=tmp_path / "parts", callback=stop)
    record = json.loads((tmp_path / "parts" / "run.json").read_text())
    assert record["exit"] == "interrupted" and "stop" in record["message"]
    resumed = ss.resume(tmp_path / "parts")
    assert np.array_equal(resumed.density, whole.density)
    assert list(resumed.iterations) == list(whole.iterations)
    further = ss.resume(tmp_path / "parts", iterations=4)
    assert len(further.iterations) == 5
    # a complete run has nothing left to do
    assert np.array_equal(ss.resume(tmp_path / "parts").density, further.density)


def test_control_c_keeps_finished_iterations(tmp_path: Path) -> None:
    case = ss.Case.template("half-ball").replace(
        {"load_path.steps": 5, "optimizer.iterations": 100}
    )
    with ControlC(8.0) as control, pytest.raises(KeyboardInterrupt, match="slipstick.resume"):
        case.build().optimize(directory=tmp_path / "run")
    assert control.late < 5.0
    assert ss.open_run(tmp_path / "run").iterations
    assert json.loads((tmp_path / "run" / "run.json").read_text())["exit"] == "interrupted"


def test_an_optimization_that_ends_before_its_first_design_leaves_nothing(
    problem: ss.Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Interrupted(ss.Quantity):
        armed = False

        def value(self, state: ss.State) -> float:
            if self.armed:
                raise KeyboardInterrupt
            return 0.0

        def derivative(self, state: ss.State) -> dict[str, ArrayLike]:
            return {}

    class Armed(Interrupted):
        """Raises after its derivatives have been compared."""

        calls = 0

        def value(self, state: ss.State) -> float:
            self.calls += 1
            self.armed = self.calls > self.compared
            return super().value(state)

        compared = 10**9

    quantity = Armed()
    problem.add(quantity)
    # an optimization compares as often as `add`
    quantity.compared = 2 * quantity.calls
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(KeyboardInterrupt, match="no iteration has finished"):
        problem.optimize(objective="Armed")
    assert list(tmp_path.iterdir()) == []


def test_the_command_is_recorded(
    problem: ss.Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["design.py", "--fast"])
    problem.optimize(iterations=1, directory=tmp_path / "run")
    ss.resume(tmp_path / "run", iterations=2)
    record = json.loads((tmp_path / "run" / "run.json").read_text())
    for part in (record, *record["earlier"]):
        assert part["command"] == ["python", "design.py", "--fast"]


def test_history_is_a_table(problem: ss.Problem) -> None:
    pandas = pytest.importorskip("pandas")
    history = problem.optimize(iterations=2).history
    assert isinstance(history, pandas.DataFrame) and list(history.index) == [0, 1, 2]
    assert np.all(history["volume_fraction"] <= 0.5 + 1e-6) and "slip" in history


def test_a_temporary_directory_lives_as_long_as_the_result(problem: ss.Problem) -> None:
    result = problem.optimize(iterations=1)
    directory = result.directory
    assert (directory / "checkpoint.json").exists()
    del result
    assert not directory.exists()


def test_a_start_of_ones_own(problem: ss.Problem, tmp_path: Path) -> None:
    start = problem.initial_density
    start[problem.designed] = np.linspace(0.3, 0.7, len(problem.designed))
    result = problem.optimize(start, iterations=1, directory=tmp_path / "run")
    assert np.allclose(result.density_of(0), start)
    assert result.iterations[0].objective == problem.solve(start).objective


def test_a_start_on_a_finer_mesh(problem: ss.Problem, case: ss.Case, tmp_path: Path) -> None:
    result = problem.optimize(iterations=2, directory=tmp_path / "run")
    assert np.array_equal(problem.load_design(tmp_path / "run"), result.density)
    assert np.array_equal(problem.load_design(tmp_path / "run" / "design.csv", variables=True), result.density)
    finer = case.replace({"body[0].box.elements": [8, 1, 2]}).build()
    mapped = finer.load_design(tmp_path / "run")
    # the slab has 4 × 1 × 2 elements, numbered along x first: the halves of an element are neighbours
    assert np.allclose(mapped[:16], np.repeat(result.density[:8], 2), rtol=0, atol=1e-12)
    with pytest.raises(ss.InputError, match="is not an element|is missing|belongs to body"):
        finer.load_design(tmp_path / "run" / "design.csv")


def test_directories_of_runs_are_protected(problem: ss.Problem, tmp_path: Path) -> None:
    problem.optimize(iterations=1, directory=tmp_path / "run")
    with pytest.raises(ss.InputError, match="already contains the results of a run"):
        problem.optimize(iterations=1, directory=tmp_path / "run")
    problem.optimize(iterations=1, directory=tmp_path / "run", overwrite=True)
    with pytest.raises(ss.InputError, match="there is no run.json"):
        ss.resume(tmp_path)
    with pytest.raises(ss.InputError):
        ss.open_run(tmp_path / "nothing")


def test_pictures_pages_and_surfaces(problem: ss.Problem, tmp_path: Path) -> None:
    result = problem.optimize(iterations=1)
    picture = result.render(tmp_path / "picture.png", size=(320, 240))
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert result.render(
        tmp_path / "pressure.png", field="pressure", step=4, size=(320, 240)
    ).exists()
    page = result.report(tmp_path / "report.html")
    assert "<html" in page.read_text(encoding="utf-8")[:500]
    for name in ("part.stl", "part.3mf", "part.obj", "part.vtu", "part.step"):
        assert result.export(tmp_path / name, threshold=0.1).stat().st_size > 100
    with pytest.raises(FileExistsError, match="overwrite=True"):
        result.report(tmp_path / "report.html")
    with pytest.raises(ValueError, match=r"ends in \.png"):
        result.render(tmp_path / "picture.jpg")
    with pytest.raises(ss.InputError, match="no field `nothing`") as caught:
        result.render(tmp_path / "other.png", field="nothing")
    assert "available fields" in caught.value.help


def test_void_that_is_rescued_is_warned_of(tmp_path: Path) -> None:
    crushed = {
        "body": [
            {
                "name": "block",
                "box": {"min": [0, 0, 0], "max": [1, 1.5, 1], "elements": [2, 3, 2]},
                "material": {"neo_hooke": {"youngs_modulus": 1000.0, "poisson_ratio": 0.3}},
            }
        ],
        "dirichlet": [
            {"set": "block_ymin"},
            {"set": "block_ymax", "motion": [{"t": 1.0, "u": [0.5, -0.6, 0.0]}]},
        ],
        "load_path": {"steps": 1, "max_cutbacks": 0},
        "design": {
            "bodies": ["block"],
            "initial": 0.6,
            "passive_void": [{"min": [0, 0.5, 0], "max": [1, 1, 1]}],
            "volume_fraction": 0.6,
        },
        "quantity": [{"name": "push", "reaction": {"set": "block_ymax", "component": "y"}}],
        "objective": {"minimise": {"quantity": "push"}},
        "optimizer": {"iterations": 1},
    }
    problem = ss.Case.from_dict(crushed, name="crushed.toml").build()
    told = r"from iteration 0 on, void follows linear elasticity\n.*energy_interpolation = \{\}"
    with pytest.warns(ss.SlipstickWarning, match=told) as warnings:
        problem.optimize(directory=tmp_path / "run")
    assert sum("linear elasticity" in str(warning.message) for warning in warnings) == 1
    # the run keeps it, with its remedy, for the report
    kept = json.loads((tmp_path / "run" / "warnings.json").read_text())
    (about_void,) = [one for one in kept if "linear elasticity" in one["message"]]
    assert "energy_interpolation" in about_void["help"] and "of_result" not in about_void


def test_a_design_that_violates_its_constraints_is_warned_of(
    case: ss.Case, tmp_path: Path
) -> None:
    """One update with a move limit of 0.1 cannot lead to a tenth of the material."""
    small = case.replace({"design.volume_fraction": 0.1, "design.initial": 0.5})
    with pytest.warns(ss.SlipstickWarning, match="violates its constraints"):
        result = small.build().optimize(directory=tmp_path / "run", iterations=1)
    kept = json.loads((result.directory / "warnings.json").read_text())
    assert [one["of_result"] for one in kept if "violates its constraints" in one["message"]] == [
        True
    ]
