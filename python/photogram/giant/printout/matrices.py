"""Covariance matrices beside values (sample of case 2, pages 41 and 53)."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.arguments.types import Floats
from photogram.giant.printout.formats import exponential

__all__ = ["MATRIX", "matrix_rows"]

MATRIX = 33
"""Columns of a row of a matrix: three numbers (1X, E10.3)."""


def matrix_rows(covariance: Floats | None) -> Sequence[str]:
    """Write the three rows of a (3, 3) matrix; without one, three times nothing."""
    if covariance is None:
        return ["", "", ""]
    return ["".join(f" {exponential(value)}" for value in row) for row in covariance.tolist()]
