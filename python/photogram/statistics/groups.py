"""Tests of groups that may err together: image coordinates, control points.

Standardized residuals are v = (observed - computed) / sd, and R = I - A Q A'. R_g is the block of the m rows
of a group, and R^- its pseudo-inverse. An error of an unsuspected group has (Cook and Weisberg 1982;
Teunissen 2000)

    T = v' R^- v                                chi-square with m' = rank R, unit weight known
    F = (T / m') / ((Omega - T) / (f - m'))     F(m', f - m'), unit weight estimated from the others
    d = R^- v                                   the error itself, in standard deviations, cofactor R^-

Removing the group decreases Omega by T. The eigenvalues of R_g are redundancy numbers of directions. An error
along a direction without redundancy is invisible. The two coordinates of a point on two photographs have one
visible direction, across the base. There m' is 1, and both have the same test value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.arguments.arrays import truth_value
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import log_chi_square, log_fisher

INVISIBLE = 1e-6  # Least eigenvalue of a visible direction


@dataclass(frozen=True, eq=False)
class GroupTests:
    """Tests of n groups of m observations each.

    Attributes
    ----------
    dimension
        (n,) m', the number of directions in which an error is visible; 0 if nothing is tested.
    statistic
        (n,) T; 0 without visible direction.
    fisher
        (n,) F; NaN if the unit weight is known, or f does not exceed m'.
    log_probability
        (n,) logarithms of the p-values of the deciding test: chi-square if the unit weight is known,
        otherwise F. NaN if nothing is tested.
    error
        (n, m) estimated errors in standard deviations.
    cofactors
        (n, m, m) cofactors of these.
    eigenvalues
        (n, m) redundancy numbers of directions, ascending; 0 for missing rows.
    """

    dimension: Indices
    statistic: Floats
    fisher: Floats
    log_probability: Floats
    error: Floats
    cofactors: Floats
    eigenvalues: Floats

    @property
    def weakest(self) -> Floats:
        """(n,) the least redundancy of a visible direction; NaN without one."""
        visible = np.where(self.eigenvalues > INVISIBLE, self.eigenvalues, math.inf)
        least = visible.min(axis=1)
        return np.asarray(np.where(np.isfinite(least), least, math.nan))

    def guilty(self, group: int) -> list[int]:
        """Return the most probable wrong row of a group, and inseparable rows.

        The first row has the largest ratio of |d| and its standard deviation. The others have estimates that
        are correlated with it by more than 0.9.
        """
        cofactors = self.cofactors[group]
        sd = np.sqrt(np.diagonal(cofactors))
        if not (sd > 0).any():
            return []
        with np.errstate(divide="ignore", invalid="ignore"):
            first = int(np.nan_to_num(np.abs(self.error[group]) / sd).argmax())
            correlation = np.abs(cofactors[first] / (sd[first] * sd))
        return [first, *(int(row) for row in np.flatnonzero(correlation > 0.9) if row != first)]


def group_tests(
    blocks: ArrayLike,
    residuals: ArrayLike,
    weighted_sum_of_squares: ArrayLike = math.nan,
    degrees_of_freedom: ArrayLike = math.inf,
    *,
    known: bool = True,
) -> GroupTests:
    """Test n groups of m observations each, from their blocks of R.

    Parameters
    ----------
    blocks
        (n, m, m) blocks of R = I - A Q A', rows divided by standard deviations.
    residuals
        (n, m) observed minus computed over standard deviation; NaN for missing rows of a group.
    weighted_sum_of_squares, degrees_of_freedom
        Omega and f of the adjustment, of all or of each group (n,); not needed if the unit weight is known.
    known
        True if the unit weight is known: chi-square decides; otherwise F.
    """
    truth_value("known", known)
    r = np.asarray(blocks, dtype=np.float64)
    v = np.asarray(residuals, dtype=np.float64)
    there = ~np.isnan(v)
    r = np.where(there[:, :, np.newaxis] & there[:, np.newaxis, :], r, 0.0)
    mu, directions = np.linalg.eigh(r)
    visible = mu > INVISIBLE
    inverse = np.where(visible, 1.0 / np.where(visible, mu, 1.0), 0.0)
    along = np.einsum("nji,nj->ni", directions, np.where(there, v, 0.0))
    statistic = (along**2 * inverse).sum(axis=1)
    dimension = visible.sum(axis=1)
    log_p, fisher = _probabilities(statistic, dimension, weighted_sum_of_squares, degrees_of_freedom, known)
    return GroupTests(
        dimension=dimension,
        statistic=statistic,
        fisher=fisher,
        log_probability=log_p,
        error=np.einsum("nij,nj->ni", directions, along * inverse),
        cofactors=np.einsum("nij,nj,nkj->nik", directions, inverse, directions),
        eigenvalues=mu,
    )


def parts_tests(
    block: ArrayLike,
    residuals: ArrayLike,
    parts: Sequence[Sequence[int]],
    weighted_sum_of_squares: float = math.nan,
    degrees_of_freedom: float = math.inf,
    *,
    known: bool = True,
) -> Floats:
    """Return log-probabilities of parts of a group as if other rows were good.

    For a control point, use plan and height, `parts=((0, 1), (2,), (0, 1, 2))`. The smallest value indicates
    the erroneous part.

    Parameters
    ----------
    block, residuals
        (m, m) and (m,) of the group, as for :func:`group_tests`.
    parts
        Rows of each part.
    """
    truth_value("known", known)
    r, v = np.asarray(block, dtype=np.float64), np.asarray(residuals, dtype=np.float64)
    kept = np.full((len(parts), len(v)), math.nan)
    for part, rows in enumerate(parts):
        kept[part, list(rows)] = v[list(rows)]
    blocks = np.broadcast_to(r, (len(parts), *r.shape))
    tests = group_tests(blocks, kept, weighted_sum_of_squares, degrees_of_freedom, known=known)
    return tests.log_probability


def _probabilities(
    statistic: Floats, dimension: NDArray[np.int64], omega: ArrayLike, freedom: ArrayLike, known: bool
) -> tuple[Floats, Floats]:
    fisher = np.full(statistic.shape, math.nan)
    tested = dimension > 0
    if known:
        return np.where(tested, log_chi_square(statistic, np.maximum(dimension, 1)), math.nan), fisher
    second = np.asarray(freedom) - dimension
    omega = np.broadcast_to(np.asarray(omega, dtype=np.float64), statistic.shape)
    tested &= second > 0
    first, others = dimension[tested], second[tested]
    # Zero within rounding if a group makes up all of Omega.
    left = np.maximum(omega[tested] - statistic[tested], 1e-12 * omega[tested])
    with np.errstate(divide="ignore", invalid="ignore"):
        fisher[tested] = (statistic[tested] / first) / (left / others)
    log_p = np.full(statistic.shape, math.nan)
    log_p[tested] = log_fisher(fisher[tested], first, others)
    return log_p, fisher
