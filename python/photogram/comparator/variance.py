"""Combined solution of all cases, analysis of variance, and tests (NOAA TR NOS 57)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats, Indices
from photogram.comparator.case import PlacedCase
from photogram.comparator.correction import Correction
from photogram.comparator.fits import (
    COUNT,
    TERMS,
    AffineFit,
    Polynomial,
    Residuals,
    RigidFit,
    fit_polynomial,
    fit_rigid,
    rotation_matrix,
)
from photogram.comparator.readings import Precision
from photogram.lazy_dataclasses import dataclass, replace
from photogram.statistics.distributions import critical_chi_square, log_chi_square, log_fisher


@dataclass(frozen=True, eq=False)
class CombinedLinear:
    correction: Correction  # Scales and lack of orthogonality
    sigma0_um: float  # Standard error of unit weight and its degrees of freedom (equation 57)
    degrees_of_freedom: int
    covariance: Floats  # (3, 3) of scale x, scale y, lack of orthogonality in radians (equation 58)
    cases: tuple[RigidFit, ...]  # Rigid fit of each case after the correction


@dataclass(frozen=True, eq=False)
class SinglePolynomial:
    """Polynomials of one case, and the residuals after its linear adjustment."""

    polynomial: Polynomial
    residuals: Residuals

    @property
    def covariance(self) -> Floats:
        """(18, 18) coefficient covariance, metre units (m^2 times powers of 1/m), x first (equation 61)."""
        return self.residuals.sigma0_um**2 * self.polynomial.cofactors


@dataclass(frozen=True, eq=False)
class CombinedPolynomial:
    correction: Correction  # Linear parameters and polynomials
    polynomial: Polynomial
    sigma_um: tuple[float, float]  # (2,) standard deviations of the residuals in x and in y (equation 62)
    degrees_of_freedom: int  # Degrees of freedom of each
    cases: tuple[RigidFit, ...]  # Rigid fit of each case after the whole correction

    @property
    def sigma0_um(self) -> float:
        """Standard error of unit weight of both axes (equation 62)."""
        return math.sqrt(sum(sigma**2 for sigma in self.sigma_um) / 2)

    @property
    def covariance(self) -> Floats:
        """(18, 18) coefficient covariance, metre units (m^2 times powers of 1/m), x first (equation 61)."""
        return self.sigma0_um**2 * self.polynomial.cofactors


def combine_linear(cases: Sequence[PlacedCase], fits: Sequence[AffineFit]) -> CombinedLinear:
    """Form the generalised weighted mean of the linear parameters of the cases.

    With the inverse cofactors P_j of case j: mean = (sum P)^-1 sum P x. Its sum of squares adds to the sums
    of the cases.
    """
    linear = [fit.parameters for fit in fits]
    values = np.array([[each.scale_x, each.scale_y, each.nonorthogonality_rad] for each in linear])
    weights = [np.linalg.inv(fit.cofactors[:3, :3]) for fit in fits]
    total = np.sum(weights, axis=0)
    # Deviations from the first case avoid cancellation for scales near one.
    offsets = values - values[0]
    mean = np.linalg.solve(total, np.sum([w @ x for w, x in zip(weights, offsets, strict=True)], axis=0))
    squares = sum(sum(fit.residuals.squares_um2[:2]) for fit in fits)
    squares += sum(float((x - mean) @ w @ (x - mean)) for w, x in zip(weights, offsets, strict=True))
    dof = 2 * sum(len(case.points) for case in cases) - 3 * (len(cases) + 1)
    sigma0 = math.sqrt(squares / dof)
    scale_x, scale_y, lean = (values[0] + mean).tolist()
    covariance = sigma0**2 * np.linalg.inv(total)
    correction = Correction(scale_x, scale_y, lean)
    correction.covariance[:3, :3] = covariance
    lost = 0.5 * (3 + 3 / len(cases))
    return CombinedLinear(correction, sigma0, dof, covariance, _refit(cases, correction, lost))


def _refit(cases: Sequence[PlacedCase], correction: Correction, lost: float) -> tuple[RigidFit, ...]:
    return tuple(
        fit_rigid(case.points, correction.apply(case.means_um), case.grid_um, lost=lost) for case in cases
    )


def single_polynomial(case: PlacedCase, fit: AffineFit, *, as_published: bool = False) -> SinglePolynomial:
    """Fit polynomials to the linear residuals of one case (equations 59 to 61).

    `as_published` omits the sign change of the grid residuals.
    """
    parameters = fit.parameters
    linear = case.means_um @ parameters.linear_matrix.T
    polynomial = fit_polynomial(linear, fit.residuals.comparator_um)
    values = polynomial.evaluate(linear)
    comparator = fit.residuals.comparator_um - values
    sign = 1.0 if as_published else -1.0
    grid = sign * comparator @ rotation_matrix(parameters.rotation_rad).T
    return SinglePolynomial(
        polynomial, Residuals(case.points, linear + values, comparator, grid, float(COUNT))
    )


def combine_polynomial(cases: Sequence[PlacedCase], linear: CombinedLinear) -> CombinedPolynomial:
    """Fit polynomials to the residuals of the combined linear parameters of all cases."""
    places = np.vstack([fit.residuals.xy_um for fit in linear.cases])
    residuals = np.vstack([fit.residuals.comparator_um for fit in linear.cases])
    polynomial = fit_polynomial(places, residuals)
    dof = len(places) - COUNT
    squares = ((residuals - polynomial.evaluate(places)) ** 2).sum(axis=0)
    sigma = (math.sqrt(squares[0] / dof), math.sqrt(squares[1] / dof))
    covariance = linear.correction.covariance.copy()
    covariance[3:, 3:] = (sigma[0] ** 2 + sigma[1] ** 2) / 2 * polynomial.scaled_cofactors
    correction = replace(linear.correction, polynomial=polynomial, covariance=covariance)
    fits = _refit(cases, correction, COUNT / len(cases))
    return CombinedPolynomial(correction, polynomial, sigma, dof, fits)


NM = 1000.0


@dataclass(frozen=True)
class AxisSigma:
    """Standard deviations of x, of y, and their root mean square, micrometres."""

    x: float
    y: float

    @property
    def total(self) -> float:
        return math.sqrt((self.x**2 + self.y**2) / 2)

    def truncated(self) -> AxisSigma:
        """Return both truncated to whole nanometres, as in the INTEGER array CAL."""
        return AxisSigma(math.floor(self.x * NM) / NM, math.floor(self.y * NM) / NM)


@dataclass(frozen=True)
class VarianceAnalysis:
    """Lines of figure 30, standard deviations in micrometres."""

    before: AxisSigma  # Total error of the free adjustments
    after_linear: AxisSigma  # Residual error after the linear parameters, and after the polynomials (or None)
    after_nonlinear: AxisSigma | None
    pointing: AxisSigma  # Pointing error of a mean
    grid: float  # Error of a grid coordinate
    linear: float  # Components; 0 if the difference of variances is negative (`negative` names it)
    nonlinear: float
    random: float
    negative: tuple[str, ...]  # Names of the components whose estimated variance is negative

    @property
    def components_um(self) -> dict[str, float]:
        """Standard deviations by component (equation 66)."""
        return {
            "linear": self.linear,
            "nonlinear": self.nonlinear,
            "grid": self.grid,
            "pointing": self.pointing.total,
            "random": self.random,
            "total": self.before.total,
        }


def difference(total: float, *parts: float) -> tuple[float, bool]:
    """Return the root of total^2 minus squares of the parts, and whether it is < 0.

    The root of a negative difference is 0.
    """
    variance = total**2 - sum(part**2 for part in parts)
    return math.sqrt(max(0.0, variance)), variance < 0


def analyse_variance(
    free: Sequence[RigidFit],
    linear: CombinedLinear,
    nonlinear: CombinedPolynomial | None,
    pointing: Precision,
    grid_um: float,
    *,
    as_published: bool = False,
) -> VarianceAnalysis:
    """Split the total error into linear, nonlinear, grid, pointing and random parts.

    Without polynomials the nonlinear part is 0. `pointing` is the pooled precision of all pointings (equation
    30). `as_published` truncates the sigmas after the linear stage (SIGX, SIGY) to whole nanometres, as the
    INTEGER array of cards in the listing.
    """
    before = _pooled(free, sum(len(fit.residuals.points) - 1.5 for fit in free))
    # nu of equation 57 counts both axes.
    after_linear = _pooled(linear.cases, linear.degrees_of_freedom / 2)
    after = AxisSigma(*nonlinear.sigma_um) if nonlinear else None
    if as_published:
        after_linear = after_linear.truncated()
    last = after or after_linear
    means = pointing.mean_sd_um if pointing.degrees_of_freedom > 0 else (0.0, 0.0)
    mean_pointing = AxisSigma(*means)
    shares = {
        "linear": difference(before.total, after_linear.total),
        "nonlinear": difference(after_linear.total, last.total),
        "random": difference(last.total, grid_um, mean_pointing.total),
    }
    return VarianceAnalysis(
        before=before,
        after_linear=after_linear,
        after_nonlinear=after,
        pointing=mean_pointing,
        grid=grid_um,
        **{name: share for name, (share, _) in shares.items()},
        negative=tuple(name for name, (_, negative) in shares.items() if negative),
    )


def _pooled(fits: Sequence[RigidFit], dof: float) -> AxisSigma:
    squares = np.array([fit.residuals.squares_um2[:2] for fit in fits]).sum(axis=0) / dof
    return AxisSigma(math.sqrt(squares[0]), math.sqrt(squares[1]))


# Tested terms: terms of first and zeroth degree belong to the linear parameters as well
OWN_TERMS = 6


@dataclass(frozen=True)
class TermTest:
    axis: str  # `x` or `y`, and the term, its argument relative to the centre of the measured range
    term: str
    coefficient_um: float  # Its effect at the edge of the range, and the standard deviation
    sd_um: float
    probability: float | None  # Two-sided probability of an equal or larger ratio without the term

    @property
    def ratio(self) -> float:
        return self.coefficient_um / self.sd_um if self.sd_um > 0 else math.nan


@dataclass(frozen=True)
class PolynomialTest:
    """Fisher's test of all terms together, and Student's test of each."""

    ratio: float  # F and its two degrees of freedom
    degrees_of_freedom: tuple[int, int]
    probability: float | None  # Probability of an equal or larger ratio without polynomials
    terms: tuple[TermTest, ...]  # Each term


@dataclass(frozen=True)
class CaseVarianceTest:
    """Tests of equal case variances: Hartley's F-max of the report, and two more."""

    f_max: float  # Largest variance of unit weight of a single case over the smallest
    degrees_of_freedom: int  # Least degrees of freedom of a case
    # Probability of an equal or larger ratio for equal variances, and the ratio of probability 0.05
    f_max_probability: float | None
    f_max_limit: float | None
    bartlett_probability: float | None  # Probabilities of Bartlett's and Levene's tests
    levene_probability: float | None


