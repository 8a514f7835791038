"""Quantities that users define in numpy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from .path import SlaveNodes

__all__ = ["ContactState", "PreviousState", "Quantity", "State"]


@dataclass(frozen=True, eq=False)
class ContactState(SlaveNodes):
    """Contact data of all slave nodes for a quantity. Empty unless the quantity reads them.

    Attributes
    ----------
    node : ndarray of int, shape (k,)
        The slave nodes, pair by pair.
    pair : ndarray of int, shape (k,)
        Number of the contact pair, from 0.
    status : ndarray of uint8, shape (k,)
        0 open, 1 stick, 2 slip.
    multiplier : ndarray, shape (k, 3)
        Multiplier in the node's frame (normal and two tangents), normal at least 0 in compression.
        [F/L²]
    vector : ndarray, shape (k, 3)
        The multiplier as a vector z; -area · z is the contact force on the slave. [F/L²]
    gap : ndarray, shape (k,)
        Weighted gap, at least 0 where open. [L³]
    slip : ndarray, shape (k, 2)
        Weighted slip increment of the last (sub-)step. [L³]
    area : ndarray, shape (k,)
        Area of the part of the surface that faces the master. [L²]
    reference_area : ndarray, shape (k,)
        Area of the surface around the node in the reference configuration. [L²]
    """

    multiplier: NDArray[np.float64]
    vector: NDArray[np.float64]
    gap: NDArray[np.float64]
    slip: NDArray[np.float64]
    area: NDArray[np.float64]
    reference_area: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PreviousState:
    """The state at the start of a (sub-)step, as increments see it. Empty unless read.

    Attributes
    ----------
    displacement : ndarray, shape (nodes, 3)
        Displacements. [L]
    external_force : ndarray, shape (nodes, 3)
        Forces of the loads. [F]
    reaction : ndarray, shape (nodes, 3)
        Forces of the supports. [F]
    multiplier : ndarray, shape (slave nodes, 3)
        Multipliers as in :class:`ContactState`, 0 at open nodes; empty unless the quantity also reads
        contact. [F/L²]
    """

    displacement: NDArray[np.float64]
    external_force: NDArray[np.float64]
    reaction: NDArray[np.float64]
    multiplier: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class State:
    """The data of a state at the end of a load step that a quantity can read.

    Attributes
    ----------
    step, steps : int
        The load step, from 1, and the number of load steps, both within the load case.
    time : float
        Pseudo-time; load case k starts at 2 k.
    displacement : ndarray, shape (nodes, 3)
        Displacements. [L]
    internal_force, external_force : ndarray, shape (nodes, 3)
        Internal forces of the bodies and forces of the loads. [F]
    reaction : ndarray, shape (nodes, 3)
        Forces of the supports; empty unless the quantity reads it. [F]
    density : ndarray, shape (elements,)
        Densities.
    energy : ndarray, shape (elements,)
        Strain energies; empty unless the quantity reads it. [F L]
    stress : ndarray, shape (elements, 8)
        Von Mises stresses of the solid material at the Gauss points, 0 for entries without a point;
        empty unless the quantity reads it. [F/L²]
    plastic_work : ndarray, shape (elements,)
        Plastic work since rest, 0 in elastic elements; empty unless the quantity reads it, and
        without plastic materials. [F L]
    plastic_strain : ndarray, shape (elements, 8)
        Equivalent plastic strains at the Gauss points, as for the stress; empty unless the quantity
        reads it.
    contact : ContactState
        Contact data of all slave nodes.
    previous : PreviousState
        The state at the start of the (sub-)step.
    """

    step: int
    steps: int
    time: float
    displacement: NDArray[np.float64]
    internal_force: NDArray[np.float64]
    external_force: NDArray[np.float64]
    reaction: NDArray[np.float64]
    density: NDArray[np.float64]
    energy: NDArray[np.float64]
    stress: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    plastic_strain: NDArray[np.float64]
    contact: ContactState
    previous: PreviousState


_UNITS = {
    "": (0, 0),
    "L": (0, 1),
    "L²": (0, 2),
    "L³": (0, 3),
    "F": (1, 0),
    "F L": (1, 1),
    "F/L²": (1, -2),
}

# Data of the elements, with the names of the list in Rust.
_ELEMENTS = ("energy", "stress", "plastic_work", "plastic_strain")

_READS = ("reaction", "contact", *_ELEMENTS, "previous")

_DERIVATIVES = (
    *("displacement", "internal_force", "external_force", "reaction", "density", *_ELEMENTS),
    *(f"contact.{name}" for name in ("multiplier", "vector", "gap", "slip", "area")),
    *(f"previous.{name}" for name in ("displacement", "external_force", "reaction", "multiplier")),
)


class Quantity:
    """A custom quantity: derive a class, define `value` and `derivative`, and register it.

    :meth:`slipstick.Problem.add` compares the derivative with differences of the value. From then
    on, ``vjp``, ``check_gradient`` and the tables of paths know the quantity by its name. The
    methods are called while the problem is computing, so they must not use the problem.

    Attributes
    ----------
    name : str
        Name of the quantity; by default that of the class.
    unit : str
        Unit in force F and length L: "", "L", "L²", "L³", "F", "F L" or "F/L²".
    reads : tuple of str
        The data that the state must contain: any of "reaction", "contact", "energy", "stress",
        "plastic_work", "plastic_strain", "previous".
    accumulates : bool
        Whether the value is an increment; the quantity at a load step is then the sum over all
        (sub-)steps since the start of the load case.

    Examples
    --------
    >>> import numpy as np
    >>> import slipstick as ss
    >>> class MeanSquare(ss.Quantity):
    ...     unit = "L²"
    ...     def value(self, state):
    ...         return np.mean(state.displacement**2)
    ...     def derivative(self, state):
    ...         return {"displacement": 2.0 * state.displacement / state.displacement.size}
    >>> problem = ss.Case.template("cube-on-cuboid").build()
    >>> problem.add(MeanSquare())
    >>> values, pullback = problem.vjp(names="MeanSquare")
    >>> pullback({"MeanSquare": np.eye(10)[-1]}).shape          # of the last load step
    (5,)
    """

    name: str = ""
    unit: str = ""
    reads: tuple[str, ...] = ()
    accumulates: bool = False

    def value(self, state: State) -> float:
        """The value at a state.

        Parameters
        ----------
        state : State
            The state.

        Returns
        -------
        float
        """
        raise NotImplementedError(f"{type(self).__name__} has no method `value`")

    def derivative(self, state: State) -> Mapping[str, ArrayLike]:
        """Partial derivatives of the value.

        Parameters
        ----------
        state : State
            The state.

        Returns
        -------
        mapping of str to array
            For each field of the state that the value depends on, an array of the field's shape:
            the derivatives with the other fields fixed. Fields of the contact and of the state
            before are named ``"contact.gap"``, ``"previous.displacement"``, and so on.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method `derivative`")


