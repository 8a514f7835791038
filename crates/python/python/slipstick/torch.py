"""Differentiable functions of a problem for PyTorch (extra ``slipstick[torch]``).

The functions are ``torch.autograd.Function``; analyses use 64-bit floats on the CPU.

| in PyTorch | |
|---|---|
| ``backward``, ``torch.autograd.grad`` | one adjoint solve |
| ``torch.autograd.gradcheck`` | passes |
| derivatives of derivatives | a ``RuntimeError``: there are no second derivatives |
| ``torch.func`` and ``torch.compile`` | not supported |
| 32 bits | densities and results are rounded; results have the type of the densities |
| tensors on a GPU | are copied to the host; results return to their device; not tested |

Examples
--------
>>> import slipstick as ss
>>> import torch
>>> problem = ss.Case.template("cube-on-cuboid").build()
>>> f = ss.torch.objective(problem)
>>> density = torch.tensor(problem.initial_density, requires_grad=True)
>>> f(density).backward()
>>> density.grad.shape
torch.Size([5])
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch.autograd.function import once_differentiable

from .design_map import MappedProblem
from .gradient import Parameter, Variants, chosen, vector
from .problem import Problem

__all__ = ["objective", "quantities"]

T_co = TypeVar("T_co", covariant=True)


def _host(tensor: torch.Tensor) -> NDArray[np.float64]:
    return tensor.detach().cpu().to(torch.float64).contiguous().numpy()


def _like(array: NDArray[np.float64], tensor: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(np.array(array)).to(device=tensor.device, dtype=tensor.dtype)


def _check(density: Any) -> torch.Tensor:
    if not isinstance(density, torch.Tensor):
        raise TypeError(f"density is of type {type(density).__name__}: give a torch.Tensor")
    if not density.dtype.is_floating_point:
        raise TypeError(f"density has dtype {density.dtype}: give floating-point numbers")
    return density


class _Quantities(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        density: torch.Tensor,
        values: torch.Tensor,
        at: Any,
        names: list[str],
        parameters: tuple[Parameter, ...],
    ) -> torch.Tensor:
        # the path lives as long as the graph
        found, ctx.pullback = at(parameters, _host(values)).vjp(_host(density), names)
        ctx.parameters = parameters
        ctx.like = density, values
        return _like(np.stack(list(found.values())), density)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, weights: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        density, values = ctx.like
        if not ctx.needs_input_grad[1]:
            return _like(ctx.pullback(_host(weights)), density), None, None, None, None
        gradient, found = ctx.pullback.with_parameters(_host(weights))
        of_parameters = _like(vector(found, ctx.parameters), values)
        return _like(gradient, density), of_parameters, None, None, None


class _Objective(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        density: torch.Tensor,
        values: torch.Tensor,
        at: Any,
        parameters: tuple[Parameter, ...],
    ) -> torch.Tensor:
        problem = at(parameters, _host(values))
        of_density, of_values, *_ = ctx.needs_input_grad
        if of_values:
            value, gradient, found = problem.value_and_gradient(_host(density), parameters=True)
            of_parameters = _like(vector(found, parameters), values)
            ctx.save_for_backward(_like(gradient, density), of_parameters)
        elif of_density:
            value, gradient = problem.value_and_gradient(_host(density))
            ctx.save_for_backward(_like(gradient, density))
        else:
            value = problem.solve(_host(density)).objective
        return torch.tensor(value, device=density.device, dtype=density.dtype)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, weight: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        gradient, *others = (weight * saved for saved in ctx.saved_tensors)
        return gradient, others[0] if others else None, None, None


def _values(
    variants: Variants, parameters: Mapping[str, Any] | None
) -> tuple[tuple[Parameter, ...], torch.Tensor]:
    """The parameters of these names, and their values as one tensor, on the CPU."""
    given = dict(parameters or {})
    wanted = variants.find(list(given))
    tensors = []
    for parameter, value in zip(wanted, given.values(), strict=True):
        tensor = torch.as_tensor(value, dtype=torch.float64, device="cpu")
        if tensor.shape != ():
            raise ValueError(
                f"parameters[{parameter.name!r}] has shape {tuple(tensor.shape)}: give one number"
            )
        tensors.append(tensor)
    return wanted, torch.stack(tensors) if tensors else torch.zeros(0, dtype=torch.float64)


class Differentiable(Protocol[T_co]):
    """A function of densities, and of parameters by name."""

    def __call__(self, density: torch.Tensor, parameters: Mapping[str, Any] | None = None) -> T_co:
        """The value."""
        ...


def quantities(
    problem: Problem | MappedProblem, names: str | Sequence[str] | None = None
) -> Differentiable[dict[str, torch.Tensor]]:
    """Quantities at all load steps as a differentiable function of densities and parameters.

    Parameters
    ----------
    problem : Problem or MappedProblem
        The problem.
    names : str or sequence of str, optional
        Quantities of the case; by default all of them.

    Returns
    -------
    callable
        Takes densities, shape (elements,), and optionally a dict of parameters; returns a dict with
        a tensor of shape (steps,) for each name. Keys of the parameters are their names, such as
        ``"contact[0].friction"``; :attr:`slipstick.Problem.parameters` lists them. Their values are
        numbers or tensors without dimensions. New parameter values rebuild the problem.

    Examples
    --------
    >>> import slipstick as ss
    >>> import torch
    >>> text = ss.Case.template("cube-on-cuboid").text
    >>> drag = '[[quantity]]\\nname = "drag"\\nreaction = { set = "cube_ymax", component = "x" }'
    >>> problem = ss.Case.from_text(f"{text}\\n{drag}\\n").build()
    >>> f = ss.torch.quantities(problem, ["drag"])
    >>> density = torch.tensor(problem.initial_density, requires_grad=True)
    >>> friction = torch.tensor(0.1, requires_grad=True)
    >>> f(density, {"contact[0].friction": friction})["drag"][-1].backward()
    >>> density.grad.shape, bool(friction.grad > 0)
    (torch.Size([5]), True)
    """
    wanted = chosen(names, problem.quantities)
    variants = Variants(problem)

    def function(
        density: torch.Tensor, parameters: Mapping[str, Any] | None = None
    ) -> dict[str, torch.Tensor]:
        given, values = _values(variants, parameters)
        table = _Quantities.apply(_check(density), values, variants.at, wanted, given)
        return dict(zip(wanted, table.unbind(0), strict=True))

    return function


def objective(problem: Problem | MappedProblem) -> Differentiable[torch.Tensor]:
    """The objective of the case as a differentiable function of densities and parameters.

    Parameters
    ----------
    problem : Problem or MappedProblem
        A problem with an objective.

    Returns
    -------
    callable
        Takes densities, shape (elements,), and optionally a dict of parameters as for
        :func:`quantities`; returns the objective, a tensor without dimensions.

    Raises
    ------
    InputError
        If the case has no objective.
    """
    problem._require_objective()
    variants = Variants(problem)

    def function(
        density: torch.Tensor, parameters: Mapping[str, Any] | None = None
    ) -> torch.Tensor:
        given, values = _values(variants, parameters)
        result: torch.Tensor = _Objective.apply(_check(density), values, variants.at, given)
        return result

    return function
