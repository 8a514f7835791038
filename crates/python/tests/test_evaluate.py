"""`evaluate`, parameters with other values, and studies."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray


def test_evaluate_is_solve_of_the_case_with_this_friction(
    case: ss.Case, problem: ss.Problem, density: NDArray[np.float64]
) -> None:
    before = problem.solve(density)
    found = problem.evaluate(density, friction=[0.0, 0.15])
    for one, friction in zip(found, (0.0, 0.15), strict=True):
        other = case.replace({"contact[0].friction": friction}).build().solve(density)
        assert one.friction == friction and one.error is None and one.path is not None
        assert one.objective == other.objective
        for name, values in other.quantities.items():
            np.testing.assert_array_equal(one.path.quantities[name], values)
    # the problem keeps its own friction
    after = problem.solve(density)
    assert after.objective == before.objective
    assert problem.evaluate(density)[0].objective == before.objective


def test_evaluate_agrees_with_the_program(case: ss.Case, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    case.save(tmp_path / "case.toml")
    program = [sys.executable, "-m", "slipstick"]
    for line in (
        "optimize case.toml --iterations 1 --out start",
        "evaluate case.toml --design start --friction 0.1,0.3 --out table",
    ):
        subprocess.run([*program, *line.split()], cwd=tmp_path, check=True, capture_output=True)
    table = pandas.read_csv(tmp_path / "table" / "evaluate.csv")
    density = ss.open_run(tmp_path / "start").density
    ours = case.build().evaluate(density, friction=[0.1, 0.3]).to_dataframe()
    assert list(ours.columns) == list(table.columns)
    for name in table.columns:
        np.testing.assert_allclose(ours[name], table[name], rtol=1e-14, err_msg=name)


def test_a_path_that_fails_does_not_stop_the_others(case: ss.Case) -> None:
    brittle = case.replace({"dirichlet[1].motion": [{"t": 1.0, "u": [0.0, -3.0, 0.0]}]}).build()
    with pytest.warns(ss.SlipstickWarning, match="with friction"):
        found = brittle.evaluate(friction=[0.1, 0.2])
    assert len(found) == 2 and repr(found) == "<Evaluations with friction 0.1, friction 0.2>"
    with pytest.warns(ss.SlipstickWarning, match="with the friction of the case"):
        assert repr(brittle.evaluate()) == "<Evaluations with the friction of the case>"
    assert all(one.path is None and isinstance(one.error, ss.AnalysisError) for one in found)
    assert found[0].objective is None


def test_wrong_coefficients_are_refused(problem: ss.Problem) -> None:
    with pytest.raises(ValueError, match=r"friction has -0\.1: coefficients are 0 or more"):
        problem.evaluate(friction=[0.1, -0.1])
    with pytest.raises(TypeError, match="friction has dtype"):
        problem.evaluate(friction="high")  # type: ignore[arg-type]


STUDY = """title = "Two frictions"
[[run]]
name = "rough"
command = "optimize"
case = "case.toml"
options = ["--iterations", "1"]
[[run]]
name = "table"
command = "evaluate"
case = "case.toml"
design = "rough"
options = ["--friction", "0.1,0.3"]
"""


def test_a_study(case: ss.Case, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pandas")
    case.save(tmp_path / "case.toml")
    (tmp_path / "pair.toml").write_text(STUDY)
    study = ss.run_study(tmp_path / "pair.toml", only=["rough"], quiet=True)
    assert capfd.readouterr() == ("", "")
    assert list(study.runs) == ["rough"]
    result = study.runs["rough"].open()
    assert result.objective == study.runs["rough"].numbers["objective"]
    study = ss.run_study(tmp_path / "pair.toml", quiet=True)
    assert list(study.runs) == ["rough", "table"]
    expected = case.build().evaluate(result.density, friction=[0.1, 0.3])
    for one in expected:
        assert study.runs["table"].numbers[f"objective at {one.friction}"] == one.objective
    assert study.to_dataframe().loc["table", "objective at 0.1"] == expected[0].objective
    assert study.directory == tmp_path / "pair"


def test_errors_of_studies(case: ss.Case, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no study file"):
        ss.run_study(tmp_path / "none.toml")
    (tmp_path / "wrong.toml").write_text("[[run]]\nname = 'a'\n")
    with pytest.raises(ss.InputError, match="command"):
        ss.run_study(tmp_path / "wrong.toml", quiet=True)
    bad = case.replace({"dirichlet[1].motion": [{"t": 1.0, "u": [0.0, -3.0, 0.0]}]})
    bad.save(tmp_path / "bad.toml")
    case.save(tmp_path / "case.toml")
    (tmp_path / "half.toml").write_text(
        "[[run]]\nname = 'good'\ncommand = 'solve'\ncase = 'case.toml'\n"
        "[[run]]\nname = 'bad'\ncommand = 'solve'\ncase = 'bad.toml'\n"
    )
    with pytest.raises(ss.StudyError, match="1 run failed") as caught:
        ss.run_study(tmp_path / "half.toml", quiet=True)
    assert list(caught.value.study.runs) == ["good"] and caught.value.failed == ["bad"]


@pytest.mark.skipif(sys.platform == "win32", reason="processes cannot send Ctrl-C there")
def test_control_c_stops_a_study(case: ss.Case, tmp_path: Path) -> None:
    """Ctrl-C that only this process receives, as in a notebook, also stops the run."""
    case.replace({"optimizer.iterations": 100_000}).save(tmp_path / "case.toml")
    (tmp_path / "long.toml").write_text(
        "[[run]]\nname = 'one'\ncommand = 'optimize'\ncase = 'case.toml'\n"
    )
    code = (
        "import signal, slipstick as ss\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "try:\n    ss.run_study('long.toml', quiet=True)\n"
        "except KeyboardInterrupt as error:\n    print(error)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    checkpoint = tmp_path / "long" / "one" / "checkpoint.json"
    deadline = time.monotonic() + 60.0
    history = checkpoint.with_name("history.csv")
    # the heading, and an evaluated design
    while not history.exists() or len(history.read_text().splitlines()) < 2:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    shown, _ = process.communicate(timeout=60)
    assert shown == "finished runs are kept; the same call continues\n"
    # the run has ended, too, and can be continued
    assert json.loads((checkpoint.parent / "run.json").read_text())["exit"] == "interrupted"
    done = len(ss.open_run(checkpoint.parent).iterations)
    assert len(ss.resume(checkpoint.parent, iterations=done).iterations) == done + 1


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is a shell script")
def test_a_study_that_is_interrupted_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The program ends with 4 when it is interrupted, whoever interrupts it."""
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\nexit 4\n")
    program.chmod(0o755)
    (tmp_path / "pair.toml").write_text(STUDY)
    monkeypatch.setattr("slipstick.study.sys.executable", str(program))
    with pytest.raises(KeyboardInterrupt, match="finished runs are kept"):
        ss.run_study(tmp_path / "pair.toml", quiet=True)


