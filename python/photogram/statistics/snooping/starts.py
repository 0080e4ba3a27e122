"""The start of data snooping with many gross errors or divergence.

With many gross errors, robust factors of standard deviations and a robust adjustment are used.

With huge errors, a consensus of most observations is used. Observations under exchanged names are off by
thousands of standard deviations. The adjustment of such a block is distorted or diverges, and so are all its
tests, robust or not. A minority does not affect resections and intersections by consensus, for any size of
its errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.snooping.conditioning import Chosen
from photogram.statistics.snooping.log import Removal
from photogram.statistics.snooping.suspects import Aside, LostSupportError, Out, Standing, Tests, Trial
from photogram.statistics.snooping.taking_out import Settings, TakingOut, log_probability, take_back
from photogram.statistics.snooping.whole_photos import log_photo, take_photo
from photogram.words import Phrase, phrase

MEDIAN = 0.6744897501960817  # Median of the absolute value of a standard normal variable
MEDIAN_OF_TWO = 1.1774100225154747  # Median of the length of a vector of two of them
OPTIMISTIC = 2.0  # Factor of standard deviations above which the median indicates a common scaling
ENOUGH = 20  # Smallest number of test values for a median


def scales(work: TakingOut) -> tuple[dict[str, float], Floats]:
    """Return robust factors k by type for small standard deviations, and k^2 by group."""
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
    named = [phrase("snooping.factor", kind=name, factor=factor) for name, factor in factors.items()]
    work.remarks.append(phrase("snooping.factors", overall=overall, factors=named))
    return factors, squares


def values(work: TakingOut, groups: Bools) -> Floats:
    """Return |w| of all testable rows of some groups."""
    rows = np.repeat(groups, np.diff(work.suspects.row_starts))
    with np.errstate(invalid="ignore", divide="ignore"):
        w = np.abs(work.tests.residual) / np.sqrt(work.tests.redundancy)
        return np.asarray(w[rows & (work.tests.redundancy > TESTABLE) & np.isfinite(w)])


def robust_factor(values: Floats) -> float:
    """Return the robust standard deviation of test values from their absolute values."""
    return float(np.median(values)) / MEDIAN if values.size else 1.0


MANY = 0.05  # Share of image observations beyond `FAR` that requires a robust start
FAR = 5.0
CANDIDATE = 4.4
"""Robust standard deviations of a residual above which Cauchy's loss reduces its weight to a quarter."""
SCALES = 5  # Largest number of robust adjustments


def needs_robust_start(work: TakingOut) -> bool:
    """Whether too many observations disagree for single tests, or adjustment fails."""
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
    """Exclude points with tiny robust weights, and test them against others.

    A robust adjustment reveals an erroneous point, but not its erroneous ray. Both of two rays lose their
    weight, and often a good one near a large error does.
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
        phrase("snooping.robust"),
    )


def start_without(
    work: TakingOut, candidates: Indices, first: Tests, standing: Standing, start: Phrase
) -> None:
    """Exclude the points of some groups, and decide by tests against all others."""
    suspects, out = work.suspects, work.out
    points = np.unique(suspects.points[candidates])
    points = points[points >= 0]
    choices, judged = _on_points_aside(work, points.tolist(), candidates, first)
    others = candidates[~np.isin(suspects.points[candidates], sorted(judged))]
    entries = [work.as_it_was(group, first) for group in others.tolist()]
    entries += work.entries(choices, 0)
    work.out = out
    removed = work.apply(entries)
    if not removed:
        work.adjust(work.out)
    if not work.factors:
        work.factors, work.scales = scales(work)
    work.remarks.append(phrase("snooping.aside", start=start, n=len(points)))
    returned = take_back(work, 0)
    work.note_round(0, standing, removed, returned)


def _robust_sizes(work: TakingOut) -> tuple[Floats, float] | None:
    """Return robust residual sizes, and the factor of their standard deviations.

    None if no robust adjustment converges. Many gross errors increase the median of all residuals. So the
    factor is estimated again from robust residuals, until it is stable.
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
) -> tuple[list[Chosen], set[int]]:
    """Adjust without some points and candidates; select on them; return tested points."""
    out = work.out.copy()
    out.points |= set(points)
    aside = np.isin(work.suspects.points, points)
    aside[candidates] = True
    out.rows[np.repeat(aside, np.diff(work.suspects.row_starts))] = True
    try:
        work.adjust(out)
    except LostSupportError:
        # Photos are not determined without them: groups without weight are removed, and tested separately.
        return [], set()
    work.factors, work.scales = scales(work)
    choosing = work.choosing(np.asarray(work.suspects.removable), 0, ahead=False)
    return replace(choosing, tests=first).on_gone_points(points)


BENT = 10.0  # Median of test values of a distorted network (sd)


def _runs_off(work: TakingOut) -> bool:
    """Whether the adjustment diverges, or residuals exceed plausible sizes."""
    if work.standing.status != "converged":
        return True
    everything = values(work, np.ones(len(work.suspects), dtype=bool))
    return len(everything) >= ENOUGH and robust_factor(everything) > BENT


