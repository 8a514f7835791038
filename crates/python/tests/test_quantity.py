"""Quantities of one's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import slipstick as ss
from numpy.typing import ArrayLike, NDArray
from slipstick._progress import Bar
from test_gradients import orders


class Everything(ss.Quantity):
    """A made-up function of every field of the state."""

    unit = "F"
    reads = ("reaction", "contact", "energy", "stress")

    def value(self, state: ss.State) -> float:
        contact = state.contact
        return float(
            (state.displacement * state.internal_force).sum()
            + (state.reaction[:, 1] ** 2).sum()
            + 0.1 * state.energy.sum() ** 2
            + 1e-4 * (state.stress**2).sum()
            + (state.density * np.arange(len(state.density))).sum()
            + (contact.multiplier[:, 0] * contact.area).sum()
            + 0.3 * (contact.vector[:, 0] ** 2).sum()
            + (contact.slip[:, 0] * contact.gap).sum()
        )

    def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
        contact = state.contact
        normal = np.zeros_like(contact.multiplier)
        normal[:, 0] = contact.area
        along = np.zeros_like(contact.vector)
        along[:, 0] = 0.6 * contact.vector[:, 0]
        slip = np.zeros_like(contact.slip)
        slip[:, 0] = contact.gap
        reaction = np.zeros_like(state.reaction)
        reaction[:, 1] = 2.0 * state.reaction[:, 1]
        return {
            "displacement": state.internal_force,
            "internal_force": state.displacement,
            "reaction": reaction,
            "energy": np.full(len(state.energy), 0.2 * state.energy.sum()),
            "stress": 2e-4 * state.stress,
            "density": np.arange(len(state.density)),
            "contact.multiplier": normal,
            "contact.area": contact.multiplier[:, 0],
            "contact.vector": along,
            "contact.slip": slip,
            "contact.gap": contact.slip[:, 0],
        }


class Grip(ss.Quantity):
    """The normal force, which the case has as `grip`."""

    name = "own"
    unit = "F"
    reads = ("contact",)

    def value(self, state: ss.State) -> float:
        return float((state.contact.multiplier[:, 0] * state.contact.area).sum())

    def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
        normal = np.zeros_like(state.contact.multiplier)
        normal[:, 0] = state.contact.area
        return {"contact.multiplier": normal, "contact.area": state.contact.multiplier[:, 0]}


class Work(ss.Quantity):
    """External work, from the state before: the trapezoidal rule."""

    unit = "F L"
    reads = ("reaction", "previous")
    accumulates = True

    def value(self, state: ss.State) -> float:
        return float((self._force(state) * self._moved(state)).sum())

    def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
        force, half = self._force(state), 0.5 * self._moved(state)
        return {
            "displacement": force,
            "external_force": half,
            "reaction": half,
            "previous.displacement": -force,
            "previous.external_force": half,
            "previous.reaction": half,
        }

    def _force(self, state: ss.State) -> NDArray[np.float64]:
        before = state.previous
        both = state.external_force + state.reaction + before.external_force + before.reaction
        return 0.5 * both

    def _moved(self, state: ss.State) -> NDArray[np.float64]:
        return state.displacement - state.previous.displacement


class Friction(ss.Quantity):
    """Friction work of nodes in contact, from the pressures at both ends of the step."""

    unit = "F L"
    reads = ("contact", "previous")
    accumulates = True

    def value(self, state: ss.State) -> float:
        pressure, before, mean, along = self._parts(state)
        return float((mean * along).sum())

    def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
        pressure, before, mean, along = self._parts(state)
        inside = along != 0.0
        weight = np.where(inside, mean, 0.0)[:, None]
        multiplier = np.zeros_like(state.contact.multiplier)
        multiplier[:, 1:] = weight * state.contact.slip
        multiplier[:, 0] = -0.5 * before / pressure**2 * along
        previous = np.zeros_like(multiplier)
        previous[:, 0] = 0.5 / pressure * along
        slip = weight * state.contact.multiplier[:, 1:]
        return {
            "contact.multiplier": multiplier,
            "contact.slip": slip,
            "previous.multiplier": previous,
        }

    def _parts(self, state: ss.State) -> tuple[NDArray[np.float64], ...]:
        closed = (state.contact.status != 0) & (state.contact.multiplier[:, 0] > 0.0)
        pressure = np.where(closed, state.contact.multiplier[:, 0], 1.0)
        before = state.previous.multiplier[:, 0]
        along = np.where(
            closed, (state.contact.multiplier[:, 1:] * state.contact.slip).sum(axis=1), 0.0
        )
        return pressure, before, 0.5 * (1.0 + before / pressure), along


@pytest.mark.parametrize(("quantity", "column"), [(Work(), "external_work"), (Friction(), "work")])
def test_increments_see_the_state_before(
    problem: ss.Problem,
    density: NDArray[np.float64],
    direction: NDArray[np.float64],
    quantity: ss.Quantity,
    column: str,
) -> None:
    problem.add(quantity)
    name = type(quantity).__name__
    values, pullback = problem.vjp(density, name)
    table = problem.solve(density).quantities
    np.testing.assert_allclose(values[name], table[column][-4:], rtol=1e-12)
    weights = np.array([0.3, -0.2, 1.0, 0.5])
    slope = pullback({name: weights}) @ direction
    found = orders(
        lambda h: float(weights @ problem.vjp(density + h * direction, name)[0][name]), slope
    )
    assert np.all(np.abs(found - 2.0) < 0.1), found


def test_the_whole_gradient(
    problem: ss.Problem, density: NDArray[np.float64], direction: NDArray[np.float64]
) -> None:
    problem.add(Everything())
    weights = np.array([0.3, -0.2, 1.0, 0.5])
    _, pullback = problem.vjp(density, "Everything")
    slope = pullback({"Everything": weights}) @ direction
    found = orders(
        lambda h: float(
            weights @ problem.vjp(density + h * direction, "Everything")[0]["Everything"]
        ),
        slope,
    )
    assert np.all(np.abs(found - 2.0) < 0.1), found


def test_steps_are_counted_within_a_load_case() -> None:
    text = ss.Case.template("cube-on-cuboid").text
    text += '\n[[load_case]]\nname = "one"\n[[load_case]]\nname = "two"\n'
    problem = ss.Case.from_text(text).build()
    seen = []

    class Steps(ss.Quantity):
        def value(self, state: ss.State) -> float:
            seen.append((state.step, state.steps))
            return 0.0

        def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
            return {}

    expected = [(step, 10) for step in range(1, 11)]
    problem.add(Steps())
    assert sorted(set(seen)) == expected
    seen.clear()
    problem.vjp(names="Steps")
    assert sorted(seen) == sorted(2 * expected)


def test_it_is_one_of_the_quantities(problem: ss.Problem, density: NDArray[np.float64]) -> None:
    problem.add(Grip())
    assert problem.quantities == ["grip", "drag", "work", "energy", "own"]
    values, pullback = problem.vjp(density, ["grip", "own"])
    assert np.allclose(values["grip"], values["own"], rtol=1e-13)
    weights = np.array([1.0, 2.0, -1.0, 0.5])
    assert np.allclose(pullback({"grip": weights}), pullback({"own": weights}), rtol=1e-9)
    path = problem.solve(density)
    assert np.allclose(path.quantities["own"], values["own"]) and path.units["own"] == "F"
    assert problem.check_gradient(density, quantity="own", directions=1).passed


def test_wrong_derivatives_are_found(problem: ss.Problem) -> None:
    class Wrong(Grip):
        def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
            return {**super().derivative(state), "contact.area": np.zeros(len(state.contact.area))}

    with pytest.raises(
        ss.InputError, match="derivative with respect to the contact areas is 0e0"
    ) as caught:
        problem.add(Wrong())
    assert caught.value.help.startswith("correct `derivative`")
    assert "own" not in problem.quantities


@pytest.mark.parametrize(
    ("returned", "kind", "text"),
    [
        (
            {"displacement": np.zeros(3)},
            ValueError,
            r"own.derivative\(\)\['displacement'\] has shape \(3,\): give \(42, 3\)",
        ),
        (
            {"displacements": 1},
            ValueError,
            "returned the key 'displacements': the fields are displacement",
        ),
        ([1, 2], TypeError, "returned list: return a dict of arrays"),
        ({"contact.gap": ["a"] * 6}, TypeError, "has dtype"),
    ],
)
def test_wrong_results(
    problem: ss.Problem, returned: Any, kind: type[Exception], text: str
) -> None:
    class Wrong(Grip):
        def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
            result: Mapping[str, ArrayLike] = returned
            return result

    with pytest.raises(kind, match=text):
        problem.add(Wrong())


def test_wrong_quantities(problem: ss.Problem) -> None:
    with pytest.raises(TypeError, match="derive its class from slipstick.Quantity"):
        problem.add(object())  # type: ignore[arg-type]
    for attribute, value in (("unit", "N"), ("reads", ("contacts",)), ("reads", "contact")):
        quantity = Grip()
        setattr(quantity, attribute, value)
        with pytest.raises(ValueError, match=f"own.{attribute} is"):
            problem.add(quantity)
    taken = Grip()
    taken.name = "grip"
    with pytest.raises(ss.InputError, match="a quantity called `grip` already"):
        problem.add(taken)
    with pytest.raises(NotImplementedError, match="has no method"):
        problem.add(ss.Quantity())


def test_a_quantity_cannot_use_its_problem(problem: ss.Problem) -> None:
    """It would wait for itself."""

    class Greedy(Grip):
        def value(self, state: ss.State) -> float:
            return float(problem.solve().steps[-1].displacement.sum())

    with pytest.raises(
        ss.InputError, match="the problem is computing, and its callbacks cannot use it"
    ):
        problem.add(Greedy())
    assert problem.solve().steps


def test_exceptions_come_through(problem: ss.Problem) -> None:
    class Failing(Grip):
        fails = False

        def value(self, state: ss.State) -> float:
            if self.fails:
                raise ZeroDivisionError("in the middle of a march")
            return super().value(state)

    quantity = Failing()
    problem.add(quantity)
    quantity.fails = True
    with pytest.raises(ZeroDivisionError, match="in the middle"):
        problem.vjp(names="own")
    with pytest.raises(ZeroDivisionError, match="in the middle"):
        dict(problem.solve().quantities)
    quantity.fails = False
    assert problem.vjp(names="own")[0]["own"].shape == (4,)


def test_an_exception_belongs_to_one_call(
    problem: ss.Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if another one has stopped that call."""

    class Failing(Grip):
        fails = False
        failed = False

        def value(self, state: ss.State) -> float:
            if self.fails:
                self.failed = True
                raise ZeroDivisionError("of the quantity")
            return super().value(state)

    class Broken(Bar):
        def __init__(self, shown: bool, steps: int, what: str) -> None:
            super().__init__(False, steps, what)
            self.report = self.fail

        def fail(self, step: int, iterations: int, status: list[int]) -> None:
            if step == problem.steps:
                raise RuntimeError("of the bar")

    quantity = Failing()
    problem.add(quantity)
    quantity.fails = True
    with monkeypatch.context() as patched, pytest.raises(RuntimeError, match="of the bar"):
        patched.setattr("slipstick.problem.Bar", Broken)
        problem.vjp(names="own")
    assert quantity.failed
    quantity.fails = False
    assert problem.vjp(names="own")[0]["own"].shape == (4,)