def test_parameters_are_those_of_a_case_with_these_values(
    case: ss.Case, problem: ss.Problem, density: NDArray[np.float64]
) -> None:
    names = {parameter.name: value for parameter, value in problem.parameters.items()}
    assert names == {
        "contact[0].friction": 0.3,
        "slab.youngs_modulus": 1000.0,
        "block.youngs_modulus": 1000.0,
        "dirichlet[0].motion": 1.0,
        "dirichlet[1].motion": 1.0,
    }
    changed = problem.with_parameters(
        {"contact[0].friction": 0.2, "block.youngs_modulus": 800.0, "dirichlet[1].motion": 0.5}
    )
    same = case.replace(
        {
            "contact[0].friction": 0.2,
            "body[1].material.neo_hooke.youngs_modulus": 800.0,
            "dirichlet[1].motion": [
                {"t": 0.5, "u": [0.0, -0.04, 0.0]},
                {"t": 1.0, "u": [0.075, -0.04, 0.02]},
            ],
        }
    ).build()
    ours, theirs = changed.solve(density), same.solve(density)
    for name, values in theirs.quantities.items():
        np.testing.assert_array_equal(ours.quantities[name], values)
    # amplitudes are factors on the motion of the case, whatever was set before
    again = changed.with_parameters({"dirichlet[1].motion": 1.0, "contact[0].friction": 0.3})
    again = again.with_parameters({"block.youngs_modulus": 1000.0})
    assert again.solve(density).objective == problem.solve(density).objective


