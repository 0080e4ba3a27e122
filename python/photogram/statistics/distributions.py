"""Critical values and probabilities of the tests of an adjustment, in one place.

Tests of observations with known standard deviations are chi-square (Baarda 1968). If the unit weight is
estimated from the same residuals, they are F, t or tau (Pope 1976). Probabilities of huge values are handled
as logarithms, so that 1e-5000 is less than 1e-4000.

* tau = w / s of an observation never exceeds the root of the f degrees of freedom: (tau / sqrt f)^2 is Beta
  (1/2, (f - 1)/2), so its limits follow exactly from Student's t with f - 1 (Thompson, Ann. Math. Statist. 6,
  1935).
* lambda0 is the noncentrality at which a test of a level is significant with a given power. The B-method
  chooses the levels of tests of several dimensions so that all find the same error with the same power
  (Baarda 1968).
* For multiple tests, Bonferroni limits the probability of rejecting any good observation, for any
  correlations. Benjamini and Hochberg (J. Roy. Statist. Soc. B 57, 1995) limit the share of good observations
  among the rejected ones, for independent tests.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram import _photocore
from photogram.arguments.arrays import probability, truth_value
from photogram.errors import InputError
from photogram.words import phrase

LEVEL = 0.05  # Level of the global test, and of all single tests together


def critical_normal(level: float) -> float:
    """Return the two-sided critical value of a standard normal variable for a level."""
    from statistics import NormalDist  # takes long to import

    return -NormalDist().inv_cdf(probability("level", level) / 2)


def critical_student(level: float, dof: float) -> float:
    """Return the two-sided critical value of Student's variable for a level.

    The normal distribution is used if `dof` is infinite. Infinite if `dof` is not positive.
    """
    if not dof > 0:
        return math.inf
    return (
        critical_normal(level)
        if math.isinf(dof)
        else _photocore.student_limit(probability("level", level), dof)
    )


def critical_tau(level: float, dof: float) -> float:
    """Return the two-sided critical value of an internally studentized w / s.

    Parameters
    ----------
    level
        Significance level.
    dof
        f of the adjustment. Less than two allow no test, because every |tau| is the root of f.

    Returns
    -------
    sqrt(f) t / sqrt(f - 1 + t^2), with Student's t for f - 1 degrees of freedom; less than the root of f.
    Infinite below two degrees of freedom.
    """
    if not dof >= 2:
        return math.inf
    t = critical_student(level, dof - 1)
    return t if math.isinf(dof) else math.sqrt(dof) * t / math.hypot(math.sqrt(dof - 1), t)


def critical_chi_square(level: float, dof: float) -> float:
    """Return the value that a chi-square variable exceeds with the level."""
    return _photocore.chi_square_quantile(probability("level", level), dof, upper=True)


def critical_fisher(level: float, first: float, second: float) -> float:
    """Return the value that Fisher's variable exceeds with the level.

    Chi-square over `first` if `second` is infinite. Infinite if `second` is not positive.
    """
    if not second > 0:
        return math.inf
    if math.isinf(second):
        return critical_chi_square(level, first) / first
    return _photocore.fisher_limit(probability("level", level), first, second)


def log_chi_square(x: ArrayLike, dof: ArrayLike) -> NDArray[np.float64]:
    """Return logarithms of the probabilities that chi-square variables exceed values.

    Parameters
    ----------
    x, dof
        Values and degrees of freedom, in shapes that can be broadcast.

    Returns
    -------
    Natural logarithms, finite even if the probability underflows; NaN without degrees of freedom, or if a
    value is negative or NaN.
    """
    both = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(dof, dtype=np.float64))
    return _photocore.log_chi_square(*(np.ravel(each) for each in both)).reshape(both[0].shape)


def log_fisher(x: ArrayLike, first: ArrayLike, second: ArrayLike) -> NDArray[np.float64]:
    """Return logarithms of the probabilities that Fisher's variables exceed values.

    As :func:`log_chi_square`; `first` and `second` are degrees of freedom, `second` finite.
    """
    given = [np.asarray(each, dtype=np.float64) for each in (x, first, second)]
    three = np.broadcast_arrays(*given)
    return _photocore.log_fisher(*(np.ravel(each) for each in three)).reshape(three[0].shape)


def lambda0(level: float = 0.001, power: float = 0.80, dimension: float = 1, dof: float = math.inf) -> float:
    """Return the noncentrality of an error that a test finds with a given power.

    Parameters
    ----------
    level
        Significance level of the test (alpha0).
    power
        Probability that the error is found (beta0); more than the level.
    dimension
        Degrees of freedom of the tested group.
    dof
        f of the adjustment if the unit weight is estimated from it. The test is then F with `dimension` and f
        - `dimension`. Infinite if the unit weight is known.

    Returns
    -------
    17.0746 for Baarda's choice, the default; infinite if f does not exceed the dimension.

    Raises
    ------
    InputError
        If level and power are not in their ranges.
    """
    if not 0 < level < power < 1:
        raise InputError(phrase("error.power", level=level, power=power))
    if not dof > dimension:
        return math.inf
    return _photocore.detectable_noncentrality(level, power, dimension, dof - dimension)


def b_method(dimension: float, level: float = 0.001, power: float = 0.80) -> tuple[float, float]:
    """Return level and chi-square limit that find the same error as a single test.

    Parameters
    ----------
    dimension
        Degrees of freedom of the test of a group, or of the global test.
    level, power
        Level and power of the test of one observation; see :func:`lambda0`.
    """
    return _photocore.level_of_equal_power(lambda0(level, power), power, dimension)


def bonferroni(level: float, tests: int) -> float:
    """Return the level of each test for a joint probability of a false rejection."""
    return probability("level", level) / max(tests, 1)


def benjamini_hochberg(
    probabilities: ArrayLike, level: float = LEVEL, *, dependent: bool = False
) -> NDArray[np.bool_]:
    """Return rejected tests with a limited expected share of good ones.

    Parameters
    ----------
    probabilities
        (n,) p-values; NaN if nothing is tested.
    level
        False discovery rate.
    dependent
        True to limit it under any dependence between the tests (Benjamini and Yekutieli 2001).
    """
    truth_value("dependent", dependent)
    p = np.asarray(probabilities, dtype=np.float64)
    order = np.argsort(p, kind="stable")  # NaN last
    ranks = np.arange(1, np.count_nonzero(~np.isnan(p)) + 1)
    if not ranks.size:
        return np.zeros(p.shape, dtype=bool)
    allowed = probability("level", level) * ranks / (ranks.size * (np.sum(1 / ranks) if dependent else 1.0))
    within = np.flatnonzero(p[order[: ranks.size]] <= allowed)
    rejected = np.zeros(p.shape, dtype=bool)
    if within.size:
        rejected[order[: within[-1] + 1]] = True
    return rejected
