"""Factors of the standard deviations of each type of observation, from one adjustment.

The sum of squares q of a type has nearly the expectation theta r, with r the sum of its redundancy numbers.
Its variance is at most that of theta times chi-square of r degrees of freedom, which gives the intervals.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.results.tests import Tests
from photogram.statistics.distributions import critical_chi_square
from photogram.statistics.findings import GroupFactor

LEVEL = 0.05  # of the intervals
LEAST = 1.0  # Smallest redundancy of a type whose standard deviations are tested


def type_factors(tests: Tests) -> list[GroupFactor]:
    """Return the factors of all types with observations; without redundancy the interval is unbounded."""
    found = []
    for each in tests.normal:
        for kind, components in each.groups.items():
            observed = each.observed[:, components]
            if not observed.any():
                continue
            sd = each.sd[:, components][observed]
            q = float(np.sum((each.residuals[:, components][observed] / sd) ** 2))
            r = float(np.nansum(each.redundancy[:, components][observed]))
            tested = r >= LEAST
            ends = [critical_chi_square(level, r) for level in (LEVEL / 2, 1 - LEVEL / 2)] if tested else []
            found.append(
                GroupFactor(
                    group=kind,
                    factor=math.sqrt(q / r) if tested else math.nan,
                    interval=(math.sqrt(q / ends[0]), math.sqrt(q / ends[1])) if tested else (0.0, math.inf),
                    significant=False,
                    sd=float(sd[0]) if np.ptp(sd) <= 1e-9 * sd[0] else math.nan,
                )
            )
    return found