def test_modulus_of_rubber() -> None:
    """A law without Young's modulus among its constants: all its moduli change by one factor."""
    text = ss.Case.template("cube-on-cuboid").text
    rubber = "{ ogden = { mu = [600.0, -40.0], alpha = [1.3, -2.0], bulk_modulus = 4000.0 } }"
    steel = "{ neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }"
    problem = ss.Case.from_text(text.replace(steel, rubber)).build()
    modulus = {p.name: value for p, value in problem.parameters.items()}["cube.youngs_modulus"]
    shear = 0.5 * (600.0 * 1.3 + 40.0 * 2.0)
    assert modulus == pytest.approx(9 * 4000.0 * shear / (3 * 4000.0 + shear), rel=1e-14)
    changed = problem.with_parameters({"cube.youngs_modulus": 2.0 * modulus})
    bodies = {body["name"]: body["material"]["ogden"] for body in changed.case.resolved["body"]}
    assert bodies["cube"]["mu"] == pytest.approx([1200.0, -80.0], rel=1e-14)
    assert bodies["cube"]["alpha"] == [1.3, -2.0]
    assert bodies["cube"]["bulk_modulus"] == pytest.approx(8000.0, rel=1e-14)
    assert bodies["cuboid"]["mu"] == [600.0, -40.0]


PARAMETERS = {"contact[0].friction": 0.25, "slab.youngs_modulus": 900.0, "dirichlet[1].motion": 0.9}


@pytest.mark.parametrize("name", PARAMETERS)
def test_derivatives_at_other_values(
    name: str, problem: ss.Problem, density: NDArray[np.float64]
) -> None:
    """Central differences of second order."""
    start = problem.with_parameters(PARAMETERS)
    _, pullback = start.vjp(density, ["drag"])
    weights = {"drag": [0.3, -0.2, 0.5, 1.0]}
    _, found = pullback.with_parameters(weights)
    derivative = next(value for parameter, value in found.items() if parameter.name == name)
    _, _, of_objective = start.value_and_gradient(density, parameters=True)

    def value(factor: float) -> tuple[float, float]:
        changed = start.with_parameters({name: PARAMETERS[name] * factor})
        path = changed.solve(density)
        assert path.objective is not None
        return float(np.dot(weights["drag"], path.quantities["drag"])), path.objective

    objective = next(value for parameter, value in of_objective.items() if parameter.name == name)
    for index, adjoint in enumerate((derivative, objective)):
        errors = []
        for step in (4e-4, 2e-4):
            difference = (value(1 + step)[index] - value(1 - step)[index]) / (2 * step)
            errors.append(abs(difference / PARAMETERS[name] - adjoint) / abs(adjoint))
        assert errors[1] < 1e-6, (index, adjoint, errors)


def test_wrong_parameters_are_refused(problem: ss.Problem) -> None:
    for values, message in (
        ({"contact[1].friction": 0.1}, r"values has 'contact\[1\]\.friction', which is no"),
        ({"contact[0].friction": -0.1}, "a coefficient of friction is 0 or more"),
        ({"slab.youngs_modulus": 0.0}, "a modulus is greater than 0"),
        ({"dirichlet[1].motion": 0.0}, "an amplitude is a factor other than 0"),
        ({"slab.youngs_modulus": float("nan")}, "numbers must be finite"),
    ):
        with pytest.raises(ValueError, match=message):
            problem.with_parameters(values)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="give a dict such as"):
        problem.with_parameters([0.1])  # type: ignore[arg-type]