BENT = {
    "body": [
        {
            "name": "beam",
            "box": {"min": [0, 0, 0], "max": [3, 1, 1], "elements": [3, 1, 1]},
            "material": {
                "j2_linear": {
                    "youngs_modulus": 1000.0,
                    "poisson_ratio": 0.3,
                    "yield_stress": 8.0,
                    "hardening_modulus": 120.0,
                }
            },
        }
    ],
    "dirichlet": [
        {"set": "beam_xmin"},
        {"set": "beam_xmax", "motion": [{"t": 1.0, "u": [0.1, -0.2, 0.0]}]},
    ],
    "load_path": {"steps": 3, "tolerance": {"relative": 1e-11}},
    "design": {"bodies": ["beam"], "volume_fraction": 0.8, "simp": {"p": 3.0, "min": 0.01}},
    "quantity": [{"name": "strain", "plastic_strain": {"body": "beam", "sharpness": 6}}],
    "optimizer": {"iterations": 1},
}


class PlasticWork(ss.Quantity):
    """The work of all elements, which tables have as `plastic_work`."""

    unit = "F L"
    reads = ("plastic_work",)

    def value(self, state: ss.State) -> float:
        return float(state.plastic_work.sum())

    def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
        return {"plastic_work": np.ones_like(state.plastic_work)}


