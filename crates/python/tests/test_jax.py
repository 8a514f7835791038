"""Functions for JAX: the gradients of the package, in every way that JAX asks for them."""

from __future__ import annotations

import doctest

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray

jax = pytest.importorskip("jax", reason="JAX is not installed: slipstick.jax is not tested")
jax.config.update("jax_enable_x64", True)

import jax.experimental  # noqa: E402
from jax.test_util import check_grads  # noqa: E402


def test_quantities(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    f = ss.jax.quantities(problem, ["grip", "drag"])
    values, pullback = problem.vjp(density, ["grip", "drag"])
    found = f(density)
    assert list(found) == ["grip", "drag"]
    for name, value in values.items():
        assert np.array_equal(found[name], value)
    expected = pullback({"grip": [0, 0, 0, 1], "drag": [0, 2, 0, 0]})

    def loss(x: jax.Array) -> jax.Array:
        return f(x)["grip"][-1] + 2.0 * f(x)["drag"][1]

    assert np.allclose(jax.grad(loss)(density), expected, rtol=1e-10, atol=0)
    assert np.allclose(jax.jit(jax.grad(loss))(density), expected, rtol=1e-10, atol=0)


def test_differences_agree(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    designed = problem.designed

    def embedded(x: jax.Array) -> jax.Array:
        return jax.numpy.asarray(density).at[designed].set(x)

    f = ss.jax.quantities(problem, "drag")
    check_grads(
        lambda x: f(embedded(x))["drag"], (density[designed],), 1, ["rev"], eps=1e-4, rtol=1e-5
    )
    g = ss.jax.objective(problem)
    check_grads(lambda x: g(embedded(x)), (density[designed],), 1, ["rev"], eps=1e-4, rtol=1e-5)


PARAMETERS = {"contact[0].friction": 0.25, "slab.youngs_modulus": 900.0, "dirichlet[1].motion": 0.9}


def test_parameters(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    """Against the gradients of the package, and against differences."""
    f = ss.jax.quantities(problem, ["grip", "drag"])
    changed = problem.with_parameters(PARAMETERS)
    values, pullback = changed.vjp(density, ["grip", "drag"])
    expected, of_parameters = pullback.with_parameters({"drag": [0, 0, 1, 1]})

    def loss(x: jax.Array, parameters: dict[str, jax.Array]) -> jax.Array:
        return f(x, parameters)["drag"][2:].sum()

    assert np.array_equal(f(density, PARAMETERS)["grip"], values["grip"])
    for gradient in (jax.grad(loss, (0, 1)), jax.jit(jax.grad(loss, (0, 1)))):
        found, others = gradient(density, PARAMETERS)
        assert np.allclose(found, expected, rtol=1e-12, atol=0)
        for parameter, derivative in of_parameters.items():
            if parameter.name in PARAMETERS:
                assert others[parameter.name] == pytest.approx(derivative, rel=1e-12)
    # moduli in units of a thousand, so that all steps suit
    scaled = {**PARAMETERS, "slab.youngs_modulus": 0.9}

    def of_scaled(function: object, parameters: dict[str, jax.Array]) -> jax.Array:
        modulus = 1000.0 * parameters["slab.youngs_modulus"]
        return function(density, {**parameters, "slab.youngs_modulus": modulus})

    check_grads(lambda p: of_scaled(f, p)["drag"], (scaled,), 1, ["rev"], eps=1e-4, rtol=1e-5)
    g = ss.jax.objective(problem)
    check_grads(lambda p: of_scaled(g, p), (scaled,), 1, ["rev"], eps=1e-4, rtol=1e-5)
    assert float(g(density, PARAMETERS)) == changed.solve(density).objective


def test_parameters_that_cannot_be(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    f = ss.jax.quantities(problem, "drag")
    with pytest.raises(ValueError, match="parameters has 'mu', which is no parameter"):
        f(density, {"mu": 0.1})
    with pytest.raises(ValueError, match=r"has shape \(2,\): give one number"):
        f(density, {"contact[0].friction": np.array([0.1, 0.2])})
    assert f(density, {"contact[0].friction": 0.0})["drag"].shape == (4,)
    with pytest.raises(Exception, match="where the values have a kink"):
        jax.grad(lambda mu: f(density, {"contact[0].friction": mu})["drag"][-1])(0.0)


def test_an_objective_is_needed(case: ss.Case, problem: ss.Problem) -> None:
    text = case.text.replace('[objective]\ncontact_force = { steps = "all" }\n', "")
    without = ss.Case.from_text(text).build()
    with pytest.raises(ss.InputError, match="the case has no objective"):
        ss.jax.objective(without)
    with pytest.raises(ValueError, match="names has 'grip' twice"):
        ss.jax.quantities(problem, ["grip", "grip"])


def test_floats_are_those_of_the_trace(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    """Callbacks run in threads of JAX, where other floats may be enabled."""
    value, gradient = problem.value_and_gradient(density)
    f, g = ss.jax.objective(problem), ss.jax.quantities(problem, "drag")
    # the name of jax 0.8
    floats = jax.enable_x64 if hasattr(jax, "enable_x64") else jax.experimental.enable_x64
    with floats(False):
        single = jax.numpy.asarray(density)
        found, slope = jax.jit(jax.value_and_grad(f))(single)
        drag = jax.jit(g)(single)["drag"]
        assert found.dtype == slope.dtype == drag.dtype == np.float32
        assert float(found) == pytest.approx(value, rel=1e-4)
    found, slope = jax.jit(jax.value_and_grad(f))(density)
    assert found.dtype == slope.dtype == np.float64
    assert float(found) == value and np.array_equal(slope, gradient)


def test_objective(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    value, gradient = problem.value_and_gradient(density)
    f = ss.jax.objective(problem)
    assert float(f(density)) == value
    found, slope = jax.jit(jax.value_and_grad(f))(density)
    assert float(found) == value and np.array_equal(slope, gradient)
    both = jax.vmap(f)(np.stack([density, problem.initial_density]))
    assert np.array_equal(both, [value, problem.solve().objective])


def test_compositions_of_functions(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    """The chain rule through a map before and a loss behind."""
    f = ss.jax.quantities(problem)

    def loss(x: jax.Array) -> jax.Array:
        return jax.numpy.sum(jax.numpy.tanh(f(jax.nn.sigmoid(x))["work"]) ** 2)

    x = np.log(0.6 / 0.4) * np.ones(len(density))
    direction = np.zeros(len(density))
    direction[problem.designed] = np.linspace(-1, 1, len(problem.designed))
    difference = (loss(x + 1e-5 * direction) - loss(x - 1e-5 * direction)) / 2e-5
    assert np.isclose(jax.grad(loss)(x) @ direction, difference, rtol=1e-6)


def test_paths_are_kept_for_the_reverse_pass(
    problem: ss.Problem, density: NDArray[np.float64]
) -> None:
    calls = []
    original = problem.vjp

    class Counting:
        quantities, steps, parameters = problem.quantities, problem.steps, problem.parameters

        def vjp(self, x: NDArray[np.float64], names: list[str]) -> object:
            calls.append(x)
            return original(x, names)

    f = ss.jax.quantities(Counting(), "grip")  # type: ignore[arg-type]
    jax.grad(lambda x: f(x)["grip"][-1])(density)
    assert len(calls) == 1
    with pytest.raises(ValueError, match="keep is 0"):
        ss.jax.quantities(problem, keep=0)


def test_errors_come_through(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    f = ss.jax.quantities(problem, "grip")
    with pytest.raises(Exception, match="densities lie in"):
        jax.block_until_ready(f(2.0 * density))


def test_what_jax_cannot_do_is_an_error(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    """The rows of the table in the module's docstring that name errors, and ``jacrev``."""
    f = ss.jax.objective(problem)
    with pytest.raises(TypeError, match="forward-mode"):
        jax.jvp(f, (density,), (density,))
    with pytest.raises(TypeError, match="forward-mode"):
        jax.jacfwd(f)(density)
    with pytest.raises(Exception, match=r"JVP|forward-mode|differentiat"):
        jax.hessian(f)(density)
    with pytest.raises(Exception, match=r"JVP|differentiat"):
        jax.grad(lambda x: jax.numpy.sum(jax.grad(f)(x)))(density)
    rows = jax.jacrev(lambda x: ss.jax.quantities(problem, "grip")(x)["grip"])(density)
    _, pullback = problem.vjp(density, "grip")
    for step, row in enumerate(rows):
        assert np.allclose(row, pullback(np.eye(len(rows))[step : step + 1]), rtol=1e-10, atol=0)


def test_examples_of_docstrings() -> None:
    assert doctest.testmod(ss.jax).failed == 0
