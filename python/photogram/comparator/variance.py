"""Where errors come from (NOAA TR NOS 57, equations 66 to 68, figure 30), and tests of significance.

Probabilities of the tests need scipy (`pip install 'photogram[statistics]'`) and are None without it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.combined_solution import CombinedLinear, CombinedPolynomial
from photogram.comparator.fits import RigidFit
from photogram.comparator.pointing import Precision
from photogram.comparator.polynomial import TERMS
from photogram.lazy_dataclasses import dataclass

NM = 1000.0


@dataclass(frozen=True)
class AxisSigma:
    """Standard deviations of x, of y, and their root mean square, micrometres."""

    x: float
    y: float

    @property
    def total(self) -> float:
        """Root mean square of both axes."""
        return math.sqrt((self.x**2 + self.y**2) / 2)

    def truncated(self) -> AxisSigma:
        """Return both cut to whole nanometres, as SIGX and SIGY in the INTEGER array CAL of the listing."""
        return AxisSigma(math.floor(self.x * NM) / NM, math.floor(self.y * NM) / NM)


@dataclass(frozen=True)
class VarianceAnalysis:
    """The lines of figure 30, standard deviations in micrometres."""

    before: AxisSigma  # Of the free adjustments: everything
    after_linear: AxisSigma  # What the linear parameters leave; what the polynomials leave (None without)
    after_nonlinear: AxisSigma | None
    pointing: AxisSigma  # Of a mean
    grid: float  # Of a grid coordinate
    linear: float  # Their shares; 0 where the difference of variances is negative (`negative` names it)
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
    """Return the root of total^2 less squares of the parts (0 if negative), and whether it was."""
    variance = total**2 - sum(part**2 for part in parts)
    return math.sqrt(max(0.0, variance)), variance < 0


def analyse_variance(
    free: Sequence[RigidFit],
    linear: CombinedLinear,
    nonlinear: CombinedPolynomial | None,
    pointing: Precision,
    grid_um: float,
    *,
    as_listed: bool = False,
) -> VarianceAnalysis:
    """Split the total error into linear, nonlinear, grid, pointing and random.

    Parameters
    ----------
    free
        The free adjustments of the measurements.
    linear, nonlinear
        The combined adjustments; without polynomials the nonlinear share is 0.
    pointing
        Pooled precision of all pointings (equation 30).
    grid_um
        Standard deviation of a grid coordinate.
    as_listed
        Cut the sigmas after the linear stage (SIGX, SIGY) to whole nanometres first: the listing takes them
        back from the INTEGER array of its cards, those after the nonlinear stage it still has.
    """
    before = _pooled(free, sum(len(fit.residuals.points) - 1.5 for fit in free))
    # nu of equation 57 counts both axes.
    after_linear = _pooled(linear.cases, linear.degrees_of_freedom / 2)
    after = AxisSigma(*nonlinear.sigma_um) if nonlinear else None
    if as_listed:
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
        linear=shares["linear"][0],
        nonlinear=shares["nonlinear"][0],
        random=shares["random"][0],
        negative=tuple(name for name, (_, negative) in shares.items() if negative),
    )


def _pooled(fits: Sequence[RigidFit], dof: float) -> AxisSigma:
    squares = np.array([fit.residuals.squares_um2[:2] for fit in fits]).sum(axis=0) / dof
    return AxisSigma(math.sqrt(squares[0]), math.sqrt(squares[1]))


# Terms that are tested: those of first and zeroth degree belong to the linear parameters as well
OWN_TERMS = 6


@dataclass(frozen=True)
class TermTest:
    """Student's test of one term, given all others."""

    axis: str  # `x` or `y`, and the term, its argument counted from the middle of the measured range
    term: str
    coefficient_um: float  # Its effect at the edge of the range, and the standard deviation
    sd_um: float
    probability: float | None  # Of a ratio as large as this (two-sided) without the term; None without scipy

    @property
    def ratio(self) -> float:
        """Coefficient over standard deviation (t)."""
        return self.coefficient_um / self.sd_um if self.sd_um > 0 else math.nan


@dataclass(frozen=True)
class PolynomialTest:
    """Fisher's test of all terms together, and Student's of each."""

    ratio: float  # F, and its two degrees of freedom
    degrees_of_freedom: tuple[int, int]
    probability: float | None  # Of so large a ratio without polynomials; None without scipy
    terms: tuple[TermTest, ...]  # Each term


