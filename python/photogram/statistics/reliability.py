"""Reliability: how large a gross error must be to be found, and what it does when it is not (Baarda 1968).

An observation with the standard deviation sd and the redundancy number r has a standardized residual
w = v / (sd sqrt(r)), standard normal. A gross error e moves its expectation by e sqrt(r) / sd. The *minimal
detectable error* is the one that moves it by delta0, so that the test |w| > critical value finds it with the
chosen power:

    e0 = delta0 sd / sqrt(r)

and left in the data it changes no unknown, nor any function of them, by more than this multiple of its
standard deviation (external reliability):

    delta0 sqrt((1 - r) / r)

Both hold for the a priori unit weight, and need no measurements: planned networks have them too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.statistics.distributions import lambda0

TESTABLE = 0.01
"""With less redundancy a gross error hides in the unknowns, and the test value repeats that of another
observation."""

ROUNDING = 1e-10  # Redundancy numbers below this are rounding errors of zero


def standardized(residuals: Floats, sd: Floats, redundancy: Floats) -> Floats:
    """Return residuals over their own standard deviations, unit weight a priori (Baarda's w).

    NaN for what is no observation (sd infinite or zero), and where rounding is all there is of redundancy.
    """
    tested = np.isfinite(sd) & (sd > 0) & (redundancy > ROUNDING)
    values = np.full(residuals.shape, np.nan)
    values[tested] = residuals[tested] / (sd[tested] * np.sqrt(redundancy[tested]))
    return values


def noncentrality(significance: float = 0.001, power: float = 0.80) -> float:
    """Return delta0: how far a gross error must move a standardized residual to be found.

    Parameters
    ----------
    significance
        Chance that a good observation is rejected (two-sided).
    power
        Chance that a bad one is.

    Returns
    -------
    4.13 for Baarda's choice, the default.

    Raises
    ------
    InputError
        Unless 0 < significance < power < 1.
    """
    return math.sqrt(lambda0(significance, power))


def minimal_detectable_error(sd: ArrayLike, redundancy: ArrayLike, delta0: float | None = None) -> Floats:
    """Return the smallest gross errors that the test of standardized residuals finds.

    Parameters
    ----------
    sd
        Standard deviations of observations (a priori), any shape.
    redundancy
        Their redundancy numbers, of the same shape.
    delta0
        Noncentrality; that of Baarda's choice when None.

    Returns
    -------
    In the unit of sd: infinite without redundancy, NaN for what is no observation (sd infinite or zero).
    """
    sd, r = np.broadcast_arrays(np.asarray(sd, dtype=np.float64), np.asarray(redundancy, dtype=np.float64))
    observed = np.isfinite(sd) & (sd > 0)
    errors = _shift(delta0) * np.where(observed, sd, math.nan)
    with np.errstate(divide="ignore"):
        return np.asarray(errors / np.sqrt(_without_rounding(r)))


def largest_effect(redundancy: ArrayLike, delta0: float | None = None) -> Floats:
    """Return the external reliability: how far minimal detectable errors move unknowns when they stay in.

    Parameters
    ----------
    redundancy
        Redundancy numbers, any shape.
    delta0
        Noncentrality; that of Baarda's choice when None.

    Returns
    -------
    Bounds in standard deviations of whatever is computed from the unknowns; infinite without redundancy.
    """
    r = _without_rounding(np.asarray(redundancy, dtype=np.float64))
    with np.errstate(divide="ignore"):
        return np.asarray(_shift(delta0) * np.sqrt((1 - r) / r))


def _without_rounding(redundancy: Floats) -> Floats:
    return np.where(redundancy < ROUNDING, 0.0, np.minimum(redundancy, 1.0))


def _shift(delta0: float | None) -> float:
    return noncentrality() if delta0 is None else delta0