NODES = 200


def polynomial_tests(linear: CombinedLinear, nonlinear: CombinedPolynomial) -> PolynomialTest:
    polynomial = nonlinear.polynomial
    dof = linear.degrees_of_freedom - 2 * OWN_TERMS
    before, after = (
        sum(sum(fit.residuals.squares_um2[:2]) for fit in stage.cases) for stage in (linear, nonlinear)
    )
    ratio = (before - after) / (2 * OWN_TERMS) / (after / dof) if after > 0 else math.nan
    sd = np.sqrt(after / dof * np.diag(polynomial.scaled_cofactors)).reshape(2, -1)
    terms = []
    for row, axis in enumerate("xy"):
        for term in range(OWN_TERMS):
            coefficient, own_sd = float(polynomial.scaled_um[row, term]), float(sd[row, term])
            p = _fisher((coefficient / own_sd) ** 2, 1, dof) if own_sd else None
            terms.append(TermTest(axis, TERMS[term], coefficient, own_sd, p))
    return PolynomialTest(ratio, (2 * OWN_TERMS, dof), _fisher(ratio, 2 * OWN_TERMS, dof), tuple(terms))


def _fisher(ratio: float, first: float, second: float) -> float | None:
    return None if math.isnan(ratio) else float(np.exp(log_fisher(ratio, first, second)))