class PlasticNorm(ss.Quantity):
    """The 6-norm of the strains, which is that of the case at full density."""

    reads = ("plastic_strain",)

    def value(self, state: ss.State) -> float:
        return float((state.plastic_strain**6).sum() ** (1 / 6))

    def derivative(self, state: ss.State) -> Mapping[str, ArrayLike]:
        return {"plastic_strain": (state.plastic_strain / self.value(state)) ** 5}


def test_plastic_work_and_strains_are_read() -> None:
    problem = ss.Case.from_dict(BENT, name="bent.toml").build()
    problem.add(PlasticWork())
    problem.add(PlasticNorm())
    solid = np.ones(3)
    table = problem.solve(solid).quantities
    assert table["plastic_work"][-1] > 0.01
    values, _ = problem.vjp(solid, ["PlasticWork", "PlasticNorm", "strain"])
    np.testing.assert_allclose(values["PlasticWork"], table["plastic_work"][-3:], rtol=1e-12)
    np.testing.assert_allclose(values["PlasticNorm"], values["strain"], rtol=1e-12)
    grey, direction = np.array([0.9, 0.7, 0.8]), np.array([1.0, -0.5, 0.3])
    for name in ("PlasticWork", "PlasticNorm"):
        weights = np.array([0.3, -0.2, 1.0])
        slope = problem.vjp(grey, name)[1]({name: weights}) @ direction

        def along(h: float, name: str = name, weights: NDArray[np.float64] = weights) -> float:
            return float(weights @ problem.vjp(grey + h * direction, name)[0][name])

        found = orders(along, slope)
        assert np.all(np.abs(found - 2.0) < 0.1), (name, found)
