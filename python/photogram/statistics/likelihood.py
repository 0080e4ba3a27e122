"""Selection among possible mistakes by a likelihood ratio against the given data.

A hypothesis h changes the data. The adjustment of the changed data results in a weighted sum of squares
Omega_h with f degrees of freedom. With an unknown unit weight, twice the logarithm of the likelihood ratio is

    Lambda = f ln(Omega_0 / Omega_h)

A mistake is accepted if it improves the fit sufficiently. Omega_h must pass its global test or be 25 times
smaller than Omega_0. Lambda must exceed 2 ln(n / 1e-4) for n hypotheses, and the next best by 10. An
additional parameter costs ln f.

With chi-square of two named objects, and with their names exchanged, in a variance s^2 of unit weight, names
are exchanged if

    named - exchanged > 2 s^2 ln(k / 0.0001),    exchanged < u s^2 chi2(0.999; m)

for k examined pairs and m degrees of freedom. u is the uncertainty of the compared values beyond their
covariances.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import critical_chi_square
from photogram.statistics.limits import global_test

IMPROVEMENT = 25.0  # Required ratio of the sums of squares
CHANCE = 1e-4  # Probability of an accepted wrong hypothesis, approximately
RIVAL = 10.0  # Required difference of Lambda to all other hypotheses
PASSES = 0.01  # Significance level of the global test of a hypothesis
EXCHANGE_LEVEL = 0.001  # Significance level of exchanged names
TESTED = 4.0  # Smallest degrees of freedom of an accepted hypothesis


@dataclass(frozen=True)
class Judged:
    # Indices of the accepted hypotheses, best first; several if inseparable
    best: tuple[int, ...]
    likelihood: float  # lambda of the first
    fall: float  # factor by which residuals would be smaller
    explained: bool  # certain; otherwise possible

    @property
    def accepted(self) -> bool:
        """Whether the first is accepted: it explains the residuals, and no other does."""
        return self.explained and len(self.best) == 1


def likelihood(given: float, changed: float, degrees_of_freedom: float) -> float:
    """Return Lambda of a hypothesis that changes Omega from `given` to `changed`."""
    least = sys.float_info.min
    return degrees_of_freedom * (math.log(max(given, least)) - math.log(max(changed, least)))


def judged(
    given: float,
    changed: Sequence[float],
    degrees_of_freedom: float,
    *,
    parameters: Sequence[int] | None = None,
    known_weight: bool = False,
) -> Judged | None:
    """Assess hypotheses by their sums of squares.

    Parameters
    ----------
    given
        Omega of the given data, positive.
    changed
        Omega of each hypothesis, positive; infinite if it cannot be fitted.
    degrees_of_freedom
        f.
    parameters
        Numbers of additional parameters of each hypothesis; one more must gain ln f. Default: zero.
    known_weight
        True if Omega refers to given standard deviations, so that the global test is possible.

    Returns
    -------
    None if no hypothesis improves as much as a mistake would.
    """
    f = degrees_of_freedom
    counts = [0] * len(changed) if parameters is None else parameters
    ratios = [
        likelihood(given, omega, f) - count * math.log(max(f, 1.0)) if math.isfinite(omega) else -math.inf
        for omega, count in zip(changed, counts, strict=True)
    ]
    order = sorted(range(len(changed)), key=lambda each: -ratios[each])
    if not order or not changed[order[0]] < given:
        return None
    first = order[0]
    least = changed[first]
    test = global_test(least, f, PASSES) if known_weight else None
    bound = 2 * math.log(len(changed) / CHANCE)
    passes = test is not None and not test.rejected_high and given - least > bound
    if not (given > IMPROVEMENT * least or passes):
        return None
    equal = tuple(each for each in order if ratios[first] - ratios[each] <= RIVAL)
    fall = math.sqrt(given / max(least, sys.float_info.min))
    return Judged(equal, ratios[first], fall, f >= TESTED and ratios[first] > bound)


def are_exchanged(
    named: float,
    exchanged: float,
    dimension: int,
    *,
    pairs: int,
    variance: float = 1.0,
    uncertain: float = 1.0,
) -> bool:
    """Test whether two objects are exchanged; `uncertain` is u, `pairs` is k."""
    if not (math.isfinite(exchanged) and dimension > 0):
        return False
    fits = exchanged < uncertain * variance * critical_chi_square(EXCHANGE_LEVEL, dimension)
    return fits and named - exchanged > 2 * variance * math.log(pairs / CHANCE)