def test_a_problem_with_other_parameters_has_their_case(case: ss.Case) -> None:
    pressed = {"surface": "slab_xmax", "traction": [0.0, -2.0, 0.0]}
    case = case.replace({"load": [pressed]})
    problem = case.build()
    assert problem.case is case
    values = {
        "contact[0].friction": 0.2,
        "slab.youngs_modulus": 900.0,
        "dirichlet[1].motion": 0.7,
        "load[0]": 1.3,
    }
    changed = problem.with_parameters({"dirichlet[1].motion": 0.3}).with_parameters(values)  # type: ignore[arg-type]
    motion = [
        {"t": 0.5, "u": [0.7 * 0.0, 0.7 * -0.08, 0.7 * 0.0]},
        {"t": 1.0, "u": [0.7 * 0.15, 0.7 * -0.08, 0.7 * 0.04]},
    ]
    same = case.replace(
        {
            "contact[0].friction": 0.2,
            "body[0].material.neo_hooke.youngs_modulus": 900.0,
            "dirichlet[1].motion": motion,
            "load[0].amplitude": [{"t": 1.0, "factor": 1.3}],
        }
    )
    assert changed.case.resolved == same.resolved
    ours, theirs = changed.optimize(iterations=1), same.build().optimize(iterations=1)
    assert ours.iterations == theirs.iterations
    np.testing.assert_array_equal(ours.density, theirs.density)
    assert problem.solve().objective == case.build().solve().objective


BOLTED = """
[[body]]
name = "screw"
box = { min = [0, 0, 0], max = [1, 20, 1], elements = [1, 4, 1] }
material = { linear_elastic = { youngs_modulus = 2000, poisson_ratio = 0 } }
[[body]]
name = "sleeve"
box = { min = [2, 0, 0], max = [4, 20, 3], elements = [2, 4, 2] }
material = { linear_elastic = { youngs_modulus = 2000, poisson_ratio = 0 } }
[[body]]
name = "cap"
box = { min = [0, 20, 0], max = [4, 22, 3], elements = [4, 1, 3] }
rigid = {}
[[contact]]
slave = "screw_ymax"
master = "cap_ymin"
tied = true
[[contact]]
slave = "sleeve_ymax"
master = "cap_ymin"
friction = 0
[[bolt]]
name = "stud"
body = "screw"
section = { point = [0.5, 11, 0.5], normal = [0, 1, 0] }
force = [{ t = 0.5, force = 10 }]
[[dirichlet]]
set = "screw_ymin"
[[dirichlet]]
set = "sleeve_ymin"
[[dirichlet]]
set = "cap"
components = ["x", "z", "rx", "ry", "rz"]
[[load]]
surface = "cap"
force = [0, 7, 0]
amplitude = [{ t = 0.5, factor = 0 }, { t = 1, factor = 1 }]
[[quantity]]
name = "tension"
bolt_force = { bolt = "stud" }
[design]
bodies = ["sleeve"]
volume_fraction = 1
[objective]
maximise = { quantity = "tension" }
[load_path]
steps = 4
"""


def test_the_force_of_a_bolt_is_a_parameter() -> None:
    """By the joint diagram, areas of 1 and 6: the screw takes a seventh of the service load."""
    problem = ss.Case.from_text(BOLTED).build()
    tension = problem.solve().quantities["tension"]
    np.testing.assert_allclose(tension, [5.0, 10.0, 10.5, 11.0], rtol=1e-6)
    tighter = problem.with_parameters({"bolt[0].force": 1.2})
    assert tighter.case.resolved["bolt"][0]["force"] == [{"t": 0.5, "force": 12.0}]
    np.testing.assert_allclose(tighter.solve().quantities["tension"][-1], 13.0, rtol=1e-6)
    _, pullback = problem.vjp(names=["tension"])
    _, parameters = pullback.with_parameters({"tension": [0, 0, 0, 1]})
    derivatives = {parameter.name: derivative for parameter, derivative in parameters.items()}
    assert derivatives["bolt[0].force"] == pytest.approx(10.0, rel=1e-6)
    # the kept length gives way by a few millionths
    assert derivatives["load[0]"] == pytest.approx(1.0, rel=1e-5)
    with pytest.raises(ValueError, match="a bolt pulls its parts together"):
        problem.with_parameters({"bolt[0].force": -1.0})
