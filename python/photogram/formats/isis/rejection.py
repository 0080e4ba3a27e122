"""Measures that jigsaw's own rule rejects: those whose residuals are long beside most others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.formats.isis.contents import PlanetaryContents, contents_of
from photogram.formats.isis.outcome import Outcome
from photogram.formats.project import Project
from photogram.messages import Message, counted
from photogram.network.block import Block
from photogram.results.result import Result

NORMAL = 1.4826
"""Standard deviations of normal errors in their median absolute deviation."""
FEWEST = 2
"""Measures of a point that stay."""
FAINT = 1e6
"""What the standard deviations of rejected measures are multiplied by, so that they have residuals all the
same, and may come back."""
MOST_ROUNDS = 30


def rejecting(project: Project, adjust: Callable[..., Result]) -> Callable[..., Result]:
    """Return a call that adjusts the block of a control network, as its settings have measures rejected.

    A block is adjusted, measures are rejected or taken in again (:func:`flagged`), and it is adjusted anew,
    until none is rejected and none comes back; then without those that are out.
    """
    contents = contents_of(project.details)
    if not contents.settings.rejects:
        return adjust

    def rejected(block: Block, **options: Any) -> Result:
        if not isinstance(block, Block):
            raise InputError("OUTLIER_REJECTION=yes needs the poses of all photos")
        return _rejected(contents, block, lambda own: adjust(own, **options))

    return rejected


def _rejected(contents: PlanetaryContents, block: Block, adjust: Callable[[Block], Result]) -> Result:
    """Return the adjusted block without rejected measures, with a remark on what they were."""
    multiplier = contents.settings.multiplier
    out = np.zeros(len(block.image_xy), dtype=bool)
    for rounds in count(1):
        result = adjust(block.replace(image_sd=block.image_sd * np.where(out, FAINT, 1.0)[:, np.newaxis]))
        if not result.converged:
            return result
        residuals = Outcome(contents, result).residuals
        lengths = np.where(result.used_images, np.hypot(*residuals.T), np.nan)
        limit = rejection_limit(lengths[~out], multiplier)
        now = flagged(lengths, out, block.image_points, limit)
        if (now == out).all():
            break
        out = now
        if rounds == MOST_ROUNDS:
            raise AdjustmentError(
                f"OUTLIER_REJECTION: after {rounds} rounds measures are still rejected and come back in turn"
            )
    kept = np.flatnonzero(~out)
    if out.any():
        result = adjust(
            block.replace(
                image_photos=block.image_photos[kept],
                image_points=block.image_points[kept],
                image_xy=block.image_xy[kept],
                image_sd=block.image_sd[kept],
            )
        )
    told = Message(
        f"OUTLIER_REJECTION: {counted(int(out.sum()), 'measure')} of {len(out):,} rejected in"
        f" {counted(rounds, 'round')}: residuals longer than their median and {multiplier:g} x {NORMAL} of"
        f" their median absolute deviations, {limit:.4g} pixels in the end; at least {FEWEST} measures of a"
        " point stay"
    )
    return replace(result, messages=[told, *result.messages])


def rejection_limit(lengths: Floats, multiplier: float) -> float:
    """Return median + multiplier x 1.4826 x median absolute deviation of (n,) lengths; NaN do not count."""
    median = float(np.nanmedian(lengths))
    return median + multiplier * NORMAL * float(np.nanmedian(np.abs(lengths - median)))


def flagged(lengths: Floats, out: Bools, points: Indices, limit: float) -> Bools:
    """Return which measures are rejected after an adjustment, as jigsaw has it.

    What is rejected stays so while it is longer than the limit; of all others of a point the longest goes, if
    it is longer and two stay. `lengths` are (m,) of residuals, NaN of measures that took no part, `out` (m,)
    which were rejected before, `points` (m,) the point of each.
    """
    long = lengths > limit
    stay = out & long
    count = int(points.max(initial=-1)) + 1
    left = np.bincount(points[np.isfinite(lengths)], minlength=count)
    left -= np.bincount(points[stay], minlength=count)
    # The last of each point, by length, is its longest.
    fresh = np.flatnonzero(long & ~out)
    order = fresh[np.lexsort((lengths[fresh], points[fresh]))]
    last = np.append(points[order][1:] != points[order][:-1], True)[: len(order)]
    longest = order[last]
    stay[longest[left[points[longest]] > FEWEST]] = True
    return stay
