"""Checks of array arguments: the exception names the argument and the cure."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def real(
    entries: ArrayLike, name: str, shape: tuple[int, ...], meaning: str
) -> NDArray[np.float64]:
    """Finite real numbers of this shape, contiguous; `meaning` says what the shape means."""
    try:
        array: NDArray[Any] = np.asarray(entries)
    except ValueError as error:
        raise ValueError(f"{name} is not a rectangular array: {error}") from None
    if array.dtype.kind not in "biuf":
        raise TypeError(
            f"{name} has dtype {array.dtype}: give real numbers, for instance as "
            f"np.asarray({name}, dtype=float)"
        )
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}: give {shape}, {meaning}")
    result = np.ascontiguousarray(array, dtype=np.float64)
    finite = np.isfinite(result)
    if not finite.all():
        place = tuple(int(i) for i in np.argwhere(~finite)[0])
        at = ", ".join(map(str, place))
        raise ValueError(f"{name}[{at}] is {result[place]}: all entries must be finite numbers")
    return result


def density(entries: ArrayLike, elements: int, name: str = "density") -> NDArray[np.float64]:
    """Densities of all elements, in [0, 1]."""
    meaning = "one density for each element of the mesh"
    result = real(entries, name, (elements,), meaning)
    outside = (result < 0.0) | (result > 1.0)
    if outside.any():
        element = int(np.argmax(outside))
        raise ValueError(
            f"{name}[{element}] is {result[element]}: densities lie in [0, 1]; "
            f"np.clip({name}, 0, 1) puts them there"
        )
    return result
