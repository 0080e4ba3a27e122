"""The adjustment of a check, and gross errors by data snooping (Appendix H, 3-sigma rule).

The search is :func:`photogram.snoop`, with single components of control and an unknown unit weight, because
standard deviations may be wrong by a factor. It starts without the observations that intersection suspects
(:mod:`photogram.diagnosis.gross`), and tests these against the others.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.adjustment.snooping import snoop_block
from photogram.arguments.types import Bools, Indices
from photogram.diagnosis.control_sets import without_outliers
from photogram.diagnosis.findings import Finding, Section, section_of
from photogram.diagnosis.gross import Suspects
from photogram.diagnosis.misfits import Misfits, list_test_values
from photogram.diagnosis.mistakes import Adjuster
from photogram.diagnosis.robust import mad_sd
from photogram.diagnosis.tested_values import (
    FOUND,
    ROUNDING,
    outliers,
    sizes_of_tests,
    spread_of,
)
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.block import Block
from photogram.network.subset import kept_images, of_photos
from photogram.results.result import Result
from photogram.results.snooping_log import Aside
from photogram.results.snooping_options import SnoopOptions

DISTORTING = 50.0  # Test value of control whose error distorts the photos
HOPELESS = 5.0  # Spread of the test values of photos that are removed, if they did not fit before


@dataclass
class Edited:
    """The adjustment and the removed observations."""

    first: Result | None  # The first and the last adjustment; None if it failed
    last: Result | None
    reason: str  # The reason for the failure
    section: Section  # List of gross errors
    gross: list[Finding] = field(default_factory=list)  # Findings on images that intersection suspects
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
    """Adjust a block and remove gross errors."""
    edited = Edited(None, None, "", section_of("blunders"))
    block, suspected = _fitting(block, suspects, adjusted, edited)
    first = edited.first if edited.first is not None and edited.first.converged else None
    fits = first is not None and not any(own.any() for own in outliers(first).values())
    if fits and not suspected.any():
        edited.last = first
    else:
        control = _wrong_control(kept_images(block, ~suspected), first, adjusted)
        control = np.union1d(control, np.flatnonzero(suspects.control))
        _remove(block, suspected, control, adjusted, edited)
    if edited.last is not None:
        list_test_values(edited.last, edited.section)
    return edited


def _fitting(block: Block, suspects: Suspects, adjusted: Adjuster, edited: Edited) -> tuple[Block, Bools]:
    """Adjust without suspected images, and without suspected photos if they do not fit then.

    Returns the block without these photos, and its (m,) suspected images.
    """
    bad, suspected = suspects.photos, suspects.images
    good = kept_images(block, ~suspected)
    edited.first, edited.reason = _adjusted(good, adjusted)
    if edited.first is not None and edited.first.converged and spread_of(edited.first) < HOPELESS:
        values = edited.first.standardized
        own = [mad_sd(values[good.image_photos == photo]) for photo in range(len(bad))]
        bad = bad & ~(np.array(own) < HOPELESS)
    if not bad.any():
        return block, suspected
    names = [name for name, of in zip(block.photo_ids, bad.tolist(), strict=True) if of]
    edited.section.remark("check.remark.without-photos", photos=names)
    if edited.reason:
        edited.section.remark("check.remark.with-photos", reason=edited.reason)
    edited.first, edited.reason = _adjusted(of_photos(good, ~bad), adjusted)
    return of_photos(block, ~bad), suspected[~bad[block.image_photos]]


def _adjusted(block: Block, adjusted: Adjuster) -> tuple[Result | None, str]:
    """Return the adjustment of a block, or the reason of its failure."""
    try:
        return adjusted(block), ""
    except AdjustmentError as error:
        return None, str(error)


def _wrong_control(block: Block, first: Result | None, adjusted: Adjuster) -> Indices:
    """Return control points without which the control fits, if one of them has the largest test value.

    Large errors of control that few observations test distort distant photos, which would be removed instead.
    """
    sizes = {} if first is None else sizes_of_tests(first)
    largest = {kind: own.max(initial=0.0) for kind, own in sizes.items()}
    doubted = largest.get("control", 0.0) >= max([DISTORTING, *largest.values()])
    found = without_outliers(block, adjusted) if doubted else None
    return np.empty(0, dtype=np.int64) if found is None else found[1]


def _remove(block: Block, suspected: Bools, control: Indices, adjusted: Adjuster, edited: Edited) -> None:
    """Remove gross errors, and add the findings."""
    first = edited.first
    aside = Aside(np.flatnonzero(suspected), {}, control=control)
    start = aside if suspected.any() or control.size else None
    # The variance of rounding errors would make all of them gross errors.
    rounded = first is not None and first.converged and mad_sd(first.standardized) <= ROUNDING
    options = SnoopOptions(level=FOUND, unit_weight="known" if rounded else "unknown")
    try:
        found = snoop_block(block, options, start=start, control="components", **adjusted.options)
    except AdjustmentError as error:
        edited.reason, edited.last = str(error), first
        return
    assert isinstance(found.result, Result)
    edited.first, edited.last = first or found.result, found.result
    misfits = Misfits(block, suspected, found, found.result)
    edited.section.findings += misfits.in_section
    edited.gross, edited.control = misfits.of_suspects, misfits.control
