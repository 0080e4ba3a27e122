"""Reliability: detectable gross errors, and effects of others (Baarda 1968).

An observation with the standard deviation sd and the redundancy number r has a standardized residual w = v /
(sd sqrt(r)), which is standard normal. A gross error e shifts its expectation by e sqrt(r) / sd. The *minimal
detectable error* shifts it by delta0, so that the test |w| > critical value finds it with the chosen power:

    e0 = delta0 sd / sqrt(r)

If it is not removed, no unknown, nor any function of the unknowns, changes by more than this multiple of its
standard deviation (external reliability):

    delta0 sqrt((1 - r) / r)

Both refer to the a priori unit weight. They do not need measurements and are available for planned networks.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.statistics.distributions import lambda0

TESTABLE = 0.01
"""Least redundancy number of a testable observation.

With less redundancy, the unknowns absorb a gross error, and the test value repeats the one of another
observation."""

ROUNDING = 1e-10  # Redundancy numbers below this are rounding errors of zero


def standardized(residuals: Floats, sd: Floats, redundancy: Floats) -> Floats:
    """Return residuals over their sd with a priori unit weight (Baarda's w).

    NaN if sd is infinite or zero, or if redundancy is rounding only.
    """
    tested = np.isfinite(sd) & (sd > 0) & (redundancy > ROUNDING)
    values = np.full(residuals.shape, np.nan)
    values[tested] = residuals[tested] / (sd[tested] * np.sqrt(redundancy[tested]))
    return values


def noncentrality(significance: float = 0.001, power: float = 0.80) -> float:
    """Return delta0, the shift of a standardized residual by a detectable gross error.

    Parameters
    ----------
    significance
        Probability that a good observation is rejected (two-sided).
    power
        Probability that a wrong observation is rejected.

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
        Noncentrality; Baarda's choice if None.

    Returns
    -------
    In the unit of sd; infinite without redundancy, NaN if sd is infinite or zero.
    """
    sd, r = np.broadcast_arrays(np.asarray(sd, dtype=np.float64), np.asarray(redundancy, dtype=np.float64))
    observed = np.isfinite(sd) & (sd > 0)
    errors = _shift(delta0) * np.where(observed, sd, math.nan)
    with np.errstate(divide="ignore"):
        return np.asarray(errors / np.sqrt(_without_rounding(r)))


def largest_effect(redundancy: ArrayLike, delta0: float | None = None) -> Floats:
    """Return external reliability: bounds of effects of undetected errors.

    Parameters
    ----------
    redundancy
        Redundancy numbers, any shape.
    delta0
        Noncentrality; Baarda's choice if None.

    Returns
    -------
    Bounds in standard deviations of any function of the unknowns; infinite without redundancy.
    """
    r = _without_rounding(np.asarray(redundancy, dtype=np.float64))
    with np.errstate(divide="ignore"):
        return np.asarray(_shift(delta0) * np.sqrt((1 - r) / r))


def _without_rounding(redundancy: Floats) -> Floats:
    return np.where(redundancy < ROUNDING, 0.0, np.minimum(redundancy, 1.0))


def _shift(delta0: float | None) -> float:
    return noncentrality() if delta0 is None else delta0
