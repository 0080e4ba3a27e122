"""Degrees of freedom of combined variances, with intervals and factors.

A sum of squares of correlated errors with the covariance C has the mean tr C and the variance 2 tr C^2. It is
approximately chi-square with k = (tr C)^2 / tr C^2 degrees of freedom, fewer than the number of errors
(Satterthwaite 1946, Welch 1947). The variance u^2 of a quantity is the sum of contributions of observation
groups. Some of these are given; others are estimated with variance components that have a covariance.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import argument_error, matrix_fault, number, numbers, shaped, truth_value
from photogram.arguments.arrays import probability as checked_probability
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.statistics.distributions import LEVEL, critical_student
from photogram.words import phrase

ROUNDING = 1e-9
"""Rounding tolerance of integer degrees of freedom, and relative tolerance of traces."""


def effective_freedom(covariance: ArrayLike) -> float:
    """Return the degrees of freedom of a sum of correlated squares: (tr C)^2 / tr C^2.

    Parameters
    ----------
    covariance
        (m, m) of errors in the same unit; possibly singular.

    Returns
    -------
    Between 1 and m; NaN without error, or if one is unknown.

    Raises
    ------
    InputError
        If `covariance` is not a square matrix of numbers, or not a covariance.
    """
    matrix = numbers("covariance", covariance, missing=True)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise argument_error("covariance", "shape", shape="(m, m)", actual=matrix.shape)
    trace = float(np.trace(matrix))
    if trace == 0 or not np.isfinite(matrix).all():
        return math.nan
    unit = matrix / trace
    if np.diag(unit).min() < 0 or np.abs(unit - unit.T).max() > ROUNDING:
        raise InputError(phrase("error.covariance-singular"))
    return 1 / float(np.sum(unit**2))


def rmse_interval(rmse: float, freedom: float, level: float = LEVEL) -> tuple[float, float]:
    """Return the confidence interval of the expected RMSE of a sample.

    The formula is rmse sqrt(k / chi2), two-sided (section 2.1 of the specification of the statement).

    Parameters
    ----------
    rmse
        Root mean square error of the sample, in any unit.
    freedom
        Its degrees of freedom k; see :func:`effective_freedom`.
    level
        Probability that the interval fails, half of it on each side.

    Returns
    -------
    Lower and upper end in the same unit; NaN if the degrees of freedom are.

    Raises
    ------
    InputError
        If the error is negative, the degrees of freedom are not positive, or the level is not a probability.
    """
    checked_probability("level", level)
    if rmse < 0:
        raise argument_error("rmse", "not-negative", value=rmse)
    if freedom <= 0:
        raise argument_error("freedom", "positive", value=freedom)
    if math.isnan(freedom):
        return math.nan, math.nan
    if math.isinf(freedom):
        return rmse, rmse
    high, low = (_photocore.chi_square_quantile(level / 2, freedom, upper=side) for side in (True, False))
    return rmse * math.sqrt(freedom / high), rmse * math.sqrt(freedom / low)


def welch_satterthwaite(u: ArrayLike, freedom: ArrayLike) -> float:
    """Return the degrees of freedom of a combined uncertainty, u^4 / sum(u_k^4 / nu_k) (JCGM 100:2008, G.4).

    Parameters
    ----------
    u
        (k,) standard uncertainties of the contributions, in the same unit and independent.
    freedom
        (k,) their degrees of freedom; infinite for given uncertainties.

    Returns
    -------
    Infinite if nothing was estimated.

    Raises
    ------
    InputError
        If shapes differ, an uncertainty is negative, or degrees of freedom are not positive.
    """
    own = shaped("u", u, (None,), "not-negative")
    dof = shaped("freedom", freedom, own.shape)
    if not (dof > 0).all():
        row = int(np.argmin(dof > 0))
        raise argument_error(f"freedom[{row}]", "positive", value=float(dof[row]))
    return _freedom(float(np.sum(own**2)), float(np.sum(own**4 / dof)))


def joint_freedom(contributions: ArrayLike, covariance_of_components: ArrayLike, given: float = 0.0) -> float:
    """Return the degrees of freedom of a variance with estimated components.

    nu = 2 u^4 / (c' cov c), section 3 of the specification of the statement. Unlike the formula of Welch and
    Satterthwaite, it includes correlations of the components.

    Parameters
    ----------
    contributions
        (k,) c = u_k^2, the parts of u^2 of the groups with estimated components.
    covariance_of_components
        (k, k) of their components, relative to the components used to compute the contributions.
    given
        The part of u^2 of all groups with given variances.

    Returns
    -------
    Infinite if nothing was estimated.

    Raises
    ------
    InputError
        If shapes differ, a contribution is negative, or the matrix is not a covariance.
    """
    c = shaped("contributions", contributions, (None,), "not-negative")
    matrix = shaped("covariance_of_components", covariance_of_components, 2 * c.shape)
    if fault := matrix_fault(matrix, singular=True):
        raise InputError(fault)
    number("given", given, "not-negative")
    return _freedom(float(np.sum(c)) + given, float(c @ matrix @ c) / 2)


def coverage_factor(probability: float, freedom: float, truncated: bool = True) -> float:
    """Return the factor k of an expanded uncertainty U = k u (JCGM 100:2008, G.6.4).

    Parameters
    ----------
    probability
        Probability of the interval: 0.95 gives 1.96 if u is known.
    freedom
        Degrees of freedom of u, infinite if it is known.
    truncated
        True to truncate the degrees of freedom to an integer first, as in the GUM.

    Returns
    -------
    The two-sided quantile of Student's distribution; infinite below one degree of freedom if truncated.

    Raises
    ------
    InputError
        If the probability is invalid, or the degrees of freedom are not positive.
    """
    truth_value("truncated", truncated)
    checked_probability("probability", probability)
    if not freedom > 0:
        raise argument_error("freedom", "positive", value=freedom)
    whole = truncated and math.isfinite(freedom)
    return critical_student(1 - probability, math.floor(freedom + ROUNDING) if whole else freedom)


def _freedom(variance: float, half: float) -> float:
    """Return the degrees of freedom of a variance, given half of its own variance."""
    return variance**2 / half if half > 0 else math.inf


def root_mean(squares: Floats) -> float:
    """Return the root mean of known values; NaN without any."""
    known = squares[np.isfinite(squares)]
    return math.sqrt(float(known.mean())) if known.size else math.nan
