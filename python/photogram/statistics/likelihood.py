"""Which of several mistakes explains the residuals: a likelihood ratio against the data as given.

A hypothesis h changes the data; the model is fitted anew and leaves a weighted sum of squares Omega_h with f
degrees of freedom. With an unknown unit weight the logarithm of the likelihood ratio, twice, is

    Lambda = f ln(Omega_0 / Omega_h)

A mistake is made out by trying it and improving much: Omega_h passes its global test or is 25 times smaller
than Omega_0, Lambda exceeds 2 ln(n / 1e-4) for n hypotheses tried, and the next best is behind by 10.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from photogram.statistics.limits import global_test

__all__ = ["CHANCE", "IMPROVEMENT", "RIVAL", "TESTED", "Judged", "judged", "likelihood"]

IMPROVEMENT = 25.0
"""The sum of squares must fall by this factor, residuals to a fifth."""
CHANCE = 1e-4
"""Probability that any of the hypotheses tried is accepted by chance, about."""
RIVAL = 10.0
"""And all others must be less likely by this difference of Lambda."""
TESTED = 4.0
"""Degrees of freedom from which a hypothesis can be accepted and not only be possible."""


@dataclass(frozen=True)
class Judged:
    """The hypotheses that explain the residuals best.

    Attributes
    ----------
    best
        Their places among those tried, the best first; more than one where these cannot be told apart.
    likelihood
        Lambda of the first.
    fall
        How many times smaller residuals would be.
    accepted
        Whether it can be taken for sure; else it is possible.
    """

    best: tuple[int, ...]
    likelihood: float
    fall: float
    accepted: bool


def likelihood(given: float, changed: float, degrees_of_freedom: float) -> float:
    """Return Lambda of a hypothesis that leaves `changed` in place of `given`."""
    return degrees_of_freedom * math.log(given / changed)


def judged(
    given: float, changed: Sequence[float], degrees_of_freedom: float, *, known_weight: bool = False
) -> Judged | None:
    """Judge hypotheses by the sums of squares that they leave.

    Parameters
    ----------
    given
        Omega of the data as given, positive.
    changed
        Omega of each hypothesis, positive; infinite where it cannot be fitted.
    degrees_of_freedom
        f.
    known_weight
        Whether Omega has the unit weight of given standard deviations, so that it can pass its global test.

    Returns
    -------
    None where no hypothesis improves as much as a mistake would.
    """
    order = sorted(range(len(changed)), key=lambda each: changed[each])
    if not order or not changed[order[0]] < given:
        return None
    least = changed[order[0]]
    test = global_test(least, degrees_of_freedom) if known_weight else None
    passes = test is not None and not test.rejected_high
    bound = 2 * math.log(len(changed) / CHANCE)
    ratio = likelihood(given, least, degrees_of_freedom)
    if not (given > IMPROVEMENT * least or (passes and given - least > bound)):
        return None
    equal = [each for each in order if likelihood(changed[each], least, degrees_of_freedom) <= RIVAL]
    sure = degrees_of_freedom >= TESTED and ratio > bound and len(equal) == 1
    return Judged(tuple(equal), ratio, math.sqrt(given / least), sure)
