"""The adjustment of a check: exchanged names, and gross errors by data snooping (Appendix H, 3-sigma rule).

The search is :func:`photogram.snoop`, with single components of control and an unknown unit weight, because
standard deviations may be wrong by a factor. It starts without points whose rays miss each other, and without
control far from its rays, and tests these against the others. Exchanged names are corrected before single
errors are reported.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.adjustment.snooping import snoop_block
from photogram.diagnosis.findings import Finding, Section, section_of
from photogram.diagnosis.gross import Suspects
from photogram.diagnosis.misfits import Misfits, exchanged, list_test_values
from photogram.diagnosis.mistakes import Adjuster
from photogram.diagnosis.tested_values import (
    FOUND,
    ROUNDING,
    grouped,
    mad_sd,
    outliers,
    sizes_of_tests,
    spread_of,
)
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.block import Block
from photogram.network.motion import kept_images, of_photos
from photogram.results.result import Result
from photogram.results.snooping_log import Aside, Exchange
from photogram.results.snooping_options import SnoopOptions

DISTORTING = 50.0  # Test value of control whose error distorts the photos
HOPELESS = 5.0  # Spread of the test values of photos that are removed, if they did not fit before
MOST_EXCHANGES = 5  # Maximum number of successive corrections of names


@dataclass
class Edited:
    """The adjustment and the removed observations."""

    section: Section  # List of gross errors
    first: Result | None = None  # The first and the last adjustment; None if it failed
    last: Result | None = None
    reason: str = ""  # The reason for the failure
    gross: list[Finding] = field(default_factory=list)  # Findings on photos, names and undetermined points
    # Findings on removed components of control, by point
    control: dict[str, list[Finding]] = field(default_factory=dict)
    asked: bool = True  # Whether an adjustment was requested

    @property
    def spread(self) -> float:
        """Robust standard deviation of the last test values: 1 if the weights are correct."""
        return math.nan if self.last is None else spread_of(self.last)

    @property
    def is_settled(self) -> bool:
        """Whether the last adjustment decides about suspects."""
        return self.last is not None and self.last.converged and self.spread < HOPELESS


def edit(block: Block, suspects: Suspects, adjusted: Adjuster) -> Edited:
    """Adjust a block without suspects, exchange names, and remove gross errors."""
    edited = Edited(section_of("blunders"))
    block = _fitting(block, suspects, adjusted, edited)
    result = edited.last = edited.first
    for _ in range(MOST_EXCHANGES):
        exchanges = _remove(block, suspects, result, adjusted, edited)
        if not exchanges:
            break
        edited.gross += exchanged(exchanges)
        block = _with_names(block, exchanges)
        suspects = suspects._replace(points=np.zeros_like(suspects.points))
        result, edited.reason = _adjusted(block, adjusted)
        edited.last = result
    if edited.last is not None:
        list_test_values(edited.last, edited.section)
    return edited


def _fitting(block: Block, suspects: Suspects, adjusted: Adjuster, edited: Edited) -> Block:
    """Adjust without suspected points, and without bad photos if they do not fit then.

    Returns the block without these photos.
    """
    bad, good = suspects.photos, kept_images(block, ~suspects.points[block.image_points])
    edited.first, edited.reason = _adjusted(good, adjusted)
    if edited.first is not None and edited.first.converged and spread_of(edited.first) < HOPELESS:
        values = grouped(edited.first.standardized, good.image_photos, len(bad))
        bad = bad & ~(np.array([mad_sd(own) for own in values]) < HOPELESS)
    if not bad.any():
        return block
    names = [name for name, of in zip(block.photo_ids, bad.tolist(), strict=True) if of]
    edited.section.remark("check.remark.without-photos", photos=names)
    if edited.reason:
        edited.section.remark("check.remark.with-photos", reason=edited.reason)
    edited.first, edited.reason = _adjusted(of_photos(good, ~bad), adjusted)
    return of_photos(block, ~bad)


def _adjusted(block: Block, adjusted: Adjuster) -> tuple[Result | None, str]:
    """Return the adjustment of a block, or the reason of its failure."""
    try:
        return adjusted(block), ""
    except AdjustmentError as error:
        return None, str(error)


def _remove(
    block: Block, suspects: Suspects, first: Result | None, adjusted: Adjuster, edited: Edited
) -> list[Exchange]:
    """Remove gross errors, and add the findings; return exchanged names instead, if there are any.

    `first` is the adjustment without images of suspected points.
    """
    suspected = suspects.points[block.image_points]
    converged = first if first is not None and first.converged else None
    fits = converged is not None and not any(own.any() for own in outliers(converged).values())
    if fits and not suspected.any():
        return []
    control = suspects.control
    if converged is not None:
        sizes = sizes_of_tests(converged)
        worst = max(float(own.max(initial=0.0)) for own in sizes.values())
        # Few observations test control at an edge: distant photos that its error distorts would be removed.
        control = control | ((sizes["control"].max(axis=1) == worst) & (worst > DISTORTING))
    start = Aside(np.flatnonzero(suspected), {}, control=np.flatnonzero(control))
    # The variance of rounding errors would make all of them gross errors.
    rounded = converged is not None and mad_sd(converged.standardized) <= ROUNDING
    options = SnoopOptions(level=FOUND, unit_weight="known" if rounded else "unknown")
    try:
        found = snoop_block(
            block,
            options,
            start=start if len(start.images) + len(start.control) else None,
            control="components",
            **adjusted.options,
        )
    except AdjustmentError as error:
        edited.reason, edited.last = str(error), first
        return []
    assert isinstance(found.result, Result)
    if found.exchanged:
        return [*found.exchanged]
    edited.first, edited.last = edited.first or found.result, found.result
    misfits = Misfits(block, suspected, found, found.result)
    edited.section.findings += misfits.in_section
    edited.gross += misfits.of_suspects
    edited.control = misfits.control
    return []


def _with_names(block: Block, exchanges: list[Exchange]) -> Block:
    """Return a block with exchanged names of points."""
    points = block.image_points.copy()
    for each in exchanges:
        on = block.image_photos == block.photo_ids.index(each.photos[0])
        one, other = map(block.point_ids.index, each.points)
        points[on & (block.image_points == one)] = other
        points[on & (block.image_points == other)] = one
    return block.replace(image_points=points)