def begun(trial: Trial, settings: Settings, afresh: Callable[[], Aside | None] | None) -> TakingOut:
    """Adjust a network first; start from a consensus if it diverges.

    An observation of a point with other rays is tested against its prediction. If fewer than two other rays
    remain, the point is excluded, and each observation is tested as if it were included. So both of two rays
    are reported.
    """
    start = None if settings.robust is False else afresh
    try:
        work = TakingOut(trial, settings)
    except LostSupportError:
        aside = None if start is None else start()
        if aside is None:
            raise
        work = TakingOut(trial, settings, _without(trial, aside))
        _decide(work, aside, None)
    else:
        aside = start() if start is not None and _runs_off(work) else None
        if aside is not None:
            _decide(work, aside, work.standing)
    return work


def _without(trial: Trial, aside: Aside) -> Out:
    """Return the exclusions by a consensus, and points with too few remaining rays."""
    suspects = trial.suspects
    out = Out(np.zeros(int(suspects.row_starts[-1]), dtype=bool))
    groups = list(aside.images)
    for photo in sorted(aside.photos):
        out.photos.add(photo)
        groups += suspects.on_photo(photo).tolist()
    _put_aside(trial, out, groups)
    return out


def _decide(work: TakingOut, aside: Aside, before: Standing | None) -> None:
    """Test the exclusions of a consensus against the rest, and include agreeing ones.

    `before` is the adjustment of all observations; None if it failed.
    """
    first, tests, start = work.standing, work.tests, work.out
    out, consequences = Out(np.zeros_like(start.rows)), {}
    for photo in sorted(aside.photos):
        consequences[photo] = take_photo(work, out, photo)
    whole = out.copy()
    starts = work.suspects.row_starts
    images = np.array([group for group in aside.images if not out.rows[starts[group]]], dtype=np.int64)
    points = _put_aside(work.trial, out, images.tolist())
    try:
        work.adjust(out)
    except LostSupportError:
        work.adjust(start)
        return
    predicted, agreeing = _predicted(work, images[~np.isin(work.suspects.points[images], points)])
    choosing = replace(work.choosing(work.suspects.removable, 0, ahead=False), tests=tests)
    choices, _ = choosing.on_gone_points(points)
    work.out = whole
    entries = predicted + work.entries(choices, 0)
    removed = work.apply(entries) if entries else []
    if not removed:
        work.adjust(whole)
    if _runs_off(work):
        removed += _still_out(work, points, images, tests)
    for photo, reason in aside.photos.items():
        removed.append(log_photo(work, photo, 0, before, (reason, *consequences[photo])))
    parts = [phrase("snooping.images", n=len(images))] if len(images) else []
    parts += [work.suspects.photo_name(photo) for photo in aside.photos]
    fields = {"start": aside.found_by, "parts": parts, "n": agreeing}
    work.remarks.append(Phrase(f"snooping.{'bent' if before is not None else 'undetermined'}", fields))
    work.note_round(0, first, removed, [])


def _still_out(work: TakingOut, points: list[int], images: Indices, tests: Tests) -> list[int]:
    """Exclude again the included observations with which the adjustment diverges.

    Two rays that diverge in front of the cameras agree with any photos in a linear model, because they
    intersect behind them.
    """
    suspects = work.suspects
    back = [group for group in images.tolist() if not work.out.rows[suspects.rows(group)].any()]
    one_of_each = {int(suspects.points[group]): group for group in reversed(back)}
    entries = [
        work.as_it_was(group, tests).with_(consequences=(phrase("snooping.rays-part"),))
        for point, group in sorted(one_of_each.items())
        if point in points
    ]
    return work.apply(entries) if entries else []


def _put_aside(trial: Trial, out: Out, groups: list[int]) -> list[int]:
    """Exclude groups; return points with too few rays, which are excluded too."""
    suspects = trial.suspects
    for group in groups:
        out.rows[suspects.rows(group)] = True
    points: set[int] = set()
    for group in groups:
        points |= trial.consequences(out, group)[0]
    for point in points:
        out.points.add(point)
        for group in suspects.on_point(point).tolist():
            out.rows[suspects.rows(group)] = True
    return sorted(points)


def _predicted(work: TakingOut, groups: Indices) -> tuple[list[Removal], int]:
    """Return contradicting predicted observations, and the number of agreeing ones."""
    level = work.level.limit(0)
    standing = work.standing
    variance = standing.weighted_sum_of_squares / max(standing.degrees_of_freedom, 1)
    entries = []
    for group, own in zip(groups.tolist(), work.trial.predictions(groups.tolist()), strict=True):
        if own is None:
            continue
        rows = np.array(own.rows)
        log_p = log_probability(work, np.array([own.statistic]), np.array([len(rows)]), np.array([group]))
        if log_p[0] < math.log(level):
            entries.append(
                work.entry(
                    group,
                    rows,
                    0,
                    first_statistic=own.statistic,
                    statistic=own.statistic,
                    dimension=len(rows),
                    fisher=own.statistic / len(rows) / variance if variance > 0 else math.nan,
                    log_probability=float(log_p[0]),
                    error=np.array(own.error),
                    error_sd=np.array(own.error_sd),
                    limit=level,
                )
            )
    return entries, len(groups) - len(entries)