def _chi_square(x: ArrayLike, dof: float) -> Floats:
    return np.asarray(np.exp(log_chi_square(x, dof)))


def compare_case_variances(residuals: Sequence[Floats]) -> CaseVarianceTest | None:
    """Compare the variances of unit weight of linear fits from residuals (n, 2), um.

    F-max uses the least degrees of freedom, which is conservative. None for one case.
    """
    if len(residuals) < 2:
        return None
    dof = np.array([values.size - 6 for values in residuals])
    variances = np.array([float((values**2).sum()) for values in residuals]) / dof
    ratio = float(variances.max() / variances.min()) if variances.min() > 0 else math.inf
    few = int(dof.min())
    if not math.isfinite(ratio):
        return CaseVarianceTest(ratio, few, None, None, None, None)
    return CaseVarianceTest(
        ratio,
        few,
        _f_max_tail(ratio, len(dof), few),
        _f_max_limit(len(dof), few),
        _bartlett(variances, dof),
        _levene([values.ravel() for values in residuals]),
    )


def _bartlett(variances: Floats, dof: Indices) -> float:
    total, groups = dof.sum(), len(dof)
    statistic = total * math.log(dof @ variances / total) - float(dof @ np.log(variances))
    correction = 1 + (float((1 / dof).sum()) - 1 / total) / (3 * (groups - 1))
    return float(_chi_square(statistic / correction, groups - 1))


