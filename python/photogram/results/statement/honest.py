"""Tests of predicted accuracy by differences and their joint covariance.

For all and each component T = d' C^-1 d is chi-square with the number of rows as degrees of freedom. T / m is
approximately F(m, f) if s2 is posterior, because the survey's part of C is not estimated. The bias has z = n
mean / sqrt(1' C_c 1). Heights are fitted by 1, x, y, x^2 + y^2 with generalised least squares. Single points
are tested by T_i = d_i' C_ii^-1 d_i, and given all others by y_i' (C^-1)_ii^-1 y_i, y = C^-1 d.
"""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.results.statement.comparison import PARTS, Compared
from photogram.statistics.agreement import SINGULAR, quadratic, root_of, scale_of
from photogram.statistics.distributions import critical_normal
from photogram.statistics.error_radii import circular_error
from photogram.statistics.freedom import effective_freedom, rmse_interval

LEVEL = 0.05
LEAST = 6  # Minimum number of heights for a surface
FLAT = 1e-6  # Width of collinear points relative to their extent


@dataclass(frozen=True)
class Prediction:
    """The differences of a part of the components against their covariance."""

    # Numbers of differences and points, rank of the covariance
    rows: int
    points: int
    rank: int
    # `sqrt(tr C / n)` of n points, the same of s2 Q alone, and the actual rmse; linear unit
    predicted_rmse: float
    predicted_rmse_of_product: float
    found_rmse: float
    # `tr(C)^2 / tr(C^2)`, and the resulting interval (95 percent) of the rmse
    effective_dof: float
    rmse_interval: tuple[float, float]
    # d' C^-1 d and its upper probability (chi-square, C known)
    T: float
    p_high: float
    # Decisive probabilities: lower, and upper by F if s2 is posterior (else `p_high`)
    p_low: float
    p_high_f: float
    # `sqrt(T / rows)`: ratio of differences to prediction, with its interval (95 percent)
    factor: float
    factor_interval: tuple[float, float]
    sum_of_squares_without_correlations: float  # Sum of d^2 / C_ii

    @property
    def rejected_high(self) -> bool:
        """Whether differences are larger than predicted."""
        return self.rank > 0 and not self.p_high_f >= LEVEL / 2

    @property
    def rejected_low(self) -> bool:
        """Whether differences are smaller than predicted."""
        return self.rank > 0 and self.p_low < LEVEL / 2


@dataclass(frozen=True)
class Bias:
    """Mean difference of a component, with sd by covariances, or variances."""

    mean: float
    sd_of_mean: float
    sd_of_mean_without_correlations: float
    z: float
    p: float
    expanded: float

    @property
    def rejected(self) -> bool:
        """Whether the product is shifted against the check survey."""
        return self.p < LEVEL


@dataclass(frozen=True, eq=False)
class Surface:
    """Differences of heights as a surface: 1, x, y, x^2 + y^2."""

    # x, y: adjusted coordinates minus (2,) `origin`, divided by `scale`
    origin: tuple[float, float]
    scale: float
    # (4,) coefficients in the linear unit, their standard deviations, and the ratios
    estimate: Floats
    sd: Floats
    t: Floats
    # x' N x of all four, 4, and its upper probability
    T: float
    dof: int
    p: float

    @property
    def rejected(self) -> bool:
        """Whether heights are shifted, tilted or bent by more than their errors."""
        return self.p < LEVEL


@dataclass(frozen=True, eq=False)
class PointTests:
    """Tests of each of the n check points."""

    # (n, 3) square roots of the diagonals of C and s2 Q
    sd_predicted: Floats
    sd_adjusted: Floats
    normalised: Floats  # (n, 3) d over `sd_predicted`
    # (n,) d_i' C_ii^-1 d_i and its upper probability
    T: Floats
    p: Floats
    # (n,) the same for the prediction from all other points
    others: Floats
    p_others: Floats
    dimension: Floats  # (n,) number of components
    # (n,) radii of 90 percent that s2 Q_ii predicts for the product; linear unit
    ce90: Floats
    le90: Floats

    @property
    def least(self) -> Floats:
        """(n,) the smaller of both probabilities."""
        return np.fmin(self.p, self.p_others)

    @property
    def wrong(self) -> Bools:
        """(n,) whether a point, or the block at this position, is wrong."""
        return np.asarray(self.least < self.limit)

    @property
    def limit(self) -> float:
        """Probability limit for one wrong point of n (Bonferroni)."""
        return LEVEL / max(len(self.T), 1)


def prediction(found: Compared, part: str) -> Prediction | None:
    """Test a part (`e`, `n`, `h`, `plan`, `all`); None without differences."""
    d, covariance = found.of(part)
    if not d.size:
        return None
    rows = found.rows(part)
    product = found.product[np.ix_(rows, rows)]
    points = len(d) // len(PARTS[part])
    statistic, found_rank = quadratic(d, covariance)
    rank = int(found_rank) if math.isfinite(found_rank) else 0
    rmse = math.sqrt(float(d @ d) / points)
    freedom = effective_freedom(covariance)
    low, high = (
        _photocore.chi_square_quantile(LEVEL / 2, rank, upper=upper) if rank else math.nan
        for upper in (False, True)
    )
    variances = np.diag(covariance)
    with np.errstate(divide="ignore", invalid="ignore"):
        alone = float((d**2 / variances).sum())
    p_high = _photocore.chi_square(statistic, rank, upper=True) if rank else math.nan
    below, above = 1.0 - p_high, p_high
    if math.isfinite(found.second) and rank:
        above = _photocore.fisher(statistic / rank, rank, found.second)
        below = 1.0 - above
    return Prediction(
        rows=len(d),
        points=points,
        rank=rank,
        predicted_rmse=math.sqrt(float(variances.sum()) / points),
        predicted_rmse_of_product=math.sqrt(float(np.trace(product)) / points),
        found_rmse=rmse,
        effective_dof=freedom,
        rmse_interval=rmse_interval(rmse, freedom),
        T=statistic,
        p_high=p_high,
        p_low=below,
        p_high_f=above,
        factor=math.sqrt(statistic / rank) if rank else math.nan,
        factor_interval=(math.sqrt(statistic / high), math.sqrt(statistic / low))
        if rank
        else (math.nan,) * 2,
        sum_of_squares_without_correlations=alone,
    )


