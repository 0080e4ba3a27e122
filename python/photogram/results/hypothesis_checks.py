"""Check points as further observations of the tests of hypotheses."""

from __future__ import annotations

import math
from collections.abc import MutableMapping
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.results.network_trial import Facts
from photogram.statistics.distributions import log_chi_square

SINGULAR = 1e-10  # Relative eigenvalue of directions that nothing determines

Joint = tuple[Indices, Floats, Floats]
"""Coordinates of check points with differences D, these, and the inverse C^-1 of their covariance."""


def single_checks(joint: Joint) -> tuple[Floats, Floats]:
    """Return T of an error of each single check point, and its dimension.

    With the score s = C^-1 D and the redundancy W = C^-1, T = s' W^-1 s over its coordinates.
    """
    flat, differences, inverse = joint
    score = inverse @ differences
    points = [np.flatnonzero(flat // 3 == point) for point in np.unique(flat // 3)]
    found = [score[own] @ np.linalg.solve(inverse[np.ix_(own, own)], score[own]) for own in points]
    return np.array(found), np.array([len(own) for own in points], dtype=float)


def with_checks(
    found: Facts, row: int, own: MutableMapping[str, Any], sizes: Floats, checks: int, joint: Joint
) -> bool:
    """Test a set or a group with check points as further observations; return whether only these test it.

    Differences D of check points with the covariance C are independent of the residuals. If the parameters
    change them by G, D adds G' C^-1 D to the score s and G' C^-1 G to the redundancy R. The components of a
    group, in the next rows, have T = s_k^2 / R_kk. `sizes` (k) of parameters in different units decide which
    directions nothing determines.
    """
    flat, differences, inverse = joint
    hidden = bool(found["rank"][row] == 0)
    k = len(own["estimate"])
    units = np.outer(sizes, sizes) if len(sizes) == k else np.ones((k, k))
    g = np.reshape(own["at_checks"], (-1, 3, k))[:checks].reshape(-1, k)[flat]
    if not np.isfinite(g).all() or not g.any():
        return False
    weighted = inverse @ g
    redundancy, score = g.T @ weighted, weighted.T @ differences
    if not hidden:
        # Directions without redundancy have no cofactors.
        own_part = _inverse(np.reshape(own["cofactors"], (k, k)), 1 / units)
        redundancy += own_part
        score += own_part @ own["estimate"]
    cofactors = _inverse(redundancy, units)
    estimate = cofactors @ score
    _take_over(found, row, float(score @ estimate), estimate, len(flat))
    if row < len(found["sets"]):
        own["estimate"], own["cofactors"] = estimate.tolist(), cofactors.ravel().tolist()
        return hidden
    for part, (value, own_redundancy) in enumerate(zip(score, redundancy.diagonal(), strict=True), 1):
        if k > 1 and own_redundancy > 0:
            error = value / own_redundancy
            _take_over(found, row + part, float(value * error), np.array([error]), len(flat))
    return False


def _inverse(matrix: Floats, units: Floats) -> Floats:
    """Return the pseudo-inverse of a symmetric matrix, computed with elements times `units`."""
    if matrix.size == 1:  # Most sets have one parameter
        return np.divide(1.0, matrix, out=np.zeros((1, 1)), where=matrix != 0)
    return np.asarray(units * np.linalg.pinv(units * matrix, hermitian=True, rcond=SINGULAR))


def _take_over(found: Facts, row: int, statistic: float, estimate: Floats, count: int) -> None:
    """Replace the test and the estimate of a row that `count` differences of check points test as well."""
    k = len(estimate)
    found["statistic"][row], found["rank"][row] = statistic, k
    found["estimate"][row, :k] = estimate
    found["probability"][row] = math.exp(float(log_chi_square(statistic, float(k))))
    found["observations"][row] += count
