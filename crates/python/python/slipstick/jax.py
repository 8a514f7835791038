"""Differentiable functions of a problem for JAX (extra ``slipstick[jax]``).

The functions are ``jax.custom_vjp`` over callbacks to the host. Their derivatives are those with
respect to the densities and to parameters such as friction, moduli and amplitudes.

| in JAX | |
|---|---|
| ``grad``, ``value_and_grad``, ``vjp`` | one adjoint solve |
| ``jacrev`` | one adjoint solve for each row of the Jacobian |
| ``jit`` | works; load paths are computed as without it |
| ``vmap`` | works; densities are analysed one after the other |
| ``jvp``, ``jacfwd`` | a ``TypeError``: there is no forward mode |
| ``hessian``, ``grad`` of ``grad`` | an error: there are no second derivatives |
| 32 bits, JAX's default | densities and results are rounded; analyses compute with 64 bits |
| arrays on a GPU | JAX copies them to the host and back; not tested |

``jax.config.update("jax_enable_x64", True)`` enables 64 bits.

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
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from .design_map import MappedProblem
from .gradient import Parameter, PullBack, Variants, chosen, vector
from .problem import Problem

__all__ = ["objective", "quantities"]

T = TypeVar("T")


class Differentiable(Protocol):
    """A function of densities, and of parameters by name."""

    def __call__(self, density: Any, parameters: Mapping[str, Any] | None = None) -> Any:
        """The value."""


class _Recent(Generic[T]):
    """The latest results by density and parameters: JAX passes only arrays from the forward to the
    reverse rule, and may call a callback more than once."""

    def __init__(
        self, compute: Callable[[NDArray[np.float64], NDArray[np.float64]], T], keep: int
    ) -> None:
        self._compute = compute
        self._keep = keep
        self._known: OrderedDict[tuple[bytes, bytes], T] = OrderedDict()
        self._lock = threading.Lock()

    def __call__(self, density: NDArray[np.float64], values: NDArray[np.float64]) -> T:
        key = density.tobytes(), values.tobytes()
        with self._lock:
            if key in self._known:
                self._known.move_to_end(key)
                return self._known[key]
            # drop the oldest first: paths and their factors may be large
            while len(self._known) >= self._keep:
                self._known.popitem(last=False)
            self._known[key] = result = self._compute(density, values)
            return result


def _host(array: Any) -> NDArray[np.float64]:
    return np.ascontiguousarray(np.asarray(array), dtype=np.float64)


def quantities(
    problem: Problem | MappedProblem, names: str | Sequence[str] | None = None, *, keep: int = 1
) -> Differentiable:
    """Quantities at all load steps as a differentiable function of densities and parameters.

    Parameters
    ----------
    problem : Problem or MappedProblem
        The problem.
    names : str or sequence of str, optional
        Quantities of the case; by default all of them.
    keep : int
        Number of load paths to keep for gradients. A gradient whose path was not kept computes the
        path again.

    Returns
    -------
    callable
        Takes densities, shape (elements,), and optionally a dict of parameters; returns a dict with
        an array of shape (steps,) for each name. Keys of the parameters are their names, such as
        ``"contact[0].friction"``; :attr:`slipstick.Problem.parameters` lists them. New parameter
        values rebuild the problem.

    Examples
    --------
    >>> import jax
    >>> import slipstick as ss
    >>> jax.config.update("jax_enable_x64", True)
    >>> text = ss.Case.template("cube-on-cuboid").text
    >>> drag = '[[quantity]]\\nname = "drag"\\nreaction = { set = "cube_ymax", component = "x" }'
    >>> problem = ss.Case.from_text(f"{text}\\n{drag}\\n").build()
    >>> f = ss.jax.quantities(problem, ["drag"])
    >>> jax.jit(jax.grad(lambda x: f(x)["drag"][-1]))(problem.initial_density).shape
    (5,)
    >>> g = jax.grad(lambda mu: f(problem.initial_density, {"contact[0].friction": mu})["drag"][-1])
    >>> bool(g(0.1) > 0)
    True
    """
    wanted = chosen(names, problem.quantities)
    shape = (len(wanted), problem.steps)
    _check_keep(keep)
    variants = Variants(problem)

    def make(parameters: tuple[Parameter, ...]) -> Callable[[jax.Array, jax.Array], jax.Array]:
        def linearize(
            density: NDArray[np.float64], values: NDArray[np.float64]
        ) -> tuple[NDArray[np.float64], PullBack]:
            found, pullback = variants.at(parameters, values).vjp(density, wanted)
            return np.stack(list(found.values())), pullback

        recent = _Recent(linearize, keep)

        def values_on_host(dtype: Any, density: Any, values: Any) -> NDArray[Any]:
            return recent(_host(density), _host(values))[0].astype(dtype)

        def pull_back_on_host(
            density: Any, values: Any, weights: Any
        ) -> tuple[NDArray[Any], NDArray[Any]]:
            pullback = recent(_host(density), _host(values))[1]
            of_parameters = np.zeros(0)
            if parameters:
                gradient, found = pullback.with_parameters(_host(weights))
                of_parameters = vector(found, parameters)
            else:
                gradient = pullback(_host(weights))
            return (
                gradient.astype(np.asarray(density).dtype),
                of_parameters.astype(np.asarray(values).dtype),
            )

        @jax.custom_vjp
        def table(density: jax.Array, values: jax.Array) -> jax.Array:
            # floats may be others when the callback runs
            result = jax.ShapeDtypeStruct(shape, _float())
            return jax.pure_callback(
                partial(values_on_host, result.dtype),
                result,
                density,
                values,
                vmap_method="sequential",
            )

        def forward(
            density: jax.Array, values: jax.Array
        ) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
            return table(density, values), (density, values)

        def reverse(
            at: tuple[jax.Array, jax.Array], weights: jax.Array
        ) -> tuple[jax.Array, jax.Array]:
            results = tuple(jax.ShapeDtypeStruct(of.shape, of.dtype) for of in at)
            found: tuple[jax.Array, jax.Array] = jax.pure_callback(
                pull_back_on_host, results, *at, weights, vmap_method="sequential"
            )
            return found

        table.defvjp(forward, reverse)
        return table

    table_of = _by_parameters(variants, make)

    def function(density: Any, parameters: Mapping[str, Any] | None = None) -> dict[str, jax.Array]:
        return dict(zip(wanted, table_of(density, parameters), strict=True))

    return function


def objective(problem: Problem | MappedProblem, *, keep: int = 1) -> Differentiable:
    """The objective of the case as a differentiable function of densities and parameters.

    Parameters
    ----------
    problem : Problem or MappedProblem
        A problem with an objective.
    keep : int
        Number of gradients to keep until they are used.

    Returns
    -------
    callable
        Takes densities, shape (elements,), and optionally a dict of parameters as for
        :func:`quantities`; returns the objective.

    Raises
    ------
    InputError
        If the case has no objective.
    """
    _check_keep(keep)
    problem._require_objective()
    variants = Variants(problem)

    def make(parameters: tuple[Parameter, ...]) -> Callable[[jax.Array, jax.Array], jax.Array]:
        def differentiate(
            density: NDArray[np.float64], values: NDArray[np.float64]
        ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
            at = variants.at(parameters, values)
            if not parameters:
                return *at.value_and_gradient(density), np.zeros(0)
            value, gradient, found = at.value_and_gradient(density, parameters=True)
            return value, gradient, vector(found, parameters)

        recent = _Recent(differentiate, keep)

        def value_on_host(dtype: Any, density: Any, values: Any) -> NDArray[Any]:
            at = variants.at(parameters, _host(values))
            return np.asarray(at.solve(_host(density)).objective, dtype=dtype)

        def all_on_host(
            dtype: Any, density: Any, values: Any
        ) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
            value, gradient, of_parameters = recent(_host(density), _host(values))
            return (
                np.asarray(value, dtype=dtype),
                gradient.astype(np.asarray(density).dtype),
                of_parameters.astype(np.asarray(values).dtype),
            )

        @jax.custom_vjp
        def function(density: jax.Array, values: jax.Array) -> jax.Array:
            result = jax.ShapeDtypeStruct((), _float())
            return jax.pure_callback(
                partial(value_on_host, result.dtype),
                result,
                density,
                values,
                vmap_method="sequential",
            )

        def forward(
            density: jax.Array, values: jax.Array
        ) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
            result = (
                jax.ShapeDtypeStruct((), _float()),
                jax.ShapeDtypeStruct(density.shape, density.dtype),
                jax.ShapeDtypeStruct(values.shape, values.dtype),
            )
            value, *gradients = jax.pure_callback(
                partial(all_on_host, result[0].dtype),
                result,
                density,
                values,
                vmap_method="sequential",
            )
            return value, tuple(gradients)

        def reverse(
            gradients: tuple[jax.Array, jax.Array], weight: jax.Array
        ) -> tuple[jax.Array, ...]:
            return tuple((weight * gradient).astype(gradient.dtype) for gradient in gradients)

        function.defvjp(forward, reverse)
        return function

    return _by_parameters(variants, make)


def _by_parameters(
    variants: Variants,
    make: Callable[[tuple[Parameter, ...]], Callable[[jax.Array, jax.Array], jax.Array]],
) -> Differentiable:
    """A function for each selection of parameters, made when it is first needed."""
    known: dict[tuple[Parameter, ...], Callable[[jax.Array, jax.Array], jax.Array]] = {}

    def function(density: Any, parameters: Mapping[str, Any] | None = None) -> jax.Array:
        given = dict(parameters or {})
        wanted = variants.find(list(given))
        if wanted not in known:
            known[wanted] = make(wanted)
        values = [jnp.asarray(value, dtype=_float()) for value in given.values()]
        for parameter, value in zip(wanted, values, strict=True):
            if value.shape != ():
                raise ValueError(
                    f"parameters[{parameter.name!r}] has shape {value.shape}: give one number"
                )
        stacked = jnp.stack(values) if values else jnp.zeros(0, _float())
        return known[wanted](_real(density), stacked)

    return function


def _float() -> Any:
    """The floats of JAX: 32 bits unless 64 are enabled."""
    return jnp.result_type(float)


def _real(density: Any) -> jax.Array:
    array = jnp.asarray(density)
    return array if jnp.issubdtype(array.dtype, jnp.floating) else array.astype(_float())


def _check_keep(keep: int) -> None:
    if keep < 1:
        raise ValueError(f"keep is {keep}: give 1 or more")
