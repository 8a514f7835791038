"""Differentiable functions of a problem for PyTorch (extra ``slipstick[torch]``).

The functions are ``torch.autograd.Function``: ``backward`` and ``torch.autograd.gradcheck`` work.
There are no second derivatives. Analyses compute with 64-bit floats on the CPU; results have the
type and the device of the densities.

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

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.autograd.function import once_differentiable

from .problem import Problem

__all__ = ["objective", "quantities"]


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
        ctx: Any, density: torch.Tensor, problem: Problem, names: list[str]
    ) -> torch.Tensor:
        # the path lives as long as the graph
        values, ctx.pullback = problem.vjp(_host(density), names)
        return _like(np.stack(list(values.values())), density)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, weights: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        return _like(ctx.pullback(_host(weights)), weights), None, None


class _Objective(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, density: torch.Tensor, problem: Problem) -> torch.Tensor:
        if density.requires_grad:
            value, gradient = problem.value_and_gradient(_host(density))
            ctx.save_for_backward(_like(gradient, density))
        else:
            value = problem.solve(_host(density)).objective or 0.0
        return torch.tensor(value, device=density.device, dtype=density.dtype)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, weight: torch.Tensor) -> tuple[torch.Tensor, None]:
        (gradient,) = ctx.saved_tensors
        return weight * gradient, None


def quantities(
    problem: Problem, names: str | Sequence[str] | None = None
) -> Callable[[torch.Tensor], dict[str, torch.Tensor]]:
    """Quantities at all load steps as a differentiable function of the densities.

    Parameters
    ----------
    problem : Problem
        The problem.
    names : str or sequence of str, optional
        Quantities of the case; by default all of them.

    Returns
    -------
    callable
        From densities, shape (elements,), to a dict with a tensor of shape (steps,) for each name.

    Examples
    --------
    >>> import slipstick as ss
    >>> import torch
    >>> text = ss.Case.template("cube-on-cuboid").text
    >>> drag = '[[quantity]]\\nname = "drag"\\nreaction = { set = "cube_ymax", component = "x" }'
    >>> problem = ss.Case.from_text(f"{text}\\n{drag}\\n").build()
    >>> f = ss.torch.quantities(problem, ["drag"])
    >>> density = torch.tensor(problem.initial_density, requires_grad=True)
    >>> f(density)["drag"][-1].backward()
    """
    wanted = (
        problem.quantities if names is None else [names] if isinstance(names, str) else list(names)
    )

    def function(density: torch.Tensor) -> dict[str, torch.Tensor]:
        table = _Quantities.apply(_check(density), problem, wanted)
        return dict(zip(wanted, table.unbind(0), strict=True))

    return function


def objective(problem: Problem) -> Callable[[torch.Tensor], torch.Tensor]:
    """The objective of the case as a differentiable function of the densities.

    Parameters
    ----------
    problem : Problem
        A problem with an objective.

    Returns
    -------
    callable
        From densities, shape (elements,), to the objective, a tensor without dimensions.
    """

    def function(density: torch.Tensor) -> torch.Tensor:
        result: torch.Tensor = _Objective.apply(_check(density), problem)
        return result

    return function
