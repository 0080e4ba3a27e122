"""Check points as further observations of the tests of hypotheses."""

from __future__ import annotations

import math

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


def set_with_checks(found: Facts, row: int, checks: int, joint: Joint) -> bool:
    """Test a set with check points as further observations; return whether only these test it.

    Differences D of check points with the covariance C are independent of the residuals. If the parameters
    change them by G, D adds G' C^-1 D to the score and G' C^-1 G to the redundancy.
    """
    own, (flat, differences, inverse) = found["sets"][row], joint
    hidden = bool(found["rank"][row] == 0)
    k = len(own["parameters"])
    g = np.reshape(own["at_checks"], (-1, 3, k))[:checks].reshape(-1, k)[flat]
    if not np.isfinite(g).all() or not g.any():
        return False
    weighted = inverse @ g
    redundancy, score = g.T @ weighted, weighted.T @ differences
    if not hidden:
        # Directions without redundancy have no cofactors.
        own_part = np.linalg.pinv(np.reshape(own["cofactors"], (k, k)), hermitian=True, rcond=SINGULAR)
        redundancy += own_part
        score += own_part @ own["estimate"]
    cofactors = np.linalg.pinv(redundancy, hermitian=True, rcond=SINGULAR)
    estimate = cofactors @ score
    statistic = float(score @ estimate)
    found["statistic"][row], found["rank"][row] = statistic, k
    found["estimate"][row, :k], found["observations"][row] = estimate, found["observations"][row] + len(flat)
    found["probability"][row] = math.exp(float(log_chi_square(statistic, float(k))))
    own["estimate"], own["cofactors"] = estimate.tolist(), cofactors.ravel().tolist()
    return hidden


def single_with_checks(found: Facts, row: int, sd: Floats, changes: Floats, joint: Joint) -> None:
    """Test a group with check points as further observations, along its least detectable direction.

    This direction d is an eigenvector of R in unit weight. Check points have the `changes` G by an error d.
    """
    flat, differences, inverse = joint
    g, d = changes.ravel()[flat], found["mdb"][row, : len(sd)]
    if len(d) != len(sd) or not np.isfinite(g).all() or not g.any():
        return
    weighted = inverse @ g
    redundancy, score, before = float(g @ weighted), float(weighted @ differences), 0.0
    if np.isfinite(d).all():
        estimate = found["estimate"][row, : len(sd)]
        own, part = found["noncentrality"][row], found["redundancy"][row] * float(d @ (estimate / sd**2))
        redundancy, score, before = redundancy + own, score + part, part**2 / own
    statistic = float(np.nan_to_num(found["statistic"][row])) - before + score**2 / redundancy
    rank = max(found["rank"][row] + np.isnan(d[0]), 1)
    found["statistic"][row], found["rank"][row] = statistic, rank
    found["probability"][row] = math.exp(float(log_chi_square(statistic, float(rank))))
    found["observations"][row] += len(flat)