class Adapter:
    """Calls a quantity with a state, and checks what it returns."""

    def __init__(self, quantity: Quantity, name: str) -> None:
        self._quantity = quantity
        self._name = name

    def value(self, data: dict[str, Any]) -> float:
        value = self._quantity.value(_state(data))
        try:
            return float(value)
        except (TypeError, ValueError):
            raise TypeError(f"{self._name}.value returned {value!r}: return a number") from None

    def derivative(self, data: dict[str, Any]) -> dict[str, NDArray[np.float64]]:
        state = _state(data)
        found = self._quantity.derivative(state)
        if not isinstance(found, Mapping):
            raise TypeError(
                f"{self._name}.derivative returned {type(found).__name__}: return a dict of arrays"
            )
        checked = {}
        for key, entries in found.items():
            if key not in _DERIVATIVES:
                known = ", ".join(_DERIVATIVES)
                raise ValueError(
                    f"{self._name}.derivative returned the key {key!r}: the fields are {known}"
                )
            expected: NDArray[np.float64] = attrgetter(key)(state)
            place = f"{self._name}.derivative()[{key!r}]"
            checked[key] = _arrays.real(entries, place, expected.shape, f"as state.{key}")
        return checked


Definition = tuple[Any, str, tuple[int, int], list[str], bool]


def definition(quantity: Quantity) -> Definition:
    """A quantity as the extension takes it, once its attributes are checked."""
    if not isinstance(quantity, Quantity):
        raise TypeError(
            f"quantity is of type {type(quantity).__name__}: "
            "derive its class from slipstick.Quantity"
        )
    name = name_of(quantity)
    if quantity.unit not in _UNITS:
        units = ", ".join(repr(unit) for unit in _UNITS)
        raise ValueError(f"{name}.unit is {quantity.unit!r}: give one of {units}")
    unknown = [read for read in quantity.reads if read not in _READS]
    if isinstance(quantity.reads, str) or unknown:
        raise ValueError(
            f"{name}.reads is {quantity.reads!r}: give a tuple of any of {', '.join(_READS)}"
        )
    adapter = Adapter(quantity, name)
    return adapter, name, _UNITS[quantity.unit], list(quantity.reads), bool(quantity.accumulates)


def name_of(quantity: Quantity) -> str:
    """The name of a quantity."""
    return quantity.name or type(quantity).__name__


def _state(data: dict[str, Any]) -> State:
    for part in (data, data["contact"], data["previous"]):
        for array in part.values():
            if isinstance(array, np.ndarray):
                _arrays.frozen(array)
    parts: dict[str, Any] = {
        "contact": ContactState(**data["contact"]),
        "previous": PreviousState(**data["previous"]),
    }
    return State(**{field.name: parts.get(field.name, data[field.name]) for field in fields(State)})
