"""Checks of array arguments: the exception names the argument and the remedy."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

T = TypeVar("T", bound=np.generic)


def frozen(array: NDArray[T]) -> NDArray[T]:
    """The same array, which can then only be read."""
    array.setflags(write=False)
    return array


def rectangular(entries: ArrayLike, name: str) -> NDArray[Any]:
    """An array of anything."""
    try:
        array: NDArray[Any] = np.asarray(entries)
    except ValueError as error:
        raise ValueError(f"{name} is not a rectangular array: {error}") from None
    return array


def real(
    entries: ArrayLike, name: str, shape: tuple[int | None, ...], meaning: str
) -> NDArray[np.float64]:
    """Finite real numbers, contiguous. In `shape`, None stands for any number; `meaning` says what
    the shape means."""
    array = rectangular(entries, name)
    if array.dtype.kind not in "biuf":
        raise TypeError(
            f"{name} has dtype {array.dtype}: give real numbers, for instance as "
            f"np.asarray({name}, dtype=float)"
        )
    if array.ndim == len(shape):
        pairs = zip(shape, array.shape, strict=True)
        shape = tuple(found if wanted is None else wanted for wanted, found in pairs)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}: give {_written(shape)}, {meaning}")
    # which would make a single number an array of one
    result = np.ascontiguousarray(array, dtype=np.float64).reshape(array.shape)
    finite = np.isfinite(result)
    if not finite.all():
        place = tuple(int(i) for i in np.argwhere(~finite)[0])
        at = f"[{', '.join(map(str, place))}]" if place else ""
        raise ValueError(f"{name}{at} is {result[place]}: numbers must be finite")
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


def members(entries: ArrayLike, name: str, count: int, what: str) -> NDArray[np.int64]:
    """Numbers of nodes or elements, each below `count`."""
    array = rectangular(entries, name)
    if array.size == 0:
        return np.zeros(0, dtype=np.int64)
    if array.dtype.kind not in "iu":
        hint = f"; np.flatnonzero({name}) makes them of a mask" if array.dtype.kind == "b" else ""
        raise TypeError(f"{name} has dtype {array.dtype}: give whole numbers of {what}{hint}")
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}: give a list of numbers of {what}")
    _in_range(array, name, count, what)
    return np.ascontiguousarray(array, dtype=np.int64)


def whole(
    entries: ArrayLike | None,
    name: str,
    columns: tuple[int, ...],
    count: int,
    what: str,
    *,
    required: int | None = None,
    hint: str = "",
) -> NDArray[np.int64]:
    """A table of node numbers, with one of these numbers of columns. Columns after the first
    `required` may contain -1. `hint` follows the message about a wrong shape."""
    array = rectangular([] if entries is None else entries, name)
    if array.size == 0:
        return np.zeros((0, columns[0]), dtype=np.int64)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name} has dtype {array.dtype}: give whole numbers of {what}")
    if array.ndim != 2 or array.shape[1] not in columns:
        rows = array.shape[0] if array.ndim else None
        shapes = " or ".join(_written((rows, number)) for number in columns)
        raise ValueError(f"{name} has shape {array.shape}: give {shapes}{hint}")
    checked = array
    if required is not None:
        optional = np.arange(array.shape[1]) >= required
        checked = np.where(optional & (array == -1), 0, array)
    _in_range(checked, name, count, what)
    return np.ascontiguousarray(array, dtype=np.int64)


def _written(shape: tuple[int | None, ...]) -> str:
    """A shape in a message, n for any number."""
    numbers = ["n" if number is None else str(number) for number in shape]
    return f"({numbers[0]},)" if len(numbers) == 1 else f"({', '.join(numbers)})"


def _in_range(array: NDArray[Any], name: str, count: int, what: str) -> None:
    outside = (array < 0) | (array >= count)
    if outside.any():
        place = tuple(int(i) for i in np.argwhere(outside)[0])
        at = ", ".join(map(str, place))
        raise ValueError(
            f"{name}[{at}] is {array[place]}: there are {count} {what}, numbered from 0 to "
            f"{count - 1}"
        )
