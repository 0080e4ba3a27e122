"""Arrays as arguments: numbers of a given shape, and indices, refused by name when they are not."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.errors import InputError

__all__ = ["indices", "shaped", "standard_deviations"]


def shaped(name: str, value: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return an array of the given shape; a single number stands for all of them.

    Raises
    ------
    InputError
        Another shape, or what is no number; the message names the argument.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is not an array of numbers: {error}") from None
    if array.ndim == 0:
        array = np.full(shape, array)
    if array.shape != shape:
        raise InputError(f"{name} has the shape {array.shape}, not {shape}")
    return np.ascontiguousarray(array)


def indices(name: str, value: ArrayLike, length: int, count: int) -> NDArray[np.int64]:
    """Return an array of `length` whole numbers from 0 to `count` - 1.

    Raises
    ------
    InputError
        Another shape, what is no whole number, or an index outside; the message names the argument.
    """
    array = np.asarray(value)
    if array.shape != (length,) or (length and not np.issubdtype(array.dtype, np.integer)):
        raise InputError(f"{name} is not an array of {length} whole numbers")
    array = np.ascontiguousarray(array, dtype=np.int64)
    bad = np.flatnonzero((array < 0) | (array >= count))
    if bad.size:
        raise InputError(f"{name}[{bad[0]}] is {array[bad[0]]}, outside 0 to {count - 1}")
    return array


def standard_deviations(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviations (n, k) of matrices of covariances (n, k, k)."""
    deviations: NDArray[np.float64] = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    return deviations
