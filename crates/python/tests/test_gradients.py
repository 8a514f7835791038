"""Gradients: remainders of Taylor series fall with the square of the step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray

STEPS = 1e-2 * 0.5 ** np.arange(5)


def orders(value: Callable[[float], float], slope: float) -> NDArray[np.float64]:
    """Observed orders of |f(h) − f(0) − h f'(0)| under halving of the step."""
    remainders = [abs(value(h) - value(0.0) - h * slope) for h in STEPS]
    return np.log2(np.array(remainders[:-1]) / np.array(remainders[1:]))


def statuses(problem: ss.Problem, density: NDArray[np.float64]) -> list[bytes]:
    return [step.contact.status.tobytes() for step in problem.solve(density).steps]


@pytest.fixture
def smooth(
    problem: ss.Problem, density: NDArray[np.float64], direction: NDArray[np.float64]
) -> None:
    """No node changes its status over the steps, so that the functions are smooth."""
    base = statuses(problem, density)
    assert any(1 in step for step in base) and any(2 in step for step in base), (
        "sticking and slipping"
    )
    assert statuses(problem, density + STEPS[0] * direction) == base


@pytest.mark.usefixtures("smooth")
def test_the_objective(
    problem: ss.Problem, density: NDArray[np.float64], direction: NDArray[np.float64]
) -> None:
    _, gradient = problem.value_and_gradient(density)
    found = orders(
        lambda h: problem.value_and_gradient(density + h * direction)[0], gradient @ direction
    )
    assert np.all(np.abs(found - 2.0) < 0.1), found
    # nothing outside the design
    assert not gradient[problem.mesh.bodies["block"].elements].any()


@pytest.mark.usefixtures("smooth")
@pytest.mark.parametrize("name", ["grip", "drag", "work", "energy"])
def test_each_quantity_with_any_weights(
    problem: ss.Problem, density: NDArray[np.float64], direction: NDArray[np.float64], name: str
) -> None:
    weights = np.array([0.7, -1.3, 0.4, 1.1])
    values, pullback = problem.vjp(density, name)
    assert values[name].shape == (4,)
    slope = pullback({name: weights}) @ direction
    found = orders(
        lambda h: float(weights @ problem.vjp(density + h * direction, name)[0][name]), slope
    )
    assert np.all(np.abs(found - 2.0) < 0.1), found


def test_weights_are_linear(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    values, pullback = problem.vjp(density)
    assert list(values) == problem.quantities == list(pullback.names)
    weights = np.random.default_rng(3).normal(size=(4, 4))
    together = pullback(weights)
    apart = sum(pullback({name: row}) for name, row in zip(pullback.names, weights, strict=True))
    assert np.allclose(together, apart, rtol=1e-9, atol=1e-9 * np.abs(together).max())
    assert not pullback({}).any()


def test_a_pull_back_does_not_depend_on_others(
    problem: ss.Problem, density: NDArray[np.float64]
) -> None:
    weights = np.random.default_rng(3).normal(size=(4, 4))
    _, pullback = problem.vjp(density)
    first = pullback(weights)
    _, of_parameters = pullback.with_parameters(weights)
    pullback(2.0 * weights[::-1])
    problem.value_and_gradient(problem.initial_density)
    problem.solve(density)
    assert np.array_equal(pullback(weights), first)
    assert pullback.with_parameters(weights)[1] == of_parameters


def test_values_are_those_of_the_path(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    values, _ = problem.vjp(density)
    quantities = problem.solve(density).quantities
    for name, value in values.items():
        assert np.allclose(value, quantities[name], rtol=1e-12), name


def test_the_objective_is_a_sum_of_a_quantity(case: ss.Case, density: NDArray[np.float64]) -> None:
    """θ = −Σ of the nodal contact forces, so its gradient is a pull-back of weights of −1."""
    added = '[[quantity]]\nname = "nodal"\n'
    added += 'contact_force = { slave = "block_ymin", component = "nodal" }\n'
    problem = ss.Case.from_text(f"{case.text}\n{added}").build()
    value, gradient = problem.value_and_gradient(density)
    values, pullback = problem.vjp(density, "nodal")
    assert np.isclose(-values["nodal"].sum(), value, rtol=1e-12)
    assert np.allclose(
        pullback({"nodal": -np.ones(4)}), gradient, rtol=1e-9, atol=1e-9 * np.abs(gradient).max()
    )


def test_parameters(case: ss.Case, density: NDArray[np.float64]) -> None:
    """Friction and modulus, against central differences of rebuilt problems."""
    _, _, parameters = case.build().value_and_gradient(density, parameters=True)
    _, pullback = case.build().vjp(density, "drag")
    _, of_drag = pullback.with_parameters({"drag": [0, 0, 0, 1]})
    for parameter, key, at in [
        (ss.Parameter("friction", "contact[0].friction"), "contact[0].friction", 0.3),
        (
            ss.Parameter("youngs_modulus", "slab"),
            "body[0].material.neo_hooke.youngs_modulus",
            1000.0,
        ),
    ]:
        moved = [case.replace({key: at * (1 + h)}).build() for h in (1e-5, -1e-5)]
        objective = [problem.value_and_gradient(density)[0] for problem in moved]
        drag = [problem.vjp(density, "drag")[0]["drag"][-1] for problem in moved]
        assert parameters[parameter] == pytest.approx(
            (objective[0] - objective[1]) / (2e-5 * at), rel=1e-5
        )
        assert of_drag[parameter] == pytest.approx((drag[0] - drag[1]) / (2e-5 * at), rel=1e-5)


def test_load_cases_have_weights_of_their_own() -> None:
    text = ss.Case.template("cube-on-cuboid").text
    text += '\n[[load_case]]\nname = "one"\n[[load_case]]\nname = "two"\nweight = 0.5\n'
    text += '\n[[quantity]]\nname = "drag"\nreaction = { set = "cube_ymax", component = "x" }\n'
    problem = ss.Case.from_text(text).build()
    values, pullback = problem.vjp(names="drag")
    assert values["drag"].shape == (20,)
    unit = np.eye(20)
    first, second = pullback({"drag": unit[9]}), pullback({"drag": unit[19]})
    # the same motions in both
    assert np.allclose(first, second, rtol=1e-10) and np.abs(first).max() > 0


def test_check_gradient(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    check = problem.check_gradient(density, directions=2, elements=1)
    assert check.passed and check.worst is not None and check.worst < 1e-5
    assert len({quotient.direction for quotient in check.quotients}) == 3
    shown = str(check)
    assert "adjoint" in shown and "largest error" in shown
    table = check.quotients
    assert all(at.verdict == "right" for at in table)
    pandas = pytest.importorskip("pandas")
    assert isinstance(check.to_dataframe(), pandas.DataFrame)
    assert problem.check_gradient(density, quantity="grip", directions=1).passed
