"""Robust statistics, which outliers do not affect."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np

from photogram.arguments.types import Floats

MAD_TO_SD = 1 / NormalDist().inv_cdf(0.75)
ROUNDING = 1e-9  # Median below this part of the largest residual, which is rounding
TUKEY = 4.685  # Tuning constant of Tukey's biweight: 95 % efficiency for normal errors


def mad_sd(values: Floats) -> float:
    """Return the robust standard deviation about zero (MAD); NaN without values."""
    finite = np.abs(values[np.isfinite(values)])
    return MAD_TO_SD * float(np.median(finite)) if finite.size else float("nan")


def fit(design: Floats, values: Floats, iterations: int = 10) -> Floats:
    """Return (k, d) coefficients by Tukey's biweight after least absolute deviations.

    `design` is (n, k), n > k; the rows of `values`, (n, d), are outliers as a whole. NaN if squares overflow.
    """
    weights = np.ones(len(values))
    coefficients: Floats = np.zeros((design.shape[1], values.shape[1]))
    for iteration in range(iterations):
        root = np.sqrt(weights)[:, np.newaxis]
        try:
            coefficients = np.asarray(np.linalg.lstsq(design * root, values * root, rcond=None)[0])
        except np.linalg.LinAlgError:  # of numbers whose squares overflow
            return np.full_like(coefficients, np.nan)
        size = np.linalg.norm(values - design @ coefficients, axis=1)
        middle = max(float(np.median(size)), ROUNDING * float(size.max()))
        if middle == 0:
            break
        if iteration < iterations // 2:
            weights = middle / np.maximum(size, 1e-3 * middle)
        else:
            weights = (1 - np.minimum(size / (TUKEY * MAD_TO_SD * middle), 1) ** 2) ** 2
    return coefficients
