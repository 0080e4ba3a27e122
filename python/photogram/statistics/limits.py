"""Global tests of an adjustment and its observations, with common limits.

Observations l with standard deviations sd have residuals v. Omega is the sum of (v / sd)^2, f the degrees of
freedom, and r the redundancy number of an observation. w = v / (sd sqrt(r)) is its standardized residual.

* Global test: if the standard deviations are correct, Omega is chi-square with f degrees of freedom.
* A single residual, unit weight known: w is standard normal (Baarda 1968).
* A single residual, unit weight estimated from the same residuals. The internally studentized tau = w / s,
  s^2 = Omega / f, never exceeds the root of f, so a fixed limit is unsuitable. The externally studentized t =
  w / s(i) uses the unit weight s(i)^2 = (Omega - w^2) / (f - 1) of the other observations. It has Student's
  distribution with f - 1 degrees of freedom. Its test is Pope's test of tau (NOAA Technical Report NOS 65 NGS
  1, 1976).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram import _photocore
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import (
    LEVEL,
    bonferroni,
    critical_fisher,
    critical_normal,
    critical_student,
    log_chi_square,
    log_fisher,
)
from photogram.words import phrase

NOTABLE_FACTOR = 1.25
"""Least notable factor of residuals relative to their standard deviations.

With many degrees of freedom, the global test detects smaller factors, which are harmless."""


@dataclass(frozen=True)
class GlobalTest:
    """The two-sided chi-square test of all residuals.

    Attributes
    ----------
    weighted_sum_of_squares, degrees_of_freedom
        Omega and f.
    level
        Probability that correct standard deviations are rejected, half of it on each side.
    limits
        Lower and upper limit of the variance of unit weight, Omega / f.
    probability_below, probability_above
        Probabilities of a sum at most and at least as large, if the standard deviations are correct.
    reference_dof
        Degrees of freedom of the reference unit weight; infinite if known. The test is then chi-square,
        otherwise F.
    """

    weighted_sum_of_squares: float
    degrees_of_freedom: float
    level: float
    limits: tuple[float, float]
    probability_below: float
    probability_above: float
    reference_dof: float = math.inf

    @property
    def interval(self) -> tuple[float, float]:
        """Confidence interval of the true factor at 1 - level; see :attr:`factor`."""
        low, high = self.limits
        return math.sqrt(self.variance / high), math.sqrt(self.variance / low) if low > 0 else math.inf

    @property
    def variance(self) -> float:
        """Variance of unit weight, Omega / f."""
        return self.weighted_sum_of_squares / self.degrees_of_freedom

    @property
    def factor(self) -> float:
        """Factor of residuals relative to the expected ones: the root of the variance."""
        return math.sqrt(self.variance)

    @property
    def rejected_high(self) -> bool:
        """Whether residuals are larger than the standard deviations allow, or NaN."""
        return not self.probability_above >= self.level / 2

    @property
    def rejected_low(self) -> bool:
        """Whether residuals are smaller than the standard deviations allow."""
        return self.probability_below < self.level / 2

    @property
    def probability(self) -> float:
        """Two-sided p-value, if the standard deviations are correct."""
        return min(1.0, 2 * min(self.probability_below, self.probability_above))

    @property
    def log10_probability(self) -> float:
        """Decimal logarithm of :attr:`probability`, also if the probability underflows."""
        if self.probability > 0:
            return math.log10(self.probability)
        if math.isinf(self.reference_dof):
            log_p = log_chi_square(self.weighted_sum_of_squares, self.degrees_of_freedom)
        else:
            log_p = log_fisher(self.variance, self.degrees_of_freedom, self.reference_dof)
        return (float(log_p) + math.log(2)) / math.log(10)

    def problem(self) -> str | None:
        """Return a sentence for the report if residuals are too large by a notable factor."""
        if not self.rejected_high or self.factor <= NOTABLE_FACTOR:
            return None
        limits = {"low": self.limits[0], "high": self.limits[1], "level": 100 * self.level}
        return str(phrase("problem.global-test", factor=self.factor, variance=self.variance, **limits))


def global_test(
    weighted_sum_of_squares: float,
    degrees_of_freedom: float,
    level: float = LEVEL,
    reference_dof: float = math.inf,
) -> GlobalTest | None:
    """Test all residuals together against their standard deviations.

    Parameters
    ----------
    weighted_sum_of_squares
        Omega, with the standard deviations a priori.
    degrees_of_freedom
        f; may be fractional.
    level
        Probability that correct standard deviations are rejected, half of it on each side.
    reference_dof
        Degrees of freedom of a unit weight that was estimated from other data and has scaled the standard
        deviations. Default: infinite (known).

    Returns
    -------
    The test, or None without degrees of freedom.
    """
    if not degrees_of_freedom > 0:
        return None
    omega, f = float(weighted_sum_of_squares), float(degrees_of_freedom)
    if math.isinf(reference_dof):
        limits = (
            _photocore.chi_square_quantile(level / 2, f, upper=False) / f,
            _photocore.chi_square_quantile(level / 2, f, upper=True) / f,
        )
        below, above = (_photocore.chi_square(omega, f, upper=upper) for upper in (False, True))
    else:
        # The lower tail of F is the upper tail of its reciprocal.
        limits = (
            1 / critical_fisher(level / 2, reference_dof, f),
            critical_fisher(level / 2, f, reference_dof),
        )
        below = _photocore.fisher(f / omega if omega > 0 else math.inf, reference_dof, f)
        above = _photocore.fisher(omega / f, f, reference_dof)
    return GlobalTest(omega, f, level, limits, below, above, reference_dof)


def externally_studentized(
    standardized: ArrayLike, weighted_sum_of_squares: float, degrees_of_freedom: float
) -> NDArray[np.float64]:
    """Return standardized residuals with the unit weight of other observations.

    Parameters
    ----------
    standardized
        w = v / (sd sqrt(r)), a priori unit weight, any shape.
    weighted_sum_of_squares, degrees_of_freedom
        Omega and f of the adjustment with these residuals.

    Returns
    -------
    t of the same shape: Student with f - 1 degrees of freedom. Unbounded: very large if an observation makes
    up all of Omega. NaN if w is, and always with less than two degrees of freedom.
    """
    w = np.asarray(standardized, dtype=np.float64)
    omega, f = float(weighted_sum_of_squares), float(degrees_of_freedom)
    if not (f >= 2 and omega > 0):
        return np.full(w.shape, math.nan)
    # The difference is zero within rounding if an observation makes up all of Omega.
    others = np.maximum(omega - w**2, 1e-12 * omega)
    return np.asarray(w / np.sqrt(others / (f - 1)))


def studentized_limit(degrees_of_freedom: float, tests: int, level: float = LEVEL) -> float:
    """Return the critical value of externally studentized residuals.

    Parameters
    ----------
    degrees_of_freedom
        f of the adjustment; the distribution is Student's with f - 1.
    tests
        Number of tested residuals.
    level
        Probability that any good observation exceeds it (Bonferroni: `level / tests` for each, two-sided).

    Returns
    -------
    Infinite with less than two degrees of freedom, which allow no test.
    """
    if degrees_of_freedom < 2:
        return math.inf
    return critical_student(bonferroni(level, tests), degrees_of_freedom - 1)


def normal_limit(tests: int, level: float = LEVEL) -> float:
    """Return the critical value of standardized residuals, unit weight known.

    Parameters
    ----------
    tests
        Number of tested residuals.
    level
        Probability that any good observation exceeds it (Bonferroni: `level / tests` for each, two-sided).
    """
    return critical_normal(bonferroni(level, tests))