def _levene(groups: Sequence[Floats]) -> float | None:
    """Return the probability of Levene's statistic from medians (Brown and Forsythe)."""
    away = [np.abs(values - np.median(values)) for values in groups]
    counts, means = np.array([len(values) for values in away]), np.array([values.mean() for values in away])
    between = counts @ (means - counts @ means / counts.sum()) ** 2 / (len(groups) - 1)
    within = sum(((values - values.mean()) ** 2).sum() for values in away) / (counts.sum() - len(groups))
    return _fisher(float(between / within), len(groups) - 1, int(counts.sum()) - len(groups))


def _f_max_tail(ratio: float, groups: int, dof: int) -> float:
    """Return the probability that the ratio of extreme variances is at least `ratio`.

    It is 1 - k times the integral over u = G(x) from 0 to 1 of [G(ratio x) - u]^(k-1), by Gauss-Legendre
    nodes. G is the chi-squared distribution and x the smallest variance.
    """
    u, weights, x = _nodes(dof)
    inside = 1 - _chi_square(ratio * x, dof) - u
    return min(1.0, max(0.0, 1 - groups * float(weights @ inside ** (groups - 1))))


@cache
def _nodes(dof: int) -> tuple[Floats, Floats, Floats]:
    """Return Gauss-Legendre nodes and weights from 0 to 1, and chi-squared quantiles."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    u = (nodes + 1) / 2
    return u, weights / 2, np.array([critical_chi_square(1 - each, dof) for each in u.tolist()])


def _f_max_limit(groups: int, dof: int) -> float:
    low, high = 0.0, math.log(1e4)
    while high - low > 1e-9:
        middle = (low + high) / 2
        low, high = (middle, high) if _f_max_tail(math.exp(middle), groups, dof) > 0.05 else (low, middle)
    return math.exp(low)
