"""The adjustment of a check: without what was found wrong before, and without what snooping takes out.

Control points that have each other's coordinates are exchanged back before the others are judged.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from photogram.arguments.types import Bools, Indices
from photogram.diagnosis.adjusting import Adjuster
from photogram.diagnosis.blunders import (
    SURE,
    Blunders,
    blunder_section,
    blunders,
    control_finding,
    list_largest,
    tests,
)
from photogram.diagnosis.findings import Finding, Level, Section
from photogram.diagnosis.gross import Suspects
from photogram.diagnosis.predictions import (
    exchange,
    exchanged_pair,
    exchanged_where_rays_meet,
    freed,
    tests_of_predictions,
)
from photogram.diagnosis.robust import critical, mad_sd
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.block import Block
from photogram.network.subset import kept_images, of_photos
from photogram.results.result import Result

HOPELESS = 5.0
"""Spread of the test values above which photos that did not fit before the adjustment are left out.

Nor is what such an adjustment says held against what was found before."""
EXCHANGES = 5
"""Pairs of control points that are exchanged back, at the most."""


@dataclass
class Edited:
    """The adjustment and what was taken out of it.

    Attributes
    ----------
    first, last
        The first and the last adjustment; None where it cannot be done.
    reason
        Why it cannot.
    spread
        Robust standard deviation of the last test values: 1 when the weights are right.
    section
        The blunder list.
    control
        Findings on control, by point: which components were taken out.
    exchanged
        Pairs of control points that had each other's coordinates.
    cleared
        Control points that were left out as suspects and agree with their predictions.
    asked
        Whether an adjustment was wanted.
    """

    first: Result | None
    last: Result | None
    reason: str
    spread: float
    section: Section
    control: dict[str, list[Finding]] = field(default_factory=dict)
    exchanged: list[tuple[str, str]] = field(default_factory=list)
    cleared: list[str] = field(default_factory=list)
    asked: bool = True


def edit(block: Block, suspects: Suspects, adjusted: Adjuster) -> Edited:
    """Adjust a block and take out what does not fit.

    Control points that agree with each other's predictions are exchanged back, and all is done anew.

    Parameters
    ----------
    block
        The block, with its orientations right way up.
    suspects
        Gross errors known already. Images are left out from the beginning, photos when the block does not fit
        with them; control is left out until its prediction has judged it.
    adjusted
        Adjusts.
    """
    current, left = kept_images(block, ~suspects.images), np.flatnonzero(suspects.control)
    exchanged: list[tuple[str, str]] = []
    try:
        first = adjusted.tried(current) if left.size else None
        while True:
            section = blunder_section()
            start, fewer = _first(freed(current, left), suspects.photos, adjusted, section)
            first = first or start
            pair = None if start.converged or exchanged else exchanged_where_rays_meet(current)
            if pair is None or not adjusted(exchange(current, *pair)).converged:
                last, taken = _snooped(start, fewer, adjusted)
                named = [block.point_ids.index(name) for name in taken.control]
                pair = _exchanged(last, current, np.union1d(left, named).astype(np.int64), adjusted)
            if pair is None or len(exchanged) == EXCHANGES:
                break
            exchanged.append((block.point_ids[pair[0]], block.point_ids[pair[1]]))
            current, left = exchange(current, *pair), np.setdiff1d(left, pair)
        control = taken.control
        if left.size and last.converged:
            last, taken, control = _held_again(last, current, left, adjusted, taken)
    except AdjustmentError as error:
        return Edited(None, None, str(error), math.nan, section)
    spread = mad_sd(last.standardized)
    section.findings += taken.findings
    list_largest(last, spread, section)
    cleared = [block.point_ids[point] for point in left if block.point_ids[point] not in control]
    return Edited(first, last, "", spread, section, control, exchanged, cleared)


def _held_again(
    result: Result, given: Block, points: Indices, adjusted: Adjuster, taken: Blunders
) -> tuple[Result, Blunders, dict[str, list[Finding]]]:
    """Hold what agrees with its prediction of the control that was left out, and report the rest."""
    spread = mad_sd(result.standardized)
    errors, tests = tests_of_predictions(result, given, points, spread)
    count = int(np.isfinite(given.point_sd).sum())
    limit, grave = critical(count), critical(count, SURE)
    point_sd = result.block.point_sd.copy()
    positions = result.block.point_positions.copy()
    control = dict(taken.control)
    for row, error, test in zip(points.tolist(), errors, np.abs(tests), strict=True):
        for axis in np.flatnonzero(test > limit).tolist():
            finding = control_finding(given, row, axis, float(error[axis]), float(test[axis]) * spread)
            level: Level = "grave" if test[axis] > grave else "look"
            control.setdefault(given.point_ids[row], []).append(replace(finding, level=level))
        fits = test <= limit
        point_sd[row, fits], positions[row, fits] = (
            given.point_sd[row, fits],
            given.point_positions[row, fits],
        )
    if (point_sd == result.block.point_sd).all():
        return result, taken, control
    held = result.block.replace(point_sd=point_sd, point_positions=positions)
    last, more = _snooped(adjusted(held), held, adjusted)
    for name, findings in more.control.items():
        control.setdefault(name, []).extend(findings)
    return last, replace(taken, findings=taken.findings + more.findings), control


def _snooped(start: Result, block: Block, adjusted: Adjuster) -> tuple[Result, Blunders]:
    """Take out what does not fit, unless all does."""
    values = tests(start)
    largest = max(float(each.max(initial=0.0)) for each in values.values())
    count = sum(int((each > 0).sum()) for each in values.values())
    if start.converged and largest <= critical(count) * mad_sd(start.standardized):
        return start, Blunders([], {})
    found = adjusted.snooped(block)
    last = cast("Result", found.result)
    return last, blunders(found, block, last)


def _exchanged(result: Result, given: Block, points: Indices, adjusted: Adjuster) -> tuple[int, int] | None:
    """Find two of some doubtful control points that are exchanged."""
    points = points[np.isfinite(given.point_sd[points]).any(axis=1) & result.used_points[points]]
    if len(points) < 2 or not result.converged:
        return None
    without = adjusted.converged(freed(result.block, points))
    if without is None:
        return None
    return exchanged_pair(without, given, points, mad_sd(without.standardized))


def _first(block: Block, bad: Bools, adjusted: Adjuster, section: Section) -> tuple[Result, Block]:
    """Adjust with all photos, or without those bad ones with which the block does not fit."""
    error = None
    if not bad.any():
        return adjusted(block), block
    try:
        result = adjusted(block)
        if result.converged and mad_sd(result.standardized) < HOPELESS:
            photos = np.flatnonzero(bad)
            own = [mad_sd(result.standardized[block.image_photos == photo]) for photo in photos]
            bad = np.zeros_like(bad)
            bad[photos[[not size < HOPELESS for size in own]]] = True
            if not bad.any():
                return result, block
    except AdjustmentError as caught:
        error = caught
    fewer = of_photos(block, ~bad)
    names = [name for name, of in zip(block.photo_ids, bad.tolist(), strict=True) if of]
    section.parts.append(f"adjusted without the photos that do not fit: {', '.join(names)}")
    if error is not None:
        section.parts.append(f"with them: {error}")
    return adjusted(fewer), fewer
