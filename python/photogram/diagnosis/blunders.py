"""The adjustment of a check: exchanged names, and gross errors by data snooping (Appendix H, 3-sigma rule).

The search is :func:`photogram.snoop`, with single components of control and an unknown unit weight, because
standard deviations may be wrong by a factor. It starts without points whose rays miss each other, and without
control far from its rays, and tests these against the others. Exchanged names are corrected before single
errors are reported.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import combinations

import numpy as np

from photogram import _photocore
from photogram.adjustment.snooping import snoop_block
from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.findings import Finding, Level, Section, finding, section_of, small_unit
from photogram.diagnosis.gross import Suspects
from photogram.diagnosis.mistakes import Adjuster
from photogram.diagnosis.tested_values import (
    FOUND,
    ROUNDING,
    SURE,
    grouped,
    mad_sd,
    outliers,
    sizes_of_tests,
    spread_of,
)
from photogram.errors import AdjustmentError
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.block import Block, flown_by
from photogram.network.motion import kept_images, of_photos
from photogram.network.rays import Rays, meet, seen_without_lenses
from photogram.results.network_trial import ATTITUDE, CONTROL, IMAGE, OBSERVATION, POSITION, BlockSuspects
from photogram.results.result import Result
from photogram.results.snooping_log import Aside, Exchange, Removal
from photogram.results.snooping_options import SnoopOptions
from photogram.results.snooping_result import Snooped
from photogram.results.tables import Tests
from photogram.show.quantity import Table
from photogram.statistics.limits import normal_limit
from photogram.words import Phrase, phrase

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
    Misfits(block, suspected, found, found.result, edited).add()
    return []


def _with_names(block: Block, exchanges: list[Exchange]) -> Block:
    points = block.image_points.copy()
    for each in exchanges:
        on = block.image_photos == block.photo_ids.index(each.photos[0])
        one, other = map(block.point_ids.index, each.points)
        points[on & (block.image_points == one)] = other
        points[on & (block.image_points == other)] = one
    return block.replace(image_points=points)


CODES = {
    IMAGE: "check.blunder.image",
    CONTROL: "check.control-misfit.component",
    POSITION: "check.station-misfit",
    ATTITUDE: "check.station-misfit",
}
"""Messages by type; all others are additional observations."""
ODDS = 20.0  # Likelihood ratio below which another observation is an alternative
BLUNDER, TWENTIETH = 3.0, 1.96
SHOWN = 20
PARTED, FEWEST_OF_TWO = 0.1, 2
"""Largest part of the residuals, and least rays per group, if one name belongs to two points."""
AS_WELL = 3.0  # Least ratio of the remaining residual without one ray to that of two groups


class Misfits:
    """Findings on a block of which (m,) images of undetermined points were excluded before snooping."""

    def __init__(
        self, block: Block, suspected: Bools, found: Snooped, result: Result, edited: Edited
    ) -> None:
        assert isinstance(found.suspects, BlockSuspects)
        self.block, self.suspected, self.suspects = block, suspected, found.suspects
        self.found, self.result, self.edited = found, result, edited
        values = sizes_of_tests(result)["image"]
        values = values[values > 0]
        # If errors have heavier tails than normal ones, the 95 % quantile (1.96 sd) defines the spread.
        self.tail = max(1.0, float(np.quantile(values, 0.95)) / TWENTIETH) if values.size else 1.0

    def add(self) -> None:
        """Add the findings to the lists of the adjustment."""
        # Errors against the others are exact, also if they are large.
        entries = [
            replace(entry, error=entry.prediction_error or entry.error)
            for entry in self.found.log
            if entry.returned is None
        ]
        explained = set() if flown_by(self.block) else self._parted(entries)
        for entry in entries:
            if self._image_of(entry) not in explained:
                self._add(entry)
        for each in self.found.outcome.remarks:
            if each.code == "snooping.common":
                self.edited.section.note("grave", "check.common-error", **each.fields)

    def _image_of(self, entry: Removal) -> int:
        """Return the number of an image; -1 for other observations."""
        is_image = self.suspects.kinds[entry.group] == IMAGE and entry.kind != "photo"
        return int(self.suspects.subjects[entry.group]) if is_image else -1

    def _add(self, entry: Removal) -> None:
        kind = int(self.suspects.kinds[entry.group])
        if entry.kind == "photo":
            photo = int(self.suspects.photos[entry.group])
            name, count = self.block.photo_ids[photo], int((self.block.image_photos == photo).sum())
            message = phrase("check.bad-photo.points", photo=name, n=count)
            self.edited.gross.append(finding("grave", message, [name], values={"points": float(count)}))
        elif kind == CONTROL:
            point = self.block.point_ids[self.suspects.points[entry.group]]
            self.edited.control.setdefault(point, []).extend(self._errors(entry))
        elif kind == IMAGE and self.suspected[self._image_of(entry)]:
            self.edited.gross += self._errors(entry)
        else:
            self.edited.section.findings += self._errors(entry)

    def _parted(self, entries: list[Removal]) -> set[int]:
        """Add names of two points, the rays of which intersect in two groups; return their images."""
        block, explained = self.block, set[int]()
        images = [image for entry in entries if entry.rows and (image := self._image_of(entry)) >= 0]
        points, counts = np.unique(block.image_points[images], return_counts=True)
        poses = {
            "photo_positions": self.result.photo_positions,
            "photo_attitudes": self.result.photo_attitudes,
        }
        plain, _ = seen_without_lenses(block.replace(**poses))
        if len(plain.image_xy) < len(block.image_xy):
            return explained
        rays = Rays.of(plain)
        equations = rays.equations()
        for point in np.union1d(points[counts > 1], block.image_points[self.suspected]).tolist():
            rows = np.flatnonzero(block.image_points == point)
            one, other, before = _groups(rays, equations, rows)
            if len(one):
                first, second = (
                    [block.photo_ids[photo] for photo in block.image_photos[own]] for own in (one, other)
                )
                name, unit = block.point_ids[point], block.image_unit
                fields = {"point": name, "first": first, "second": second, "before": before, "unit": unit}
                message = phrase("check.name-used-twice", **fields)
                found = finding("grave", message, [*first, *second], [name], {f"residual_{unit}": before})
                self.edited.gross.append(found)
                explained |= {*rows.tolist()}
        return explained

    def _level(self, entry: Removal) -> Level:
        """Return the level by the p-value, also for errors with heavier tails than normal ones."""
        limit, freedom = SURE / self.found.outcome.tests, float(entry.dimension)
        if math.isnan(entry.log_probability):
            return "grave"
        chance = _photocore.chi_square((self._test(entry) / self.tail) ** 2, freedom)
        return "grave" if entry.log_probability < math.log(limit) and chance < limit else "look"

    def _test(self, entry: Removal) -> float:
        """Return the root of T in units of the remaining variance."""
        return math.sqrt(entry.fisher * entry.dimension)

    def _errors(self, entry: Removal) -> list[Finding]:
        """Return findings on the component with the largest error, or on all significant ones of a vector."""
        suspects, kind = self.suspects, int(self.suspects.kinds[entry.group])
        code = CODES.get(kind, "check.observation-misfit")
        if kind == IMAGE and self.suspected[self._image_of(entry)]:
            code = "check.gross-error.one"
        sizes = np.nan_to_num(np.abs(entry.error) / np.array(entry.error_sd)) / spread_of(self.result)
        limit = normal_limit(self.found.outcome.tests, FOUND)
        chosen = np.flatnonzero(sizes > limit).tolist() if kind in (CONTROL, POSITION, ATTITUDE) else []
        points, photos = self._names(entry.group, kind)
        fields = {"named": suspects.name(entry.group), "redundancy": entry.redundancy}
        fields |= {"point": points[0] if points else "", "photo": photos[0] if photos else ""}
        fields["rivals"], others = self._rivals(entry, kind)
        (photos if kind == IMAGE else points).extend(others)
        found = []
        for k in chosen or [int(sizes.argmax())]:
            row = entry.rows[k]
            error, unit = _shown(entry.error[k], suspects.unit(row), kind)
            test = float(sizes[k]) if len(chosen) > 1 else self._test(entry)
            component = suspects.row_name(row)
            message = phrase(code, component=component, error=error, unit=unit, test=test, **fields)
            values = {f"error_{unit}".rstrip("_"): error, "test_value": test}
            values |= {"component": float(suspects.components[row]), "redundancy": entry.redundancy}
            found.append(finding(self._level(entry), message, photos, points, values))
        return found

    def _names(self, group: int, kind: int) -> tuple[list[str], list[str]]:
        """Return the points and photos of a group."""
        if kind == OBSERVATION:
            own = self.suspects.observations[int(self.suspects.subjects[group])]
            return [*own.points], [*own.photos]
        point, photo = int(self.suspects.points[group]), int(self.suspects.photos[group])
        return [self.block.point_ids[point]] * (point >= 0), [self.block.photo_ids[photo]] * (photo >= 0)

    def _rivals(self, entry: Removal, kind: int) -> tuple[Phrase | str, list[str]]:
        """Return the message on images of the point, or control points, that may be wrong instead."""
        suspects, group = self.suspects, entry.group
        of, ids = (suspects.points, self.block.point_ids)
        rivals = [own.group for own in entry.rivals if own.odds < ODDS and suspects.kinds[own.group] == kind]
        code = "check.rival.control"
        if kind == IMAGE:
            rivals = [own for own in rivals if suspects.points[own] == suspects.points[group]]
            two = np.count_nonzero(self.block.image_points == suspects.points[group]) == 2
            of, ids = suspects.photos, self.block.photo_ids
            code = f"check.rival.{'two-rays' if two else 'images'}"
        others = [ids[of[own]] for own in rivals if of[own] >= 0]
        return phrase(code, names=others) if others else "", others


def _groups(rays: Rays, equations: tuple[Floats, Floats], rows: Indices) -> tuple[Indices, Indices, float]:
    """Return two groups of rays of a point that intersect, and the largest residual of all.

    The groups are empty if a single ray explains the residuals as well.
    """

    def sizes(own: Indices) -> tuple[Floats, Bools]:
        """Return residuals of all rays where some intersect, and whether that is in front of them."""
        normal, constant = (each[own].sum(axis=0, keepdims=True) for each in equations)
        position = meet(normal, constant, np.array([len(own)]))
        residuals, in_front = rays.residuals(np.broadcast_to(position, (len(rows), 3)), rows)
        return np.nan_to_num(np.linalg.norm(residuals, axis=1), nan=np.inf), in_front

    def largest(kept: Bools) -> float:
        return float(sizes(rows[kept])[0][kept].max())

    everything = np.ones(len(rows), dtype=bool)
    before, best = largest(everything), (math.inf, everything)
    for pair in combinations(rows.tolist(), 2):
        alone, in_front = sizes(np.array(pair))
        # Rays of two points may meet anywhere, even behind the cameras, with any residual.
        near = in_front & (alone < PARTED * min(before, float(alone[np.isfinite(alone)].max(initial=0.0))))
        if FEWEST_OF_TWO <= near.sum() <= len(rows) - FEWEST_OF_TWO:
            best = min(best, (max(largest(near), largest(~near)), near), key=lambda each: each[0])
    left, near = best
    single = min((largest(rows != row) for row in rows.tolist()), default=0.0) if len(rows) > 2 else 0.0
    is_parted = left < PARTED * before and AS_WELL * left < single
    return rows[near & is_parted], rows[~near & is_parted], before


def exchanged(exchanges: Iterable[Exchange]) -> list[Finding]:
    """Return findings on exchanged names."""
    found = []
    for each in exchanges:
        message = phrase("check.exchanged-points", points=list(each.points), photo=each.photos[0])
        values = {"statistic_as_named": each.as_named, "statistic_exchanged": each.exchanged}
        found.append(finding("grave", message, [each.photos[0]], each.points, values))
    return found


def _shown(error: float, unit: str, kind: int) -> tuple[float, str]:
    """Return an error in the unit of reports: angles in arc seconds, images in micrometres."""
    if kind == IMAGE:
        unit, factor = small_unit(unit)
        return factor * error, unit
    return (error / ARCSEC, "arcsec") if unit == "rad" else (error, unit)


def list_test_values(result: Result, section: Section) -> None:
    """List test values beyond 3 after all removals, the largest ones, and their number."""
    values = sizes_of_tests(result)["image"]
    tested = int((values > 0).sum())
    beyond = int((values > BLUNDER).sum())
    section.figure(
        "robust spread of the test values", f"{spread_of(result):.3f} (1 when the weights are right)"
    )
    section.figure(
        f"image coordinates beyond {BLUNDER:g} times the spread",
        f"{beyond} of {tested} tested ({0.0027 * tested:.0f} to be expected)",
    )
    tests = Tests(result)
    title = "Largest test values of the other observations"
    section.parts.append(Table("", title, tests.columns(tests.largest(SHOWN))))
