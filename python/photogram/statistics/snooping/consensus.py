"""Where errors are so large that the adjustment runs off: a new start from what most observations agree on.

Images under exchanged names are off by thousands of standard deviations. The adjustment of a block with them
bends or diverges, and every test of it, robust or not, is of the bent block. Resections and intersections by
consensus are not moved by a minority, however large its errors are.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from photogram.arguments.types import Indices
from photogram.messages import counted
from photogram.statistics.snooping.log import Removal
from photogram.statistics.snooping.robust_start import ENOUGH, robust_factor, values
from photogram.statistics.snooping.suspects import Aside, LostSupportError, Out, Standing, Tests, Trial
from photogram.statistics.snooping.taking_out import Settings, TakingOut, log_probability
from photogram.statistics.snooping.whole_photos import log_photo, take_photo

BENT = 10.0
"""Standard deviations; a median of all test values beyond it is of a bent network, or of absurd weights."""


def _runs_off(work: TakingOut) -> bool:
    """Whether the adjustment does not converge, or leaves residuals that no standard deviation explains."""
    if work.standing.status != "converged":
        return True
    everything = values(work, np.ones(len(work.suspects), dtype=bool))
    return len(everything) >= ENOUGH and robust_factor(everything) > BENT


def begun(trial: Trial, settings: Settings, afresh: Callable[[], Aside | None] | None) -> TakingOut:
    """Adjust a network for the first time, from a consensus where its adjustment runs off.

    An image whose point has other rays is tested against its prediction. Where no two are left, the point is
    aside with all of them, and each is tested as if it were in, so that both of two rays are named.

    Parameters
    ----------
    afresh
        Finds the consensus, and starts the trial at it; None where there is none, or nothing against it.

    Raises
    ------
    LostSupportError
        The network is not determined, or runs off and there is no consensus.
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
    """Return what is out with what a consensus does without, and points with too few rays then."""
    suspects = trial.suspects
    out = Out(np.zeros(int(suspects.row_starts[-1]), dtype=bool))
    groups = list(aside.images)
    for photo in sorted(aside.photos):
        out.photos.add(photo)
        groups += suspects.on_photo(photo).tolist()
    _put_aside(trial, out, groups)
    return out


def _decide(work: TakingOut, aside: Aside, before: Standing | None) -> None:
    """Test what a consensus does without against the rest; what agrees takes part.

    `before`: how everything together stood; None where it could not be adjusted.
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
    removed = work.apply(entries, []) if entries else []
    if not removed:
        work.adjust(whole)
    if _runs_off(work):
        removed += _still_out(work, points, images, tests)
    for photo, said in aside.photos.items():
        removed.append(log_photo(work, photo, 0, before, (said, *consequences[photo])))
    parts = [counted(len(images), "image")] if len(images) else []
    parts += [work.suspects.photo_name(photo) for photo in aside.photos]
    why = "runs off" if before is not None else "leads nowhere (before: without what follows)"
    said = f"; {agreeing} of the images agree with it" if agreeing else ""
    work.remarks.append(
        f"the adjustment of everything {why}: it was started anew from {aside.found_by}, without"
        f" {' and '.join(parts)}; tests against the rest decided about them{said}"
    )
    work.note_round(0, first, removed, [])


def _still_out(work: TakingOut, points: list[int], images: Indices, tests: Tests) -> list[int]:
    """Take out again what tests against the rest have let in, and with which the adjustment runs off.

    Two rays that part before the cameras agree with any photos in a linear model, for they meet behind them.
    """
    suspects = work.suspects
    back = [group for group in images.tolist() if not work.out.rows[suspects.rows(group)].any()]
    one_of_each = {int(suspects.points[group]): group for group in reversed(back)}
    entries = [
        work.as_it_was(group, tests).with_(consequences=("its rays do not meet",))
        for point, group in sorted(one_of_each.items())
        if point in points
    ]
    return work.apply(entries, []) if entries else []


def _put_aside(trial: Trial, out: Out, groups: list[int]) -> list[int]:
    """Put groups out; return the points that have too few rays without them: they are out with all."""
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
    """Return entries of images that contradict what the rest predicts, and how many agree with it."""
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
