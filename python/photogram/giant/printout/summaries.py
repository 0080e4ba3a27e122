"""Counts and root mean squares of components."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats

__all__ = ["counts_and_rms"]


def counts_and_rms(values: Floats, counted: NDArray[np.bool_]) -> tuple[list[int], list[float]]:
    """Return how many values of each of three columns count, and the root of their mean square or NaN."""
    count = counted.sum(axis=0)
    squares = np.where(counted, values**2, 0.0).sum(axis=0)
    rms = np.sqrt(np.divide(squares, count, out=np.full(3, np.nan), where=count > 0))
    return count.tolist(), rms.tolist()