@dataclass(frozen=True)
class CaseVarianceTest:
    """Tests of equal variances of the cases: Hartley's F-max, as the report says, and two more."""

    f_max: float  # Largest variance of unit weight of a single case over the smallest
    degrees_of_freedom: int  # The fewest of a case
    # Of so large a ratio for equal variances, and the ratio of probability 0.05
    f_max_probability: float | None
    f_max_limit: float | None
    bartlett_probability: float | None  # Of Bartlett's and Levene's tests
    levene_probability: float | None


NODES = 200


def _scipy() -> bool:
    return find_spec("scipy") is not None


def polynomial_tests(linear: CombinedLinear, nonlinear: CombinedPolynomial) -> PolynomialTest:
    """Test the polynomials of the combined adjustment."""
    polynomial = nonlinear.polynomial
    dof = linear.degrees_of_freedom - 2 * OWN_TERMS
    before = sum(sum(fit.residuals.squares_um2[:2]) for fit in linear.cases)
    after = sum(sum(fit.residuals.squares_um2[:2]) for fit in nonlinear.cases)
    ratio = (before - after) / (2 * OWN_TERMS) / (after / dof) if after > 0 else math.nan
    sd = np.sqrt(after / dof * np.diag(polynomial.scaled_cofactors)).reshape(2, -1)
    terms = tuple(
        TermTest(
            axis,
            TERMS[term],
            float(polynomial.scaled_um[row, term]),
            float(sd[row, term]),
            _student(float(polynomial.scaled_um[row, term]), float(sd[row, term]), dof),
        )
        for row, axis in enumerate("xy")
        for term in range(OWN_TERMS)
    )
    return PolynomialTest(ratio, (2 * OWN_TERMS, dof), _fisher(ratio, 2 * OWN_TERMS, dof), terms)


def compare_case_variances(residuals: Sequence[Floats], dof: Sequence[int]) -> CaseVarianceTest:
    """Compare the variances of unit weight of single cases, by their residuals (n, 2) in micrometres.

    Where degrees of freedom differ, F-max takes the fewest, and errs on the safe side.
    """
    squares = [float((values**2).sum()) for values in residuals]
    variances = [square / own for square, own in zip(squares, dof, strict=True)]
    ratio = max(variances) / min(variances) if min(variances) > 0 else math.inf
    few = min(dof)
    if not _scipy() or not math.isfinite(ratio):
        return CaseVarianceTest(ratio, few, None, None, None, None)
    from scipy.stats import levene

    return CaseVarianceTest(
        ratio,
        few,
        _f_max_tail(ratio, len(dof), few),
        _f_max_limit(len(dof), few),
        _bartlett(variances, dof),
        float(levene(*(values.ravel() for values in residuals)).pvalue),
    )


def _student(value: float, sd: float, dof: int) -> float | None:
    if not _scipy() or sd == 0:
        return None
    from scipy.stats import t

    return float(2 * t.sf(abs(value / sd), dof))


def _fisher(ratio: float, first: int, second: int) -> float | None:
    if not _scipy() or math.isnan(ratio):
        return None
    from scipy.stats import f

    return float(f.sf(ratio, first, second))


def _bartlett(variances: Sequence[float], dof: Sequence[int]) -> float:
    """Return the probability of Bartlett's statistic, from variances and degrees of freedom."""
    from scipy.stats import chi2

    own = np.array(dof, dtype=float)
    total = own.sum()
    pooled = float(own @ variances / total)
    statistic = total * math.log(pooled) - float(own @ np.log(variances))
    correction = 1 + (float((1 / own).sum()) - 1 / total) / (3 * (len(own) - 1))
    return float(chi2.sf(statistic / correction, len(own) - 1))


def _f_max_tail(ratio: float, groups: int, dof: int) -> float:
    """Probability that the largest of `groups` variances is `ratio` times the smallest, or more.

    1 - k times the integral over u = G(x) from 0 to 1 of [G(ratio x) - u]^(k-1), with G the distribution of
    chi squared: x is the smallest. Gauss-Legendre nodes.
    """
    from scipy.stats import chi2

    u, weights = _unit_nodes()
    inside = chi2.cdf(ratio * chi2.ppf(u, dof), dof) - u
    within = groups * float(weights @ inside ** (groups - 1))
    return min(1.0, max(0.0, 1 - within))


@cache
def _unit_nodes() -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights of the interval from 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return (nodes + 1) / 2, weights / 2


def _f_max_limit(groups: int, dof: int) -> float:
    from scipy.optimize import brentq

    return float(brentq(lambda ratio: _f_max_tail(ratio, groups, dof) - 0.05, 1.0, 1e4, xtol=1e-4))
