"""Variances as functions of a quantity, such as distance from the centre.

Within a group the variance is sd^2 theta_i with theta_i = x_i^T beta and x_i = (1, u_i, ...). u_i is the
square of the radius over the largest: sigma^2 = a^2 + b^2 r^2. Let ~v be the residuals in standard deviations
and r_i the redundancy numbers of an adjustment with the current theta. ~v_i^2 is regressed on r_i x_i /
theta_i with the weights 1 / r_i and nonnegative beta. Then the network is adjusted again, until beta
converges. The fixed point solves

    sum_i (~v_i^2 - r_i) x_i / theta_i = 0,

the derivative of the restricted likelihood. Its information is 1/2 sum_ij R_ij^2 x_i x_j^T over theta_i
theta_j. The first regression alone is strongly biased, because neighbours share their errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass

LEAST = 1e-6  # Smallest redundancy number of a coordinate that is used
CLOSE = 0.01  # Largest change of a coefficient in the last step, in standard deviations


class Residuals(Protocol):
    """Result of an adjustment for k observations with given variances."""

    squares: Floats  # (k,) squares of residuals in standard deviations
    redundancy: Floats  # (k,) redundancy numbers

    def information(self, terms: Floats) -> Floats:
        """Return (t, t) sums of R_ij^2 c_i c_j^T over the (k, t) nonnegative terms c."""


@dataclass(frozen=True, eq=False)
class FunctionEstimate:
    # coefficients, sd: (t,) of the terms, in the given variances, with their standard deviations
    coefficients: Floats
    sd: Floats
    covariance: Floats  # (t, t)
    first: Floats  # (t,) coefficients of the first regression, which are biased
    factors: Floats  # (k,) theta of every observation
    converged: bool  # Whether the fixed point was reached
    steps: int  # number of adjustments


def nonnegative(normal: Floats, right: Floats) -> Floats:
    """Solve small normal equations with nonnegative unknowns (least squares)."""
    count = len(right)
    best, lowest = np.zeros(count), math.inf
    for chosen in range(1, 1 << count):
        rows = np.array([k for k in range(count) if chosen >> k & 1])
        found = np.linalg.lstsq(normal[np.ix_(rows, rows)], right[rows], rcond=None)[0]
        value = float(-right[rows] @ found)
        if (found >= 0).all() and value < lowest:
            best, lowest = np.zeros(count), value
            best[rows] = found
    return best


def estimate_function(
    adjust: Callable[[Floats], Residuals], terms: Floats, *, max_steps: int = 30
) -> FunctionEstimate:
    factors = np.ones(len(terms))
    state = adjust(factors)
    beta: Floats = np.zeros(terms.shape[1])
    first, converged, step = beta, False, 0
    while not converged and step < max_steps:
        step += 1
        r = state.redundancy
        used = np.isfinite(state.squares) & (r > LEAST)
        c = terms[used] / factors[used, np.newaxis]
        normal = (c * r[used, np.newaxis]).T @ c
        scale = 1.0 / np.sqrt(np.diag(normal))
        found = scale * nonnegative(normal * np.outer(scale, scale), scale * (c.T @ state.squares[used]))
        first = first if step > 1 else found
        # Corresponds to R_ij^2 on the diagonal only: the steps end below the actual standard deviation.
        deviations = np.sqrt(2.0) * scale
        moved = np.abs(found - beta)
        beta, factors = found, terms @ found
        if not (factors > 0).all():
            factors = np.maximum(factors, 1e-4 * float(factors.max()))
        state = adjust(factors)
        converged = bool((moved < CLOSE * deviations).all())
    information = state.information(terms / factors[:, np.newaxis]) / 2
    covariance: Floats = np.asarray(np.linalg.pinv(information), dtype=np.float64)
    return FunctionEstimate(beta, np.sqrt(np.diag(covariance)), covariance, first, factors, converged, step)
