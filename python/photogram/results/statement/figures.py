"""Accuracy figures of check points, and tests of the predicted accuracy by their differences.

RMSE of n differences is the root of their mean square and includes a bias. Horizontal figures use points with
both plan coordinates, 3D figures points with all three.

For all and each component T = d' C^-1 d is chi-square with the number of rows as degrees of freedom. T / m is
approximately F(m, f) if s2 is posterior, because the survey's part of C is not estimated. The bias has z = n
mean / sqrt(1' C_c 1). Heights are fitted by 1, x, y, x^2 + y^2 with generalised least squares. Single points
are tested by T_i = d_i' C_ii^-1 d_i, and given all others by y_i' (C^-1)_ii^-1 y_i, y = C^-1 d.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.results.statement.comparison import LEVEL, PARTS, Compared
from photogram.statistics import error_radii
from photogram.statistics.agreement import SINGULAR, quadratic, root_of, scale_of
from photogram.statistics.distributions import critical_normal, critical_student, log_chi_square
from photogram.statistics.freedom import effective_freedom, rmse_interval, root_mean

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
    rmse_interval_95: tuple[float, float]
    # d' C^-1 d and its upper probability (chi-square, C known)
    T: float
    p_high: float
    # Decisive probabilities: lower, and upper by F if s2 is posterior (else `p_high`)
    p_low: float
    p_high_f: float
    # `sqrt(T / rows)`: ratio of differences to prediction, with its interval (95 percent)
    factor_of_sd: float
    factor_interval_95: tuple[float, float]
    sum_of_squares_without_correlations: float  # Sum of d^2 / C_ii

    @property
    def rejected(self) -> str | None:
        """Whether differences are larger (`high`) or smaller (`low`) than predicted; None if they agree."""
        if not self.rank > 0:
            return None
        return "high" if not self.p_high_f >= LEVEL / 2 else "low" if self.p_low < LEVEL / 2 else None


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
    rank = 0 if math.isnan(statistic) else int(found_rank)
    mean, scale = statistic / max(rank, 1), max(rank, 1)
    rmse = math.sqrt(float(d @ d) / points)
    freedom = effective_freedom(covariance)
    high, low = (
        math.sqrt(statistic / _photocore.chi_square_quantile(LEVEL / 2, scale, upper=upper))
        for upper in (False, True)
    )
    variances = np.diag(covariance)
    with np.errstate(divide="ignore", invalid="ignore"):
        alone = float((d**2 / variances).sum())
    p_high = p_high_f = _photocore.chi_square(statistic, scale)
    if math.isfinite(found.second):
        p_high_f = _photocore.fisher(mean, scale, found.second)
    return Prediction(
        rows=len(d),
        points=points,
        rank=rank,
        predicted_rmse=math.sqrt(float(variances.sum()) / points),
        predicted_rmse_of_product=math.sqrt(float(np.trace(product)) / points),
        found_rmse=rmse,
        effective_dof=freedom,
        rmse_interval_95=rmse_interval(rmse, freedom),
        T=statistic,
        p_high=p_high,
        p_low=1.0 - p_high_f,
        p_high_f=p_high_f,
        factor_of_sd=math.sqrt(mean),
        factor_interval_95=(low, high),
        sum_of_squares_without_correlations=alone,
    )


def bias(found: Compared, component: str, k: float) -> Bias | None:
    """Test the mean of `e`, `n` or `h` with coverage factor k, or None."""
    d, covariance = found.of(component)
    if not d.size:
        return None
    mean, n = float(d.mean()), len(d)
    sd = math.sqrt(max(float(covariance.sum()), 0.0)) / n
    z, alone = mean / sd if sd > 0 else math.nan, math.sqrt(float(np.trace(covariance))) / n
    return Bias(mean, sd, alone, z, math.erfc(abs(z) / math.sqrt(2.0)), k * sd)


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
    d, whole = found.differences.ravel()[rows], found.covariance[np.ix_(rows, rows)]
    inverse, scale = whole, np.outer(scale_of(whole), scale_of(whole))
    if len(rows):
        singular = root_of(whole / scale) is None
        inverse = (_pseudo_inverse if singular else np.linalg.inv)(whole / scale) / scale
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
        p=np.exp(log_chi_square(statistic, dimension)),
        others=others,
        p_others=np.exp(log_chi_square(others, dimension)),
        dimension=dimension,
        ce90=error_radii.circular_error(adjusted[:, :2, :2], 0.9) if n else np.zeros(0),
        le90=sd_adjusted[:, 2] * critical_normal(0.1),
    )


_pseudo_inverse = partial(np.linalg.pinv, rcond=SINGULAR, hermitian=True)


def _each(matrices: Floats, vectors: Floats) -> Floats:
    """Return v' M^+ v of each of (n, k, k) matrices and (n, k) vectors."""
    return np.asarray(np.einsum("ni,nij,nj->n", vectors, _pseudo_inverse(matrices), vectors))


PROBABILITIES = (0.9, 0.95)
INSIDE = 0.95


@dataclass(frozen=True)
class Sized:
    """Differences of a component (`e`, `n`, `h`), or radial (`plan`, `all`)."""

    n: int  # Number of differences
    # Of components; NaN for radial figures; the sd is NaN for one point
    mean: float
    sd: float
    rmse: float  # Root mean square
    # The largest difference and its point
    largest: float
    point: str


