"""Where many observations are wrong: robust factors of standard deviations, and a robust adjustment."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.snooping.choosing import Choice
from photogram.statistics.snooping.suspects import LostSupportError, Standing, Tests
from photogram.statistics.snooping.taking_out import TakingOut, take_back

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


MANY = 0.05
"""Share of the images beyond `FAR` robust standard deviations from which on a robust start is needed."""
FAR = 5.0
CANDIDATE = 4.4
"""Robust standard deviations from which on a residual is put aside: Cauchy's loss leaves it a quarter of its
weight."""
SCALES = 5
"""Robust adjustments at the most until their scale stands."""


def needs_robust_start(work: TakingOut) -> bool:
    """Whether more disagrees than tests of single groups can sort out, or nothing converges."""
    if work.settings.robust is not None:
        return work.settings.robust
    if work.standing.status != "converged":
        return True
    everything = values(work, np.ones(len(work.suspects), dtype=bool))
    if len(everything) < ENOUGH:
        return False
    factor = max(robust_factor(everything), 1.0)
    images = values(work, np.asarray(work.suspects.kinds == 0))
    many = bool(images.size) and float(np.mean(images > FAR * factor)) > MANY
    return many or (work.settings.known and factor > OPTIMISTIC)


def start_robustly(work: TakingOut) -> None:
    """Put points aside where robust weights nearly vanish, and test them against all others.

    A robust adjustment tells that something is wrong with a point, but not which of its rays it is: of
    two rays both lose their weight, and a good one beside a large error often does.
    """
    suspects = work.suspects
    try:
        robust = _robust_sizes(work)
    except LostSupportError:
        robust = None
    if robust is None:
        work.factors, work.scales = scales(work)
        return
    sizes, scale = robust
    candidates = np.flatnonzero((sizes > CANDIDATE * scale) & suspects.removable & work.tests.active)
    start_without(
        work,
        candidates,
        work.tests,
        work.standing,
        "many observations disagree: a robust adjustment (Huber, then Cauchy)",
    )


def start_without(work: TakingOut, candidates: Indices, first: Tests, standing: Standing, what: str) -> None:
    """Put the points of some groups aside, and let tests against all others decide about them.

    Parameters
    ----------
    candidates
        The groups.
    first, standing
        Tests, and how the network stood, with everything in it.
    what
        Names them.
    """
    suspects, start = work.suspects, work.out
    points = np.unique(suspects.points[candidates])
    points = points[points >= 0]
    choices, judged = _on_points_aside(work, points.tolist(), candidates, first)
    others = candidates[~np.isin(suspects.points[candidates], sorted(judged))]
    entries = [work.as_it_was(group, first) for group in others.tolist()]
    entries += work.entries(choices, 0)
    work.out = start
    removed = work.apply(entries, [])
    if not removed:
        work.adjust(work.out)
    if not work.factors:
        work.factors, work.scales = scales(work)
    work.remarks.append(
        f"{what} put {len(points)} points aside; tests against the photos of the others decided which of"
        " their rays stay out"
    )
    returned = take_back(work, 0)
    work.note_round(0, standing, removed, returned)


def _robust_sizes(work: TakingOut) -> tuple[Floats, float] | None:
    """Return the sizes of residuals in a robust adjustment, and the factor of its standard deviations.

    None where no robust adjustment converges.

    The median of all is lifted by many gross errors, whose effects spread: the factor is found anew from
    residuals of the robust adjustment, until it stands.
    """
    active = work.tests.active & (work.suspects.kinds == 0)
    rows = np.repeat(active, np.diff(work.suspects.row_starts))
    redundancy = float(np.mean(work.tests.redundancy[rows])) if rows.any() else 0.0
    if not redundancy > 0.0:
        return None  # nothing is tested
    expected = MEDIAN_OF_TWO * math.sqrt(redundancy)
    scale = max(robust_factor(values(work, active)), 1.0)
    sizes = work.trial.resist(scale)
    for _ in range(SCALES):
        if sizes is None:
            return None
        found = max(float(np.median(sizes[active])) / expected, 1.0)
        if found > 0.8 * scale:
            break
        scale = found
        sizes = work.trial.resist(scale)
    return None if sizes is None else (sizes, scale)


def _on_points_aside(
    work: TakingOut, points: list[int], candidates: Indices, first: Tests
) -> tuple[list[Choice], set[int]]:
    """Adjust without some points and all candidates; choose on these points; tell which were judged."""
    out = work.out.copy()
    out.points |= set(points)
    aside = np.isin(work.suspects.points, points)
    aside[candidates] = True
    out.rows[np.repeat(aside, np.diff(work.suspects.row_starts))] = True
    try:
        work.adjust(out)
    except LostSupportError:
        # Photos are not determined without them: what has lost its weight goes, and is tested alone.
        return [], set()
    work.factors, work.scales = scales(work)
    choosing = work.choosing(np.asarray(work.suspects.removable), 0, ahead=False)
    return replace(choosing, tests=first).on_gone_points(points)
