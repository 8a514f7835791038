"""Functions for PyTorch: gradcheck, and the gradients of the package."""

from __future__ import annotations

import doctest

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray

torch = pytest.importorskip(
    "torch", reason="PyTorch is not installed: slipstick.torch is not tested"
)


def tensor(density: NDArray[np.float64]) -> torch.Tensor:
    return torch.tensor(density, requires_grad=True)


def test_quantities(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    f = ss.torch.quantities(problem, ["grip", "drag"])
    values, pullback = problem.vjp(density, ["grip", "drag"])
    x = tensor(density)
    found = f(x)
    for name, value in values.items():
        assert np.array_equal(found[name].detach().numpy(), value)
    (found["grip"][-1] + 2.0 * found["drag"][1]).backward()
    expected = pullback({"grip": [0, 0, 0, 1], "drag": [0, 2, 0, 0]})
    assert np.allclose(x.grad, expected, rtol=1e-10, atol=0)


def test_gradcheck(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    designed = torch.tensor(problem.designed)

    def embedded(x: torch.Tensor) -> torch.Tensor:
        return torch.tensor(density).index_put((designed,), x)

    x = tensor(density[problem.designed])
    f = ss.torch.quantities(problem)
    assert torch.autograd.gradcheck(
        lambda x: tuple(f(embedded(x)).values()), (x,), eps=1e-5, rtol=1e-4
    )
    g = ss.torch.objective(problem)
    assert torch.autograd.gradcheck(lambda x: g(embedded(x)), (x,), eps=1e-5, rtol=1e-4)


def test_gradcheck_of_parameters(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    f, g = ss.torch.quantities(problem), ss.torch.objective(problem)

    def parameters(p: torch.Tensor) -> dict[str, torch.Tensor]:
        # moduli in units of a thousand, so that all steps suit
        return {
            "contact[0].friction": p[0],
            "slab.youngs_modulus": 1000.0 * p[1],
            "dirichlet[1].motion": p[2],
        }

    x = torch.tensor(density)
    p = torch.tensor([0.25, 0.9, 0.95], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(
        lambda p: tuple(f(x, parameters(p)).values()), (p,), eps=1e-5, rtol=1e-4, nondet_tol=0.0
    )
    assert torch.autograd.gradcheck(lambda p: g(x, parameters(p)), (p,), eps=1e-5, rtol=1e-4)
    # both at once
    x.requires_grad_()
    g(x, parameters(p)).backward()
    changed = problem.with_parameters({k: float(v) for k, v in parameters(p.detach()).items()})
    value, gradient, others = changed.value_and_gradient(density, parameters=True)
    assert np.allclose(x.grad, gradient, rtol=1e-12, atol=0)
    friction = next(v for parameter, v in others.items() if parameter.kind == "friction")
    assert float(p.grad[0]) == pytest.approx(friction, rel=1e-12)
    assert float(g(x.detach(), parameters(p.detach()))) == value


def test_parameters_that_cannot_be(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    f = ss.torch.quantities(problem, "drag")
    with pytest.raises(ValueError, match="parameters has 'mu', which is no parameter"):
        f(tensor(density), {"mu": 0.1})
    with pytest.raises(ValueError, match=r"has shape \(2,\): give one number"):
        f(tensor(density), {"contact[0].friction": torch.tensor([0.1, 0.2])})
    friction = torch.tensor(0.0, requires_grad=True)
    with pytest.raises(ValueError, match="where the values have a kink"):
        f(tensor(density), {"contact[0].friction": friction})["drag"][-1].backward()


def test_objective(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    value, gradient = problem.value_and_gradient(density)
    f = ss.torch.objective(problem)
    x = tensor(density)
    result = f(x)
    (3.0 * result).backward()
    assert result.item() == value and np.allclose(x.grad, 3.0 * gradient, rtol=1e-14)
    with torch.no_grad():
        assert f(torch.tensor(density)).item() == value


def test_an_objective_is_needed(case: ss.Case, problem: ss.Problem) -> None:
    text = case.text.replace('[objective]\ncontact_force = { steps = "all" }\n', "")
    without = ss.Case.from_text(text).build()
    with pytest.raises(ss.InputError, match="the case has no objective"):
        ss.torch.objective(without)
    with pytest.raises(ValueError, match="names has 'grip' twice"):
        ss.torch.quantities(problem, ["grip", "grip"])


def test_types_of_the_densities_are_kept(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    f = ss.torch.quantities(problem, "grip")
    x = torch.tensor(density, dtype=torch.float32, requires_grad=True)
    value = f(x)["grip"][-1]
    value.backward()
    assert value.dtype == x.grad.dtype == torch.float32
    with pytest.raises(TypeError, match="give a torch.Tensor"):
        f(density)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="give floating-point"):
        f(torch.ones(10, dtype=torch.int64))
    with pytest.raises(ValueError, match="densities lie in"):
        f(2.0 * x)


def test_a_design_of_an_optimizer_of_torch(problem: ss.Problem) -> None:
    """A few steps of Adam on a parametrization of the density reduce the objective."""
    f = ss.torch.objective(problem)
    designed = torch.tensor(problem.designed)
    x = torch.zeros(len(designed), dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.Adam([x], lr=0.3)
    values = []
    for _ in range(5):
        optimizer.zero_grad()
        density = torch.ones(problem.mesh.elements, dtype=torch.float64)
        loss = f(density.index_put((designed,), torch.sigmoid(x)))
        loss.backward()
        optimizer.step()
        values.append(loss.item())
    assert values[-1] < values[0]


def test_there_are_no_second_derivatives(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    x = tensor(density)
    (gradient,) = torch.autograd.grad(ss.torch.objective(problem)(x), x, create_graph=True)
    with pytest.raises(RuntimeError, match="once_differentiable"):
        gradient.sum().backward()


def test_examples_of_docstrings() -> None:
    assert doctest.testmod(ss.torch).failed == 0
