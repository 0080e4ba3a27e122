"""Arrays as arguments: numbers of a given shape, refused by name when they are not."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.errors import InputError

__all__ = ["shaped"]


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
