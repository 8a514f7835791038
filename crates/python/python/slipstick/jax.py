"""Differentiable functions of a problem for JAX (extra ``slipstick[jax]``).

The functions are ``jax.custom_vjp`` over callbacks, so that ``jax.grad``, ``jax.vjp`` and
``jax.jit`` work; under ``jax.vmap``, densities are analysed one after the other. There are no
second derivatives and no forward mode.

Analyses compute with 64-bit floats. Enable them in JAX, too, unless 7 digits are enough:
``jax.config.update("jax_enable_x64", True)``.

Examples
--------
>>> import jax
>>> import slipstick as ss
>>> jax.config.update("jax_enable_x64", True)
>>> problem = ss.Case.template("cube-on-cuboid").build()
>>> f = ss.jax.objective(problem)
>>> value, gradient = jax.value_and_grad(f)(problem.initial_density)
>>> round(float(value), 6), gradient.shape
(-8.308292, (5,))
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from .gradient import PullBack
from .problem import Problem

__all__ = ["objective", "quantities"]

T = TypeVar("T")


class _Recent(Generic[T]):
    """The latest results by density: JAX passes only arrays from the forward to the reverse rule,
    and may call a callback more than once."""

    def __init__(self, compute: Callable[[NDArray[np.float64]], T], keep: int) -> None:
        self._compute = compute
        self._keep = keep
        self._known: OrderedDict[bytes, T] = OrderedDict()
        self._lock = threading.Lock()

    def __call__(self, density: NDArray[np.float64]) -> T:
        key = density.tobytes()
        with self._lock:
            if key in self._known:
                self._known.move_to_end(key)
                return self._known[key]
            # drop the oldest first: paths and their factors may be large
            while len(self._known) >= self._keep:
                self._known.popitem(last=False)
            self._known[key] = result = self._compute(density)
            return result


def _host(array: Any) -> NDArray[np.float64]:
    return np.ascontiguousarray(np.asarray(array), dtype=np.float64)


def quantities(
    problem: Problem, names: str | Sequence[str] | None = None, *, keep: int = 1
) -> Callable[[Any], dict[str, jax.Array]]:
    """Quantities at all load steps as a differentiable function of the densities.

    Parameters
    ----------
    problem : Problem
        The problem.
    names : str or sequence of str, optional
        Quantities of the case; by default all of them.
    keep : int
        Number of load paths that are kept for reverse passes. A reverse pass whose path is gone
        computes it again.

    Returns
    -------
    callable
        From densities, shape (elements,), to a dict with an array of shape (steps,) for each name.

    Examples
    --------
    >>> import jax
    >>> import slipstick as ss
    >>> text = ss.Case.template("cube-on-cuboid").text
    >>> drag = '[[quantity]]\\nname = "drag"\\nreaction = { set = "cube_ymax", component = "x" }'
    >>> problem = ss.Case.from_text(f"{text}\\n{drag}\\n").build()
    >>> f = ss.jax.quantities(problem, ["drag"])
    >>> jax.jit(jax.grad(lambda x: f(x)["drag"][-1]))(problem.initial_density).shape
    (5,)
    """
    wanted = (
        problem.quantities if names is None else [names] if isinstance(names, str) else list(names)
    )
    shape = (len(wanted), problem.steps)
    _check_keep(keep)

    def linearize(density: NDArray[np.float64]) -> tuple[NDArray[np.float64], PullBack]:
        values, pullback = problem.vjp(density, wanted)
        return np.stack(list(values.values())), pullback

    recent = _Recent(linearize, keep)

    def values_on_host(density: Any) -> NDArray[Any]:
        return recent(_host(density))[0].astype(_float())

    def pull_back_on_host(density: Any, weights: Any) -> NDArray[Any]:
        gradient = recent(_host(density))[1](_host(weights))
        return gradient.astype(np.asarray(density).dtype)

    @jax.custom_vjp
    def table(density: jax.Array) -> jax.Array:
        result = jax.ShapeDtypeStruct(shape, _float())
        return jax.pure_callback(values_on_host, result, density, vmap_method="sequential")

    def forward(density: jax.Array) -> tuple[jax.Array, jax.Array]:
        return table(density), density

    def reverse(density: jax.Array, weights: jax.Array) -> tuple[jax.Array]:
        result = jax.ShapeDtypeStruct(density.shape, density.dtype)
        return (
            jax.pure_callback(
                pull_back_on_host, result, density, weights, vmap_method="sequential"
            ),
        )

    table.defvjp(forward, reverse)

    def function(density: Any) -> dict[str, jax.Array]:
        return dict(zip(wanted, table(_real(density)), strict=True))

    return function


def objective(problem: Problem, *, keep: int = 1) -> Callable[[Any], jax.Array]:
    """The objective of the case as a differentiable function of the densities.

    Parameters
    ----------
    problem : Problem
        A problem with an objective.
    keep : int
        Number of gradients that are kept for reverse passes.

    Returns
    -------
    callable
        From densities, shape (elements,), to the objective.
    """
    _check_keep(keep)
    recent = _Recent(lambda density: problem.value_and_gradient(density), keep)

    def value_on_host(density: Any) -> NDArray[Any]:
        value = problem.solve(_host(density)).objective
        return np.asarray(value, dtype=_float())

    def both_on_host(density: Any) -> tuple[NDArray[Any], NDArray[Any]]:
        value, gradient = recent(_host(density))
        return np.asarray(value, dtype=_float()), gradient.astype(np.asarray(density).dtype)

    @jax.custom_vjp
    def function(density: jax.Array) -> jax.Array:
        result = jax.ShapeDtypeStruct((), _float())
        return jax.pure_callback(value_on_host, result, density, vmap_method="sequential")

    def forward(density: jax.Array) -> tuple[jax.Array, jax.Array]:
        result = (
            jax.ShapeDtypeStruct((), _float()),
            jax.ShapeDtypeStruct(density.shape, density.dtype),
        )
        value, gradient = jax.pure_callback(both_on_host, result, density, vmap_method="sequential")
        return value, gradient

    def reverse(gradient: jax.Array, weight: jax.Array) -> tuple[jax.Array]:
        return ((weight * gradient).astype(gradient.dtype),)

    function.defvjp(forward, reverse)
    return lambda density: function(_real(density))


def _float() -> Any:
    """The floats of JAX: 32 bits unless 64 are enabled."""
    return jnp.result_type(float)


def _real(density: Any) -> jax.Array:
    array = jnp.asarray(density)
    return array if jnp.issubdtype(array.dtype, jnp.floating) else array.astype(_float())


def _check_keep(keep: int) -> None:
    if keep < 1:
        raise ValueError(f"keep is {keep}: give 1 or more")