@dataclass(frozen=True, eq=False)
class Figures:
    n: int  # Number of points
    parts: dict[str, Sized | None]  # By `e`, `n`, `h`, `plan`, `all`
    # `rmse_h1`, `rmse_v1` of the differences, radial in plan, and in height; `rmse_h2`, `rmse_v2` of the
    # survey; `rmse_h`, `rmse_v`, `rmse_3d` of both: the roots of sums of squares
    rmse: dict[str, float]
    prediction: dict[str, Prediction | None]  # By part
    bias: dict[str, Bias | None]  # By component
    points: PointTests  # Tests of single points
    inside: dict[str, int]  # Number of points inside 95 percent in height, and in space
    # `ce90`, `le90`, `ce95`, `le95` of the sample: the k-th smallest, `order` k = ceil(p n); `upper` and its
    # order exceed the quantile with 95 percent probability if points are independent, None for too few points
    radii: dict[str, dict[str, Any] | None]
    # (2, 2) `sum d d' / n` in plan, and the same radii from moments, the bias inside
    moments: Floats
    of_moments: dict[str, float]
    # `ce90`, `le90` from s2 Q_ii: the mean probability of the points is 90 percent
    mixture: dict[str, float]
    surface: Surface | None  # Of the heights

    def without_survey(self, part: str) -> float:
        """Return `sqrt(RMSE_1^2 - RMSE_2^2)` of `h` or `v`; NaN below the survey."""
        first, second = (self.rmse[f"rmse_{part}{k}"] for k in (1, 2))
        square = first**2 - second**2
        return math.sqrt(square) if square >= 0 else math.nan


def figures(found: Compared, coverage: float = 0.95) -> Figures | None:
    """Return figures of check points, and biases with uncertainties, or None."""
    if not len(found):
        return None
    k = critical_student(1.0 - coverage, found.second)
    d = np.where(found.counted, found.differences, np.nan)
    plan, heights = np.hypot(d[:, 0], d[:, 1]), d[:, 2]
    sizes = dict(zip(PARTS, (*d.T, plan, np.sqrt((d**2).sum(axis=1))), strict=True))
    in_plan, in_height = np.isfinite(plan), np.isfinite(heights)
    # Survey relative to datum: errors that cancel in the differences also count.
    survey, own = found.survey_sd**2 + found.common_sd**2, d[in_plan, :2]
    moments = own.T @ own / len(own) if len(own) else np.full((2, 2), np.nan)
    of_moments, finite = dict[str, float](), np.isfinite(moments).all()
    for p in PROBABILITIES:
        circular = float(error_radii.circular_error(moments[np.newaxis], p)[0]) if finite else math.nan
        linear = root_mean(heights**2) * critical_normal(1.0 - p)
        of_moments |= {f"ce{round(100 * p)}": circular, f"le{round(100 * p)}": linear}
    blocks = found.blocks(found.product)
    ellipses, sd = blocks[in_plan, :2, :2], np.sqrt(blocks[in_height, 2, 2])
    tests = point_tests(found)
    in_survey = (
        np.where(in_plan, survey[:, 0] + survey[:, 1], np.nan),
        np.where(in_height, survey[:, 2], np.nan),
    )
    squares = {"h1": plan**2, "v1": heights**2, "h2": in_survey[0], "v2": in_survey[1]}
    rmse = {f"rmse_{name}": root_mean(own) for name, own in squares.items()}
    for name, parts in (("h", ("h1", "h2")), ("v", ("v1", "v2")), ("3d", ("h", "v"))):
        rmse[f"rmse_{name}"] = math.hypot(*(rmse[f"rmse_{part}"] for part in parts))
    return Figures(
        n=len(found),
        parts={part: _sized(own, found.names, radial=part in ("plan", "all")) for part, own in sizes.items()},
        rmse=rmse,
        prediction={part: prediction(found, part) for part in PARTS},
        bias={part: bias(found, part, k) for part in ("e", "n", "h")},
        points=tests,
        inside={
            "h": int((np.abs(tests.normalised[in_height, 2]) <= critical_normal(1 - INSIDE)).sum()),
            "three": int((tests.p >= 1 - INSIDE).sum()),
        },
        radii=_radii(plan[in_plan], np.abs(heights[in_height])),
        moments=moments,
        of_moments=of_moments,
        mixture={
            "ce90": error_radii.mixture_circular(ellipses, 0.9) if len(ellipses) else math.nan,
            "le90": error_radii.mixture_linear(sd, 0.9) if len(sd) else math.nan,
        },
        surface=surface(found),
    )


def _sized(values: Floats, names: tuple[str, ...], *, radial: bool = False) -> Sized | None:
    own = np.flatnonzero(np.isfinite(values))
    if not len(own):
        return None
    some = values[own]
    worst = int(own[np.argmax(np.abs(some))])
    mean = math.nan if radial else float(some.mean())
    sd = math.nan if radial or len(own) < 2 else float(some.std(ddof=1))
    return Sized(len(own), mean, sd, root_mean(some**2), float(abs(values[worst])), names[worst])


def _radii(plan: Floats, heights: Floats) -> dict[str, dict[str, Any] | None]:
    found: dict[str, dict[str, Any] | None] = {}
    for p in PROBABILITIES:
        for name, values in (("ce", plan), ("le", heights)):
            key = f"{name}{round(100 * p)}"
            if not len(values):
                found[key] = None
                continue
            order, sample = error_radii.sample_radius(values, p)
            upper = error_radii.upper_order(len(values), p)
            largest = None if upper is None else float(np.sort(values)[upper - 1])
            found[key] = {"order": order, "sample": sample, "upper_order": upper, "upper": largest}
    return found
