"""Whether two named things have each other's names, by what they leave as they are named and exchanged.

With chi-square of both as they are named and exchanged back, in a variance s^2 of unit weight, they are
exchanged when

    named - exchanged > 2 s^2 ln(k / 0.0001),    exchanged < u s^2 chi2(0.999; m)

for k pairs that are looked at and m degrees of freedom; u stands for what the values compared with are
uncertain by beyond their covariances.
"""

from __future__ import annotations

import math

from photogram.statistics.distributions import critical_chi_square

CHANCE = 1e-4
"""Chance that one of the pairs that are tried agrees better when exchanged, though it is not exchanged."""
LEVEL = 0.001  # Significance level of exchanged names


def are_exchanged(
    named: float,
    exchanged: float,
    dimension: int,
    *,
    pairs: int,
    variance: float = 1.0,
    uncertain: float = 1.0,
) -> bool:
    """Return whether two things are exchanged by the formula above; `uncertain` is u, `pairs` is k."""
    if not (math.isfinite(exchanged) and dimension > 0):
        return False
    fits = exchanged < uncertain * variance * critical_chi_square(LEVEL, dimension)
    return fits and named - exchanged > 2 * variance * math.log(pairs / CHANCE)
