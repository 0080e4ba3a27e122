"""Check points as further observations of the tests of hypotheses."""

from __future__ import annotations

import math
from collections.abc import MutableMapping, Sequence
from itertools import combinations
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


def in_deviations(
    found: Facts, checks: int, joint: Joint | None, variance: float | None
) -> tuple[dict[int, float], dict[int, float], dict[int, Floats]]:
    """Return estimates of errors and the errors with known effects, both in standard deviations, and these.

    An error e has the square e' R e and, if it changes check points by G e, e' G' C^-1 G e; 0 if nothing
    tests it. Its estimate is the root of T, of several parameters of T - k + 1 (a limit of each direction).
    `variance`: the estimated variance of unit weight; None if it is known.
    """
    deviates, sizes, errors = {}, {}, {}
    squares = scores = np.zeros(len(found["effects"]))
    if joint is not None and len(squares):
        flat, differences, inverse = joint
        g = np.stack([changes[:checks].ravel()[flat] for *_, changes in found["effects"].values()])
        weighted = np.where(np.isfinite(g).all(axis=1, keepdims=True), g, 0.0) @ inverse
        squares, scores = np.nansum(weighted * g, axis=1), weighted @ differences
    for row, square, score in zip(found["effects"], squares.tolist(), scores.tolist(), strict=True):
        mdb = found["mdb"][row]
        tested = 0.0 if np.isnan(mdb[0]) else float(found["noncentrality"][row])
        own = found["sets"][row] if row < len(found["sets"]) else found["groups"].get(row, {})
        errors[row] = mdb[~np.isnan(mdb)] if tested else np.array(own.get("error", []))
        square = square if len(errors[row]) else 0.0
        statistic = np.nan_to_num(found["statistic"][row]) - max(found["rank"][row] - 1, 0)
        if variance is not None:  # Their statistics do not include check points
            statistic = statistic / variance if tested else score**2 / (square or 1.0)
        deviates[row] = math.sqrt(max(statistic, 0.0))
        sizes[row] = math.sqrt(tested + (variance or 1.0) * square)
    return deviates, sizes, errors


def correlate(found: Facts, rows: Sequence[int], checks: int, joint: Joint) -> None:
    """Correlate the scores of sets that only check points test: the largest canonical correlations.

    All redundancies G' C^-1 G are one matrix, because its blocks are small: factors of C would take longer.
    """
    if len(rows) < 2:
        return
    flat, _, inverse = joint
    changes = [np.reshape(found["sets"][row]["at_checks"], (3 * checks, -1))[flat] for row in rows]
    ends = np.cumsum([own.shape[1] for own in changes]).tolist()
    blocks = [slice(end - own.shape[1], end) for own, end in zip(changes, ends, strict=True)]
    whole = np.hstack(changes)
    redundancy = whole.T @ inverse @ whole
    white = np.zeros_like(redundancy)
    for block in blocks:
        values, vectors = np.linalg.eigh(redundancy[block, block])
        seen = values > SINGULAR * values[-1]
        white[block, block] = vectors * np.where(seen, np.where(seen, values, 1.0) ** -0.5, 0.0)
    scores = white.T @ redundancy @ white
    for (one, own), (other, its) in combinations(zip(rows, blocks, strict=True), 2):
        correlation = np.linalg.norm(scores[own, its], 2)
        found["correlations"][[one, other], [other, one]] = correlation


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
