"""The adjustment of a check, and gross errors by data snooping (Appendix H, 3-sigma rule).

The search is :func:`photogram.snoop`, with single components of control and an unknown unit weight, because
standard deviations may be wrong by a factor. It starts without the observations that intersection suspects
(:mod:`photogram.diagnosis.gross`), and tests these against the others.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.adjustment.snooping import snoop_block
from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.adjusting import Adjuster
from photogram.diagnosis.exchanges import exchange, exchanged_control
from photogram.diagnosis.findings import Finding, Level, Section
from photogram.diagnosis.gross import Suspects
from photogram.diagnosis.misfits import Misfits, control_finding, list_test_values, observation_finding
from photogram.diagnosis.robust import critical, mad_sd
from photogram.diagnosis.tested_values import (
    FOUND,
    ROUNDING,
    SURE,
    outliers,
    sizes_of_tests,
    spread_of,
    tested_count,
)
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.block import Block
from photogram.network.subset import kept_images, of_photos
from photogram.results.result import Result
from photogram.results.snooping_log import Aside, disputes
from photogram.results.snooping_options import SnoopOptions

HOPELESS = 5.0  # Spread of the test values of photos that are removed, if they did not fit before
MOST_ALONE = 20  # Maximum number of adjustments that exclude control and additional observations
LEFT = 100  # Cost of an outlier that remains, in excluded observations
EXCHANGES = 5  # Maximum number of pairs of control points that are exchanged back


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
    # Pairs of control points with exchanged coordinates
    exchanged: list[tuple[str, str]] = field(default_factory=list)
    misleading: set[str] = field(default_factory=set)  # Photos of suspected images that are correct
    is_common: bool = False  # Whether errors of sets explain the residuals: nothing is removed
    is_disputed: bool = False  # Whether the data do not decide which of several observations is wrong
    asked: bool = True  # Whether an adjustment was requested

    @property
    def spread(self) -> float:
        """Robust standard deviation of the last test values: 1 if the weights are correct."""
        return math.nan if self.last is None else spread_of(self.last)

    @property
    def cost(self) -> float:
        """Number of excluded observations and of outliers that remain; infinite without an adjustment."""
        if self.last is None or not self.is_settled:
            return math.inf
        left = 0 if self.is_common else sum(int(each.sum()) for each in outliers(self.last).values())
        findings = len(self.section.findings) + len(self.gross) + sum(map(len, self.control.values()))
        return LEFT * left + findings

    @property
    def is_settled(self) -> bool:
        """Whether the last adjustment decides about suspects."""
        return self.last is not None and self.last.converged and self.spread < HOPELESS


def blunder_section() -> Section:
    """Return an empty list of gross errors."""
    return Section(
        "Blunders (adjustment, 3-sigma rule)",
        "A residual beyond three of its standard deviations is suspect; what is taken out is named below.",
    )


def edit(block: Block, suspects: Suspects, adjusted: Adjuster) -> Edited:
    """Adjust a block and remove gross errors.

    Control points that fit after an exchange of two are exchanged, and the search restarts. Suspected control
    is used at first, and also free at first: the attempt that removes less is returned.
    """
    exchanged: list[tuple[str, str]] = []
    doubted = suspects.control.copy()
    is_doubtful = int(doubted.sum()) > 1
    while True:
        edited = Edited(None, None, "", blunder_section(), exchanged=exchanged)
        start = _Start.of(block, suspects, adjusted, edited)
        fits = edited.first is not None and edited.first.converged
        pair = exchanged_control(start.good, edited.first, adjusted) if is_doubtful or not fits else None
        if pair is None:
            other = replace(edited, section=blunder_section(), gross=[], control={})
            fewer, points = _without_control(start, np.flatnonzero(doubted), adjusted, other)
            if fewer is not start:
                _remove(fewer, adjusted, other)
                _restore_control(other, start.block, points, adjusted)
            _remove(start, adjusted, edited)
            # At equal cost, data snooping names alternatives to control.
            is_better = (other.cost, bool(edited.control)) < (edited.cost, True)
            if fewer is not start and is_better and not edited.is_disputed:
                edited = other
            if len(edited.control) > 1:
                pair = exchanged_control(start.good, edited.last, adjusted)
        if pair is None or len(exchanged) == EXCHANGES:
            return edited
        exchanged.append(pair)
        rows = [block.point_ids.index(name) for name in pair]
        block, is_doubtful = exchange(block, *rows), False
        doubted[rows] = False


def _without_control(
    start: _Start, points: Indices, adjusted: Adjuster, edited: Edited
) -> tuple[_Start, Indices]:
    """Exclude suspected control, then control and additional observations with the largest test value.

    Their redundancy numbers may be a thousandth, too small for tests of groups. Errors of them affect distant
    observations, so that they are excluded one by one.
    """
    for _ in range(MOST_ALONE):
        if len(points):
            start = start.without_control(points)
        result = adjusted.tried(start.good)
        if result is None or not result.converged:
            break
        sizes = {
            kind: np.where(own, sizes_of_tests(result)[kind], 0.0) for kind, own in outliers(result).items()
        }
        kind = max(sizes, key=lambda each: float(sizes[each].max(initial=0.0)))
        row, axis = divmod(int(sizes[kind].argmax()), sizes[kind].shape[1]) if sizes[kind].size else (0, 0)
        if kind in ("image", "station") or not sizes[kind][row, axis] > 0:
            break
        if kind == "control":
            points = np.append(points, row)
            continue
        own = result.kinds[kind]
        redundancy = float(own.redundancy[row, axis])
        found = observation_finding(
            start.block.observations[int(own.rows[row])],
            (own.components[axis], own.units[axis]),
            float(own.residuals[row, axis]) / redundancy,
            float(sizes[kind][row, axis]),
            redundancy,
            "grave" if sizes[kind][row, axis] > critical(tested_count(result), SURE) else "look",
        )
        edited.section.findings.append(found)
        start = start.without_observation(int(own.rows[row]))
    return start, points


def predicted_control(result: Result, given: Block, points: Indices) -> tuple[Floats, Floats]:
    """Return (k, 3) given minus predicted coordinates of free points, and test values; NaN if not given.

    A prediction is the adjusted position of a free point, which contains no error of it.
    """
    held = np.isfinite(given.point_sd[points])
    errors = np.where(held, given.point_positions[points] - result.point_positions[points], np.nan)
    variances = given.point_sd[points] ** 2 + np.diagonal(result.point_cofactors[points], axis1=1, axis2=2)
    return errors, np.abs(errors) / (spread_of(result) * np.sqrt(np.where(held, variances, np.nan)))


def without_outlying_control(block: Block, adjusted: Adjuster) -> tuple[Result, Floats] | None:
    """Adjust without the control point with the largest test value, until all others fit.

    Returns the adjustment, and (k, 3) test values of the excluded points; None if more than a third fails.
    """
    points: Indices = np.empty(0, dtype=np.int64)
    count = int(np.isfinite(block.point_sd).any(axis=1).sum())
    for _ in range(1 + max(count // 3, 1)):
        point_sd = block.point_sd.copy()
        point_sd[points] = np.inf
        result = adjusted.converged(block.replace(point_sd=point_sd) if len(points) else block)
        if result is None:
            return None
        if not outliers(result)["control"].any():
            return result, predicted_control(result, block, points)[1]
        points = np.append(points, np.argmax(sizes_of_tests(result)["control"].max(axis=1)))
    return None


def _restore_control(edited: Edited, given: Block, points: Indices, adjusted: Adjuster) -> None:
    """Use the components of free control that agree with their predictions, and report the others."""
    result = edited.last
    if result is None or not result.converged:
        return
    count = int(np.isfinite(given.point_sd).sum())
    point_sd = result.block.point_sd.copy()
    for row, error, test in zip(points.tolist(), *predicted_control(result, given, points), strict=True):
        for axis in np.flatnonzero(test > critical(count, FOUND)).tolist():
            level: Level = "grave" if test[axis] > critical(count, SURE) else "look"
            found = control_finding(given, row, axis, float(error[axis]), float(test[axis]), level)
            edited.control.setdefault(given.point_ids[row], []).append(found)
        fits = test <= critical(count, FOUND)
        point_sd[row, fits] = given.point_sd[row, fits]
    if (point_sd != result.block.point_sd).any():
        positions = np.where(np.isfinite(point_sd), given.point_positions, result.block.point_positions)
        edited.last = adjusted.tried(result.block.replace(point_positions=positions, point_sd=point_sd))


@dataclass(frozen=True, eq=False)
class _Start:
    """A block without photos that do not fit, and its (m,) images that are suspected."""

    block: Block
    suspected: Bools
    good: Block  # without these images

    def without_control(self, points: Indices) -> _Start:
        """Return the start with some free points."""
        point_sd = self.block.point_sd.copy()
        point_sd[points] = np.inf
        return _Start(
            self.block.replace(point_sd=point_sd), self.suspected, self.good.replace(point_sd=point_sd)
        )

    def without_observation(self, row: int) -> _Start:
        """Return the start without an additional observation."""
        left = [each for place, each in enumerate(self.block.observations) if place != row]
        return _Start(
            self.block.replace(observations=left), self.suspected, self.good.replace(observations=left)
        )

    @classmethod
    def of(cls, block: Block, suspects: Suspects, adjusted: Adjuster, edited: Edited) -> _Start:
        """Adjust without suspected images, and without suspected photos if they do not fit then."""
        bad, good, suspected = suspects.photos, kept_images(block, ~suspects.images), suspects.images
        error: AdjustmentError | None = None
        try:
            edited.first = adjusted(good)
            if bad.any() and edited.first.converged and spread_of(edited.first) < HOPELESS:
                values = edited.first.standardized
                own = [mad_sd(values[good.image_photos == photo]) for photo in range(len(bad))]
                bad = bad & ~(np.array(own) < HOPELESS)
        except AdjustmentError as caught:
            error = caught
        if bad.any():
            names = [name for name, of in zip(block.photo_ids, bad.tolist(), strict=True) if of]
            edited.section.remark(f"adjusted without the photos that do not fit: {', '.join(names)}")
            if error is not None:
                edited.section.remark(f"with them: {error}")
            suspected = suspected[~bad[block.image_photos]]
            block, good, error = of_photos(block, ~bad), of_photos(good, ~bad), None
            try:
                edited.first = adjusted(good)
            except AdjustmentError as caught:
                edited.first, error = None, caught
        edited.reason = "" if error is None else str(error)
        return cls(block, suspected, good)


def _remove(start: _Start, adjusted: Adjuster, edited: Edited) -> None:
    """Remove gross errors, and add the findings."""
    first = adjusted.tried(start.good)
    is_good = first is not None and first.converged and not any(own.any() for own in outliers(first).values())
    if first is not None and is_good and not start.suspected.any():
        edited.last = first
    else:
        images = np.flatnonzero(start.suspected)
        aside = Aside(images, {}) if images.size else None
        # The variance of rounding errors would make all of them gross errors.
        rounded = first is not None and first.converged and mad_sd(first.standardized) <= ROUNDING
        options = SnoopOptions(level=FOUND, unit_weight="known" if rounded else "unknown")
        try:
            found = snoop_block(start.block, options, start=aside, control="components", **adjusted.options)
        except AdjustmentError as error:
            edited.reason = str(error)
            edited.last = first
            return
        assert isinstance(found.result, Result)
        edited.first, edited.last = edited.first or found.result, found.result
        misfits = Misfits(start.block, start.suspected, found, found.result)
        edited.section.findings += misfits.in_section
        edited.gross, edited.control = misfits.of_suspects, misfits.control
        edited.misleading, edited.is_common = misfits.misleading, misfits.is_common
        edited.is_disputed = bool(disputes(found.log))
    list_test_values(edited.last, edited.section)