def _inverse(covariance: Floats) -> Floats:
    scale = scale_of(covariance)
    scaled = covariance / np.outer(scale, scale)
    if root_of(scaled) is not None:
        return np.asarray(np.linalg.inv(scaled) / np.outer(scale, scale))
    return np.asarray(np.linalg.pinv(scaled, rcond=SINGULAR, hermitian=True) / np.outer(scale, scale))


def bias(found: Compared, component: str, k: float) -> Bias | None:
    """Test the mean of `e`, `n` or `h` with coverage factor k, or None."""
    d, covariance = found.of(component)
    if not d.size:
        return None
    mean, n = float(d.mean()), len(d)
    sd = math.sqrt(max(float(covariance.sum()), 0.0)) / n
    z = mean / sd if sd > 0 else math.nan
    return Bias(
        mean=mean,
        sd_of_mean=sd,
        sd_of_mean_without_correlations=math.sqrt(float(np.trace(covariance))) / n,
        z=z,
        p=math.erfc(abs(z) / math.sqrt(2.0)),
        expanded=k * sd,
    )


def surface(found: Compared) -> Surface | None:
    """Fit 1, x, y, x^2 + y^2 to heights; None if fewer than 6, or on a line."""
    d, covariance = found.of("h")
    if len(d) < LEAST:
        return None
    plan = found.places[found.rows("h") // 3, :2]
    origin = plan.mean(axis=0)
    plan = plan - origin
    scale = float(np.abs(plan).max())
    across = np.linalg.svd(plan, compute_uv=False)
    if not scale > 0 or across[1] < FLAT * across[0]:
        return None
    x, y = (plan / scale).T
    columns = np.column_stack([np.ones(len(x)), x, y, x**2 + y**2])
    try:
        factor = np.linalg.cholesky(covariance)
        weighted, right = (np.linalg.solve(factor, each) for each in (columns, d))
        normal = weighted.T @ weighted
        estimate = np.linalg.solve(normal, weighted.T @ right)
        sd = np.sqrt(np.diag(np.linalg.inv(normal)))
    except np.linalg.LinAlgError:  # heights without error, or points on a circle
        return None
    statistic = float(estimate @ normal @ estimate)
    p = _photocore.chi_square(statistic, 4, upper=True)
    return Surface((float(origin[0]), float(origin[1])), scale, estimate, sd, estimate / sd, statistic, 4, p)


def point_tests(found: Compared) -> PointTests:
    """Test every single point, and against the prediction by all others."""
    n = len(found)
    sd = np.sqrt(np.diag(found.covariance)).reshape(n, 3)
    adjusted = found.blocks(found.product)
    counted = np.isfinite(found.differences)
    dimension = counted.sum(axis=1).astype(float)
    statistic, others = np.full(n, np.nan), np.full(n, np.nan)
    rows = np.flatnonzero(counted.ravel())
    whole = found.covariance[np.ix_(rows, rows)]
    d = found.differences.ravel()[rows]
    inverse = _inverse(whole) if len(rows) else whole
    y = inverse @ d
    firsts = np.searchsorted(rows // 3, np.arange(n))
    for size in np.unique(dimension[dimension > 0]).astype(int).tolist():
        points = np.flatnonzero(dimension == size)
        own = firsts[points, np.newaxis] + np.arange(size)
        grid = (own[:, :, np.newaxis], own[:, np.newaxis, :])
        statistic[points] = _each(whole[grid], d[own])
        others[points] = _each(inverse[grid], y[own])
    with np.errstate(divide="ignore", invalid="ignore"):
        normalised = np.where(counted, found.differences / sd, np.nan)
    sd_adjusted = np.sqrt(np.diagonal(adjusted, axis1=1, axis2=2))
    return PointTests(
        sd_predicted=np.where(counted, sd, np.nan),
        sd_adjusted=sd_adjusted,
        normalised=normalised,
        T=statistic,
        p=_above(statistic, dimension),
        others=others,
        p_others=_above(others, dimension),
        dimension=dimension,
        ce90=circular_error(adjusted[:, :2, :2], 0.9) if n else np.zeros(0),
        le90=sd_adjusted[:, 2] * critical_normal(0.1),
    )


def _each(matrices: Floats, vectors: Floats) -> Floats:
    """Return v' M^+ v of each of (n, k, k) matrices and (n, k) vectors."""
    inverse = np.linalg.pinv(matrices, rcond=SINGULAR, hermitian=True)
    return np.asarray(np.einsum("ni,nij,nj->n", vectors, inverse, vectors))


def _above(values: Floats, freedom: Floats) -> Floats:
    both = zip(values.tolist(), freedom.tolist(), strict=True)
    return np.array([_photocore.chi_square(v, f, upper=True) if f else math.nan for v, f in both])
