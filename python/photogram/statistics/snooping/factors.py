"""By which robust factors standard deviations are too small."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.snooping.taking_out import TakingOut

__all__ = ["ENOUGH", "MEDIAN_OF_TWO", "OPTIMISTIC", "robust_factor", "scales", "values"]

MEDIAN = 0.6744897501960817
"""Of the absolute value of a standard normal variable."""
MEDIAN_OF_TWO = 1.1774100225154747
"""Of the length of a vector of two of them."""
OPTIMISTIC = 2.0
"""Standard deviations that are too small by more than this are told from gross errors by the median."""
ENOUGH = 20
"""Test values that a median needs."""


def scales(work: TakingOut) -> tuple[dict[str, float], Floats]:
    """Return robust factors k by kind where standard deviations are too optimistic, and k^2 by group."""
    suspects, tests = work.suspects, work.tests
    squares = np.ones(len(suspects))
    if not work.settings.known:
        return {}, squares
    everything = values(work, np.ones(len(suspects), dtype=bool))
    overall = robust_factor(everything)
    if len(everything) < ENOUGH or not overall > OPTIMISTIC:
        return {}, squares
    factors = {}
    for kind, name in enumerate(suspects.kind_names):
        own = np.asarray(suspects.kinds == kind)
        if not (own & tests.active).any():
            continue
        sizes = values(work, own)
        factor = max(robust_factor(sizes) if len(sizes) >= ENOUGH else overall, 1.0)
        factors[name] = factor
        squares[own] = factor**2
    named = ", ".join(f"{name} {factor:.3g}" for name, factor in factors.items())
    work.remarks.append(
        "standard deviations are too small by about the robust factor"
        f" {overall:.3g} (median of the test values): tested with them times {named}"
    )
    return factors, squares


def values(work: TakingOut, groups: Bools) -> Floats:
    """Return |w| of all rows of some groups that are testable."""
    rows = np.repeat(groups, np.diff(work.suspects.row_starts))
    with np.errstate(invalid="ignore", divide="ignore"):
        w = np.abs(work.tests.residual) / np.sqrt(work.tests.redundancy)
        return np.asarray(w[rows & (work.tests.redundancy > TESTABLE) & np.isfinite(w)])


def robust_factor(values: Floats) -> float:
    """Return the robust standard deviation of test values whose sizes are given."""
    return float(np.median(values)) / MEDIAN if values.size else 1.0
