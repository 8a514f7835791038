"""Objectives, constraints and design maps of one's own."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import slipstick as ss
from conftest import DRAGGED
from numpy.typing import NDArray


class Stretch(ss.Quantity):
    """The mean square of the displacements in y."""

    unit = "L²"

    def value(self, state: ss.State) -> float:
        return float(np.mean(state.displacement[:, 1] ** 2))

    def derivative(self, state: ss.State) -> Mapping[str, NDArray[np.float64]]:
        derivative = np.zeros_like(state.displacement)
        derivative[:, 1] = 2.0 * state.displacement[:, 1] / len(derivative)
        return {"displacement": derivative}


def test_an_objective_of_quantities_is_that_of_a_case(case: ss.Case) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    sum_ = [{"quantity": "grip"}, {"quantity": "drag", "weight": 0.5}]
    bounds = [{"quantity": "drag", "min": -60.0, "steps": "all"}]
    tables = {**DRAGGED, "objective": {"maximise": {"sum": sum_, "steps": "all"}}}
    theirs = ss.Case.from_dict({**tables, "constraint": bounds}).build().optimize(iterations=2)
    ours = case.build().optimize(
        objective=[ss.Term("grip", -1.0, "all"), ss.Term("drag", -0.5, "all")],
        constraints=[ss.Bound("drag", min=-60.0, steps="all")],
        iterations=2,
    )
    np.testing.assert_array_equal(ours.density, theirs.density)
    assert ours.iterations == theirs.iterations
    assert list(ours.history.columns) == list(theirs.history.columns)


def test_a_quantity_of_ones_own_is_minimised(problem: ss.Problem) -> None:
    problem.add(Stretch())
    start = problem.vjp(names="Stretch")[0]["Stretch"]
    result = problem.optimize(objective="Stretch", iterations=3)
    values = [iteration.objective for iteration in result.iterations]
    assert values[0] == start[-1]
    assert values[-1] < 0.99 * values[0]
    # an optimization marches from the states of the previous design
    last = problem.vjp(result.density, "Stretch")[0]["Stretch"][-1]
    assert last == pytest.approx(values[-1], rel=1e-12)
    both = problem.optimize(
        objective=[ss.Term("Stretch", 2.0, [1, 2]), ss.Term("grip", -1e-3)], iterations=1
    )
    grip = problem.vjp(names="grip")[0]["grip"]
    expected = 2.0 * start[:2].sum() - 1e-3 * grip[-1]
    assert both.iterations[0].objective == pytest.approx(expected, rel=1e-13)


def test_constraints_of_ones_own(problem: ss.Problem) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    problem.add(Stretch())
    start = problem.vjp(names=["Stretch", "grip"])[0]
    bounds = [
        ss.Bound("Stretch", max=0.98 * start["Stretch"][-1]),
        ss.Bound("grip", min=0.5 * start["grip"][2], max=10 * start["grip"][3], steps=[3, 4]),
    ]
    result = problem.optimize(constraints=bounds, iterations=6)
    columns = list(result.history.columns)
    assert "Stretch" in columns and {"grip_max_3", "grip_min_4"} <= set(columns)
    history = result.history
    assert history["Stretch"].iloc[0] == start["Stretch"][-1]
    assert history["violation"].iloc[0] > 0.01
    assert history["violation"].iloc[-1] < 0.2 * history["violation"].iloc[0]
    first = problem.optimize(iterations=1).iterations[0]
    assert result.iterations[0].objective == first.objective, "the case's objective is kept"


def test_an_optimization_with_its_own_objective_is_resumed(
    problem: ss.Problem, tmp_path: Path
) -> None:
    problem.add(Stretch())
    bound = ss.Bound("grip", min=0.0)
    whole = problem.optimize(objective="Stretch", constraints=[bound], iterations=3)
    directory = tmp_path / "run"
    problem.optimize(objective="Stretch", constraints=[bound], iterations=1, directory=directory)
    record = json.loads((directory / "responses.json").read_text())
    assert record["quantities"] == ["Stretch"]
    with pytest.raises(ValueError, match="quantities lacks Stretch"):
        ss.resume(directory, iterations=3)
    # the program does not know the objective
    program = [sys.executable, "-m", "slipstick", "resume", str(directory), "--iterations", "3"]
    refused = subprocess.run(program, capture_output=True, text=True, check=False)
    assert refused.returncode == 2 and "case.toml" in refused.stderr
    resumed = ss.resume(directory, iterations=3, quantities=[Stretch()])
    np.testing.assert_array_equal(resumed.density, whole.density)
    # another run in the same directory has the case's objective again
    problem.optimize(iterations=1, directory=directory, overwrite=True)
    assert len(ss.resume(directory, iterations=2).iterations) == 3


def test_exceptions_of_a_quantity_stop_an_optimization(problem: ss.Problem) -> None:
    class Failing(Stretch):
        armed = False

        def value(self, state: ss.State) -> float:
            if self.armed:
                raise RuntimeError("no more")
            return super().value(state)

    quantity = Failing()
    problem.add(quantity)

    def arm(iteration: ss.Iteration) -> None:
        quantity.armed = iteration.iteration == 1

    with pytest.raises(RuntimeError, match="no more"):
        problem.optimize(objective="Failing", iterations=3, callback=arm)


def test_wrong_objectives_and_constraints_are_named(problem: ss.Problem) -> None:
    for keywords, error, message in (
        ({"objective": "gripp"}, ss.InputError, "there is no quantity called `gripp`"),
        ({"objective": ss.Term("grip", steps=[1, 9])}, ss.InputError, "`grip`: .* at step 9, but"),
        (
            {"constraints": [ss.Bound("drag", 1.0, steps=[9])]},
            ss.InputError,
            "`drag`: .* steps 1 to",
        ),
        ({"objective": ss.Term("grip", steps=[1.5])}, ValueError, "objective.0..steps is .1.5."),
        ({"objective": []}, ValueError, "objective is empty"),
        ({"objective": ss.Term("grip", steps="first")}, ValueError, "objective.0..steps is"),
        ({"objective": ss.Term("grip", weight=np.inf)}, ValueError, "objective.0..weight is inf"),
        ({"objective": [Stretch()]}, TypeError, "objective.0. is of type Stretch"),
        ({"constraints": [ss.Bound("grip")]}, ValueError, "constraints.0. has no bound"),
        ({"constraints": ["grip"]}, TypeError, "constraints.0. is of type str"),
        ({"constraints": [ss.Bound("drag", min=np.nan)]}, ValueError, "constraints.0..min is nan"),
    ):
        with pytest.raises(error, match=message):
            problem.optimize(**keywords)  # type: ignore[arg-type]


def test_steps_are_those_of_the_load_path(problem: ss.Problem) -> None:
    with pytest.raises(ss.InputError) as caught:
        problem.optimize(constraints=[ss.Bound("grip", min=1.0, steps=[9])])
    assert caught.value.help == "the load path has steps 1 to 4"


def test_pages_describe_the_objective_that_was_minimised(
    case: ss.Case, problem: ss.Problem, tmp_path: Path
) -> None:
    problem.add(Stretch())
    directory = tmp_path / "run"
    terms = [ss.Term("Stretch", 2.0, [1, 2]), ss.Term("Stretch")]
    result = problem.optimize(objective=terms, iterations=1, directory=directory)
    record = json.loads((directory / "responses.json").read_text())
    assert record["about"] == "2 × `Stretch` at load steps 1, 2 + `Stretch` at the last load step"
    assert record["unit"] == "L²"
    page = result.report(tmp_path / "own.html").read_text(encoding="utf-8")
    assert record["about"] in page and "nodal contact forces" not in page
    # it continues, and is described by the same words
    resumed = ss.resume(directory, iterations=2, quantities=[Stretch()])
    assert json.loads((directory / "responses.json").read_text()) == record
    assert len(resumed.iterations) == 3
    # constraints alone leave the objective of the case, and units have the names of the case
    named = case.replace({"units": {"length": "mm", "force": "N"}}).build()
    bounds = [ss.Bound("grip", min=0.0)]
    named.optimize(constraints=bounds, iterations=1, directory=directory, overwrite=True)
    page = ss.open_run(directory).report(tmp_path / "case.html").read_text(encoding="utf-8")
    assert "nodal contact forces" in page
    named.optimize(objective="energy", iterations=1, directory=directory, overwrite=True)
    record = json.loads((directory / "responses.json").read_text())
    assert (record["about"], record["unit"]) == ("`energy`, at the last load step", "N mm")


def test_quantities_that_nothing_uses_are_not_needed_again(
    problem: ss.Problem, tmp_path: Path
) -> None:
    class Unused(Stretch):
        pass

    problem.add(Stretch())
    problem.add(Unused())
    bounds = [ss.Bound("Stretch", max=1.0)]
    problem.optimize(constraints=bounds, iterations=1, directory=tmp_path / "run")
    record = json.loads((tmp_path / "run" / "responses.json").read_text())
    assert record["quantities"] == ["Stretch"]
    assert len(ss.resume(tmp_path / "run", iterations=2, quantities=[Stretch()]).iterations) == 3


class Smooth(ss.DesignMap):
    """Densities of the designed elements from few variables, by a nonlinear map."""

    def __init__(self, problem: ss.Problem, variables: int) -> None:
        self.designed, self.elements = problem.designed, problem.mesh.elements
        random = np.random.default_rng(3)
        self.matrix = random.uniform(-1.0, 1.0, (len(self.designed), variables))

    def apply(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        density = np.ones(self.elements)
        density[self.designed] = 1.0 / (1.0 + np.exp(-self.matrix @ x))
        return density

    def pull_back(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        density = self.apply(x)[self.designed]
        return self.matrix.T @ (gradient[self.designed] * density * (1.0 - density))


START = np.array([0.3, -0.2, 0.4])


def test_a_map_has_gradients_of_second_order(problem: ss.Problem) -> None:
    mapped = problem.with_map(Smooth(problem, 3), START)
    direction = np.array([0.7, 0.4, -0.6])
    value, gradient = mapped.value_and_gradient(START)
    assert value == problem.solve(mapped.density(START)).objective == mapped.solve().objective
    values, pullback = mapped.vjp(names=["drag"])
    weights = {"drag": [0.2, 0.0, 1.0, -1.0]}
    weighted = pullback(weights)
    for slope, function in (
        (gradient @ direction, lambda x: mapped.value_and_gradient(x)[0]),
        (
            weighted @ direction,
            lambda x: float(np.dot(weights["drag"], mapped.solve(x).quantities["drag"])),
        ),
    ):
        errors = []
        for step in (2e-3, 1e-3):
            ahead, behind = (function(START + sign * step * direction) for sign in (1, -1))
            errors.append(abs((ahead - behind) / (2 * step) - slope) / abs(slope))
        assert errors[1] < 1e-5 and 3.0 < errors[0] / errors[1] < 5.0, errors
    np.testing.assert_array_equal(values["drag"], mapped.solve().quantities["drag"])
    assert mapped.volume_fraction() == problem.volume_fraction(mapped.density())
    _, of_parameters = pullback.with_parameters(weights)
    other = mapped.with_parameters({"contact[0].friction": 0.2})
    assert other.solve().objective == mapped.evaluate(friction=0.2)[0].objective
    assert {parameter.kind for parameter in of_parameters} >= {"friction", "amplitude"}


def test_a_pull_back_of_a_map_keeps_its_variables(problem: ss.Problem) -> None:
    mapped = problem.with_map(Smooth(problem, 3), START)
    weights = {"drag": np.ones(4)}
    expected = mapped.vjp(START, "drag")[1](weights)
    x = START.copy()
    _, pullback = mapped.vjp(x, "drag")
    x[:] = 0.0
    np.testing.assert_array_equal(pullback(weights), expected)

    class Careless(Smooth):
        def apply(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
            x += 1.0
            return super().apply(x)

    with pytest.raises(ValueError, match="read-only"):
        problem.with_map(Careless(problem, 3), START)


@pytest.mark.parametrize("unit", [1e-7, 1e7])
def test_maps_are_checked_in_any_unit(problem: ss.Problem, unit: float) -> None:
    smooth = Smooth(problem, 3)

    class Scaled(ss.DesignMap):
        """The same map of variables in another unit."""

        def __init__(self, factor: float) -> None:
            self.factor = factor

        def apply(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
            return smooth.apply(x / unit)

        def pull_back(
            self, x: NDArray[np.float64], gradient: NDArray[np.float64]
        ) -> NDArray[np.float64]:
            return self.factor * smooth.pull_back(x / unit, gradient) / unit

    mapped = problem.with_map(Scaled(1.0), unit * START)
    expected = problem.with_map(smooth, START).density()
    np.testing.assert_allclose(mapped.density(), expected, rtol=1e-12)
    with pytest.raises(ss.InputError, match="Scaled.pull_back gives"):
        problem.with_map(Scaled(1.01), unit * START)


def test_maps_go_into_torch_and_jax(problem: ss.Problem) -> None:
    mapped = problem.with_map(Smooth(problem, 3), START)
    _, gradient = mapped.value_and_gradient(START)
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    x = torch.tensor(START, requires_grad=True)
    ss.torch.objective(mapped)(x).backward()
    np.testing.assert_array_equal(x.grad, gradient)
    jax = pytest.importorskip("jax", reason="JAX is not installed")
    jax.config.update("jax_enable_x64", True)
    np.testing.assert_array_equal(jax.grad(ss.jax.objective(mapped))(START), gradient)


def test_wrong_maps_are_refused(problem: ss.Problem) -> None:
    class Wrong(Smooth):
        def pull_back(
            self, x: NDArray[np.float64], gradient: NDArray[np.float64]
        ) -> NDArray[np.float64]:
            return 1.01 * super().pull_back(x, gradient)

    class Short(Smooth):
        def apply(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
            return super().apply(x)[1:]

    with pytest.raises(ss.InputError, match="Wrong.pull_back gives .* differences of Wrong.apply"):
        problem.with_map(Wrong(problem, 3), START)
    with pytest.raises(ValueError, match=r"Short.apply\(x\) has shape \(9,\): give \(10,\)"):
        problem.with_map(Short(problem, 3), START)
    with pytest.raises(TypeError, match="map is of type function"):
        problem.with_map(lambda x: x, START)  # type: ignore[arg-type]
    mapped = problem.with_map(Smooth(problem, 3), START)
    with pytest.raises(ValueError, match=r"x has shape \(2,\): give \(3,\)"):
        mapped.solve([0.1, 0.2])
