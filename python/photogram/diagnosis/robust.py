"""Robust statistics, which outliers do not affect."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np

from photogram.arguments.types import Floats

MAD_TO_SD = 1 / NormalDist().inv_cdf(0.75)


def mad_sd(values: Floats) -> float:
    """Return the robust standard deviation about zero (MAD); NaN without values."""
    finite = np.abs(values[np.isfinite(values)])
    return MAD_TO_SD * float(np.median(finite)) if finite.size else float("nan")
