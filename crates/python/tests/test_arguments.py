"""Wrong arrays: the exception names the argument and the cure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import NDArray

GOOD = np.full(10, 0.5)


def changed(index: int, value: float) -> NDArray[np.float64]:
    density = GOOD.copy()
    density[index] = value
    return density


@pytest.mark.parametrize(
    ("density", "kind", "text"),
    [
        (
            GOOD[:9],
            ValueError,
            r"density has shape \(9,\): give \(10,\), one density for each element",
        ),
        (GOOD[:, None], ValueError, r"density has shape \(10, 1\)"),
        (0.5, ValueError, r"density has shape \(\)"),
        (GOOD.astype(complex), TypeError, r"density has dtype complex128: give real numbers"),
        (["a"] * 10, TypeError, "density has dtype"),
        ([[0.5], [0.5, 0.5]], ValueError, "density is not a rectangular array"),
        (changed(3, np.nan), ValueError, r"density\[3\] is nan: numbers must be finite"),
        (changed(9, np.inf), ValueError, r"density\[9\] is inf"),
        (changed(4, 1.5), ValueError, r"density\[4\] is 1.5: densities lie in \[0, 1\]; np.clip"),
        (changed(0, -1e-9), ValueError, r"density\[0\] is -1e-09"),
    ],
)
@pytest.mark.parametrize(
    "call", ["solve", "value_and_gradient", "vjp", "check_gradient", "optimize"]
)
def test_wrong_densities(
    problem: ss.Problem, call: str, density: Any, kind: type[Exception], text: str
) -> None:
    with pytest.raises(kind, match=text):
        getattr(problem, call)(density)


def test_any_layout_of_real_numbers_is_right(
    problem: ss.Problem, density: NDArray[np.float64]
) -> None:
    expected = problem.solve(density).steps[-1].displacement
    strided = np.repeat(density, 3)[::3]
    reversed_ = density[::-1].copy()[::-1]
    swapped = density.astype(">f8")
    for same in (strided, reversed_, swapped, list(density)):
        assert np.array_equal(problem.solve(same).steps[-1].displacement, expected)
    assert problem.solve(np.ones(10, dtype=int)).objective == problem.solve(np.ones(10)).objective


def test_arguments_are_not_changed(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    before = density.copy()
    density.setflags(write=False)
    problem.value_and_gradient(density)
    assert np.array_equal(density, before)
    # results are independent copies
    problem.initial_density[:] = 0.0
    assert problem.initial_density[0] == 0.5


def test_wrong_quantities_and_weights(problem: ss.Problem) -> None:
    with pytest.raises(ss.InputError, match="no quantity called `gripp`") as caught:
        problem.vjp(names=["gripp"])
    assert caught.value.help == "quantities of the case: grip, drag, work, energy"
    with pytest.raises(ss.InputError, match="no quantity is named"):
        problem.vjp(names=[])
    _, pullback = problem.vjp(names=["grip", "drag"])
    with pytest.raises(ValueError, match=r"weights\['grip'\] has shape \(3,\): give \(4,\)"):
        pullback({"grip": np.ones(3)})
    with pytest.raises(ValueError, match="weights has `work`"):
        pullback({"work": np.ones(4)})
    with pytest.raises(ValueError, match=r"weights has shape \(4, 2\): give \(2, 4\)"):
        pullback(np.ones((4, 2)))
    with pytest.raises(ValueError, match=r"weights\[1, 2\] is nan"):
        pullback(np.where(np.arange(8).reshape(2, 4) == 6, np.nan, 1.0))


def test_a_name_is_given_once(problem: ss.Problem) -> None:
    with pytest.raises(ValueError, match="names has 'grip' twice: give it once"):
        problem.vjp(names=["grip", "drag", "grip"])
    friction = next(iter(problem.parameters))
    with pytest.raises(ValueError, match=r"values has 'contact\[0\].friction' twice"):
        problem.with_parameters({friction: 0.1, friction.name: 0.2})


def test_arrays_that_are_kept_cannot_be_changed(problem: ss.Problem) -> None:
    path, mesh = problem.solve(), problem.mesh
    contact = path.steps[-1].contact
    kept = [path.density, path.quantities["grip"], path.steps[-1].displacement]
    kept += [problem.times, problem.designed, mesh.volumes, mesh.nodes, mesh.hexahedra]
    kept += [mesh.hexahedron_numbers, *mesh.sets.values(), *mesh.surfaces.values()]
    kept += list(vars(contact).values())
    for array in kept:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    # states are what they are, whatever their numbers
    assert contact == contact and contact != path.steps[0].contact and hash(contact)


def test_wrong_numbers(problem: ss.Problem) -> None:
    with pytest.raises(ValueError, match="directions is -1"):
        problem.check_gradient(directions=-1)
    with pytest.raises(ValueError, match="nothing to compare"):
        problem.check_gradient(directions=0, elements=0)
    with pytest.raises(ValueError, match="step is 0.5"):
        problem.check_gradient(step=0.5)
    with pytest.raises(ValueError, match="tolerance is nan"):
        problem.check_gradient(tolerance=float("nan"))
    with pytest.raises(ValueError, match="iterations is 0"):
        problem.optimize(iterations=0)


def test_an_objective_is_needed(case: ss.Case) -> None:
    text = case.text.replace('[objective]\ncontact_force = { steps = "all" }\n', "")
    problem = ss.Case.from_text(text).build()
    with pytest.raises(ss.InputError, match="the case has no objective"):
        problem.value_and_gradient()
    assert problem.solve().objective is None
    with pytest.raises(ss.CaseError, match="objective"):
        problem.optimize()


def test_threads_run_already(problem: ss.Problem) -> None:
    problem.solve()
    assert ss.threads() >= 1
    with pytest.raises(ss.InputError, match="already running"):
        ss.set_threads(2)
    with pytest.raises(ss.InputError, match="threads is 0"):
        ss.set_threads(0)
