"""Test values of single components, with the robust spread of all as unit."""

from __future__ import annotations

from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import rows_of_each
from photogram.arguments.types import Bools, Floats, Indices
from photogram.results.network import AdjustedNetwork
from photogram.results.result import Result
from photogram.statistics.limits import normal_limit

FOUND, SURE = 0.01, 1e-4  # Probabilities that a correct block has any finding, and a grave one
ROUNDING = 0.01  # Standard deviation of test values below which residuals are rounding errors
TESTABLE, TESTABLE_PRIOR = 0.01, 1e-5
"""Redundancy numbers below which image coordinates, and control or stations, are not tested.

Precise control at the edge of a block, or a precise distance, has a redundancy of a thousandth. Its test
value is still meaningful."""


MAD_TO_SD = 1 / NormalDist().inv_cdf(0.75)


def mad_sd(values: Floats) -> float:
    """Return the robust standard deviation about zero (MAD); NaN without values."""
    finite = np.abs(values[np.isfinite(values)])
    return MAD_TO_SD * float(np.median(finite)) if finite.size else float("nan")


def grouped(values: NDArray[Any], groups: Indices, count: int) -> list[NDArray[Any]]:
    return [values[rows] for rows in rows_of_each(groups, count)]


def spread_of(result: AdjustedNetwork) -> float:
    """Return the robust standard deviation of the test values; 1 if residuals are rounding errors."""
    size = mad_sd(result.standardized)
    return size if size > ROUNDING else 1.0


def sizes_of_tests(result: Result) -> dict[str, Floats]:
    """Return absolute test values w by type, in their robust sd; 0 without redundancy."""
    values = {
        "image": (result.redundancy, result.standardized),
        "control": (result.point_redundancy, result.point_standardized),
        "station": (result.photo_redundancy, result.photo_standardized),
        **{f"observed {name}": (own.redundancy, own.standardized) for name, own in result.kinds.items()},
    }
    least = {"image": TESTABLE}
    return {
        kind: np.where(redundancy > least.get(kind, TESTABLE_PRIOR), np.nan_to_num(np.abs(own)), 0.0)
        / spread_of(result)
        for kind, (redundancy, own) in values.items()
    }


def outliers(result: Result) -> dict[str, Bools]:
    """Return components by type beyond the critical value of the largest of all test values."""
    sizes = sizes_of_tests(result)
    limit = normal_limit(sum(int((each > 0).sum()) for each in sizes.values()), FOUND)
    return {name: each > limit for name, each in sizes.items()}
