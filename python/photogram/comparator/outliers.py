"""Measurements that do not agree with the others: pointings, means of points after the adjustment, remarks.

Standard deviations are not known beforehand, so that residuals are judged against those of the other
measurements (externally studentized, :mod:`photogram.statistics`). Outliers of the adjustment are taken out
and the rest adjusted anew until none is left: what the correction is then tells how much harm they do. What a
reader should know before the values: problems, the gravest first, and remarks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.comparator.case import PlacedCase, exchanged
from photogram.comparator.combined_solution import (
    CombinedLinear,
    CombinedPolynomial,
    combine_linear,
    combine_polynomial,
)
from photogram.comparator.fits import fit_affine, fit_rigid, rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.joint import JointFit
from photogram.comparator.readings import Case, Session
from photogram.comparator.reduction import Reduction
from photogram.errors import AdjustmentError
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.statistics.limits import externally_studentized, studentized_limit

ROUNDS = 30  # Adjustments at most; each takes out what is at least half as far off as the farthest
LEAST_POINTS = 6  # A case keeps so many points, or it is not screened any further
# Nothing below a nanometre is an outlier: residuals of measurements without error are rounding
LEAST_UM = 1e-3
MATCH = 0.1  # A point measured where another is expected is within this part of their distance of it


@dataclass(frozen=True)
class FarPointing:
    """A pointing that does not agree with the others of its case."""

    case: int  # Numbers of case and point; which pointing of the case, from 0
    point: int
    row: int
    deviation_um: float  # From the mean of the point, in the coordinate that is off
    ratio: float  # The deviation over its standard deviation, by the other pointings of the case
    limit: float  # Of the ratio


@dataclass(frozen=True)
class Outlier:
    """A measured point that does not agree with the adjustment of the others."""

    case: int  # Numbers
    point: int
    # Measured less expected comparator coordinates, by the adjustment without outliers
    off_um: tuple[float, float]
    ratio: float  # The residual over its standard deviation when it was taken out
    instead: int | None  # The point of the plate that is expected there; None for none

    @property
    def distance_um(self) -> float:
        """How far it is off."""
        return math.hypot(*self.off_um)


@dataclass(frozen=True)
class Screening:
    """What the search for outliers of the adjustment found."""

    outliers: tuple[Outlier, ...]  # Case by case, point by point
    limit: float  # Of the ratios, for all coordinates together at the level of 5 percent
    # How much the outliers change corrected coordinates: root mean square over the measured places,
    # free of rotation and translation. 0 without outliers
    change_um: float
    sigma_um: float  # Standard deviation of unit weight of the adjustment without them
    # Of each case, (k, 2): the test values of all its points before any was taken out, without signs
    ratios: tuple[Floats, ...]
    freedom: float  # Degrees of freedom of that adjustment

    @property
    def harmful(self) -> bool:
        """Whether outliers falsify corrected coordinates by more than a coordinate is uncertain."""
        return self.change_um > self.sigma_um


@dataclass(frozen=True, eq=False)
class PointingTests:
    """Tests of the pointings of a case against the others of the case."""

    case: Case  # The case
    deviations: Floats  # (k, 2) from the mean of the point, or of its leg
    ratios: Floats  # (k, 2) externally studentized; 0 for single pointings
    freedom: int  # Degrees of freedom of the standard deviation in x, and of that in y


def pointing_tests(cases: Sequence[Case]) -> list[PointingTests]:
    """Test pointings against the others of their case.

    Each deviates from the mean of its point (of its leg, where legs were measured); deviations in x and in y
    of a case have one standard deviation each.
    """
    tests = []
    for case in cases:
        _, group, counts = np.unique(
            np.column_stack([case.points, case.legs]), axis=0, return_inverse=True, return_counts=True
        )
        group = group.ravel()
        freedom = len(group) - len(counts)
        offsets = case.xy_um - case.xy_um[0]
        sums = np.column_stack([np.bincount(group, weights=column) for column in offsets.T])
        deviations = offsets - (sums / counts[:, np.newaxis])[group]
        redundancy = (1 - 1 / counts)[group]
        ratios = np.zeros_like(deviations)
        repeated = redundancy > 0
        for axis, own in enumerate(deviations.T):
            w = own[repeated] / np.sqrt(redundancy[repeated])
            ratios[repeated, axis] = externally_studentized(w, float(own @ own), freedom)
        ratios[(np.abs(deviations) <= LEAST_UM) | np.isnan(ratios)] = 0.0
        tests.append(PointingTests(case, deviations, ratios, freedom))
    return tests


def far_pointings(tests: Sequence[PointingTests], others: int = 0) -> list[FarPointing]:
    """Find pointings that do not agree; `others` are tests that share the level with these."""
    found = []
    number = sum(each.ratios.size for each in tests) + others
    for each in tests:
        limit = studentized_limit(each.freedom, number)
        worst = np.abs(each.ratios).argmax(axis=1)
        rows = np.arange(len(worst))
        for row in np.flatnonzero(np.abs(each.ratios[rows, worst]) > limit).tolist():
            deviation, ratio = (float(own[row, worst[row]]) for own in (each.deviations, each.ratios))
            point = int(each.case.points[row])
            found.append(FarPointing(each.case.number, point, row, deviation, abs(ratio), limit))
    return found


def screen(
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
    grids: Mapping[int, Grid],
    others: int = 0,
) -> Screening:
    """Find measured points that do not agree with the adjustment of the others, in the last stage.

    `others` are tests that share the level with these.
    """
    kept = list(cases)
    removed: list[tuple[int, int, float]] = []
    clean, limit = stage, math.inf
    first: tuple[tuple[Floats, ...], float] | None = None
    for _ in range(ROUNDS):
        tests, freedom = _ratios(kept, clean)
        first = first or (tuple(tests), freedom)
        ratios = [own.max(axis=1) for own in tests]
        limit = studentized_limit(freedom, 2 * sum(len(own) for own in ratios) + others)
        worst = max(float(own.max()) for own in ratios)
        if not worst > limit:
            break
        chosen = [own >= max(limit, worst / 2) for own in ratios]
        remaining = [_without(case, out) for case, out in zip(kept, chosen, strict=True)]
        if min(len(case.points) for case in remaining) < LEAST_POINTS:
            break
        try:
            clean = _adjust(remaining, with_polynomial=isinstance(stage, CombinedPolynomial))
        except AdjustmentError:
            break
        for k, (case, own, out) in enumerate(zip(kept, ratios, chosen, strict=True)):
            removed += [(k, int(case.points[row]), float(own[row])) for row in np.flatnonzero(out)]
        kept = remaining
    outliers = tuple(
        _outlier(cases[k], grids[cases[k].case.plate], clean, k, point, ratio)
        for k, point, ratio in sorted(removed)
    )
    change = _change(stage, clean, cases) if outliers else 0.0
    assert first is not None
    return Screening(outliers, limit, change, clean.sigma0_um, *first)


def _ratios(
    cases: Sequence[PlacedCase], stage: CombinedLinear | CombinedPolynomial
) -> tuple[list[Floats], float]:
    """Return externally studentized residuals of each case, (k, 2) without signs.

    And the degrees of freedom: the trace of R R^T.
    """
    reduction = Reduction.of(stage)
    residuals = np.vstack([fit.residuals.comparator_um for fit in stage.cases])
    left = reduction.variances()
    checked = left > 1e-6
    w = np.divide(residuals, np.sqrt(np.maximum(left, 0.0)), out=np.zeros_like(residuals), where=checked)
    freedom = reduction.squares_of_units()
    ratios = externally_studentized(w, float((residuals**2).sum()), freedom)
    ratios[~checked | (np.abs(residuals) <= LEAST_UM) | np.isnan(ratios)] = 0.0
    ends = np.cumsum([len(case.points) for case in cases])[:-1]
    return np.split(np.abs(ratios), ends), freedom


def _without(case: PlacedCase, out: Bools) -> PlacedCase:
    keep = ~out
    return replace(
        case,
        readings=[own for own, stays in zip(case.readings, keep.tolist(), strict=True) if stays],
        points=case.points[keep],
        counts=case.counts[keep],
        means_um=case.means_um[keep],
        grid_um=case.grid_um[keep],
    )


def _adjust(cases: Sequence[PlacedCase], *, with_polynomial: bool) -> CombinedLinear | CombinedPolynomial:
    fits = [fit_affine(case.points, case.means_um, case.grid_um) for case in cases]
    linear = combine_linear(cases, fits)
    return combine_polynomial(cases, linear) if with_polynomial else linear


def _outlier(
    case: PlacedCase,
    grid: Grid,
    stage: CombinedLinear | CombinedPolynomial,
    index: int,
    point: int,
    ratio: float,
) -> Outlier:
    """Compare a measured point with where the adjustment of the others expects it and its neighbours."""
    fit = stage.cases[index]
    row = int(np.flatnonzero(case.points == point)[0])
    found = stage.correction.apply(case.means_um[row : row + 1])[0]
    plate = exchanged(grid.xy_um, case.orientation.left_handed)
    expected = (plate - fit.translation_um) @ rotation_matrix(fit.rotation_rad)
    own = expected[int(np.flatnonzero(grid.points == point)[0])]
    nearest = int(np.hypot(*(expected - found).T).argmin())
    near = math.dist(expected[nearest], found) < MATCH * math.dist(expected[nearest], own)
    off = found - own
    return Outlier(
        case.number,
        point,
        (float(off[0]), float(off[1])),
        ratio,
        int(grid.points[nearest]) if near else None,
    )


def _change(
    stage: CombinedLinear | CombinedPolynomial,
    clean: CombinedLinear | CombinedPolynomial,
    cases: Sequence[PlacedCase],
) -> float:
    """Root mean square by which two corrections differ at the measured places, rotation and shift apart."""
    places = np.vstack([case.means_um for case in cases])
    numbers = np.arange(len(places))
    with_them, without = stage.correction.apply(places), clean.correction.apply(places)
    residuals = fit_rigid(numbers, with_them, without).residuals.grid_um
    return math.sqrt(float((residuals**2).mean()))


Found = TypeVar("Found", FarPointing, Outlier)

MOST = 40  # Outliers of either kind that are named; the largest ones


def problems(
    session: Session,
    cases: Sequence[PlacedCase],
    screening: Screening,
    far: Sequence[FarPointing],
    joint: JointFit | None,
) -> list[Message]:
    """Return what keeps a reader from using the values, or should make them careful.

    A correction that outliers spoil, then grids that are worse than their standard deviations, then outliers
    one by one.
    """
    found = []
    if screening.harmful:
        found.append(
            Message(
                f"outliers change corrected coordinates by {screening.change_um:.1f} um (root mean square),"
                f" and a coordinate is uncertain by {screening.sigma_um:.3f} um: the correction is unusable"
            )
        )
    for plate, own in joint.plates.items() if joint else ():
        if own.test and (failed := own.test.problem()):
            text = f"plate {plate}, corrections against {own.sigma_um:.3f} um a priori: {failed}"
            found.append(Message(text))
    places = {
        (case.number, point): place
        for case in session.cases
        for point, place in zip(reversed(case.points.tolist()), reversed(case.places), strict=True)
    }
    found += _outliers(screening, cases, places)
    numbers = {case.number: case for case in session.cases}
    for pointing in _largest(far):
        found.append(numbers[pointing.case].places[pointing.row].message(_far(pointing)))
    return found + _more(len(far), "pointings")


def _outliers(
    screening: Screening, cases: Sequence[PlacedCase], places: Mapping[tuple[int, int], Place]
) -> list[Message]:
    """Name the outliers of the adjustment; a point that is off wherever it was measured only once."""
    plate_of = {case.number: case.case.plate for case in cases}
    measured: dict[tuple[int, int], list[int]] = {}
    for case in cases:
        for point in case.points.tolist():
            measured.setdefault((case.case.plate, point), []).append(case.number)
    off: dict[tuple[int, int], list[Outlier]] = {}
    for outlier in screening.outliers:
        off.setdefault((plate_of[outlier.case], outlier.point), []).append(outlier)
    everywhere = {
        key: own
        for key, own in sorted(off.items())
        if len(own) > 1 and [outlier.case for outlier in own] == measured[key]
    }
    found = [Message(_everywhere(plate, point, own)) for (plate, point), own in everywhere.items()]
    single = [own for own in screening.outliers if (plate_of[own.case], own.point) not in everywhere]
    found += [
        places[own.case, own.point].message(_off_once(own, screening.limit)) for own in _largest(single)
    ]
    return found + _more(len(single), "points")


def _largest(found: Sequence[Found]) -> list[Found]:
    return sorted(found, key=lambda own: own.ratio, reverse=True)[:MOST]


def _more(count: int, what: str) -> list[Message]:
    return [Message(f"{count - MOST} more {what} are off")] if count > MOST else []


def _everywhere(plate: int, point: int, outliers: Sequence[Outlier]) -> str:
    head = f"plate {plate}, point {point}: off in every case in which it was measured: "
    instead = {outlier.instead for outlier in outliers}
    if len(instead) == 1 and None not in instead:
        return f"{head}it lies where point {instead.pop()} is expected: are labels exchanged?"
    return f"{head}are its grid coordinates wrong?"


def _off_once(outlier: Outlier, limit: float) -> str:
    head = (
        f"case {outlier.case}, point {outlier.point}: a residual of {outlier.distance_um:.1f} um,"
        f" {outlier.ratio:.3g} times its standard deviation (limit {limit:.2f})"
    )
    if outlier.instead is None:
        return f"{head}: a blunder?"
    return f"{head}: it lies where point {outlier.instead} is expected: are labels exchanged?"


def _far(pointing: FarPointing) -> str:
    return (
        f"case {pointing.case}, point {pointing.point}: a pointing is {abs(pointing.deviation_um):.1f} um"
        f" from the mean, {pointing.ratio:.3g} times its standard deviation (limit"
        f" {pointing.limit:.2f}): a blunder?"
    )


def plate_remarks(session: Session, cases: Sequence[PlacedCase]) -> list[Message]:
    """Remark on plates whose grid calibration is not valid, and on points that were not measured."""
    remarks = []
    for plate in dict.fromkeys(case.case.plate for case in cases):
        count = len(session.grids[plate].points)
        own = [case for case in cases if case.case.plate == plate]
        corners = [case.orientation.corner for case in own]
        complete = all(len(case.points) == count for case in own)
        if len({corners.count(corner) for corner in range(1, 5)}) > 1 or not complete:
            remarks.append(Message.of("comparator.rotations", plate=str(plate)))
        missing = [count - len(case.points) for case in own]
        remarks += [
            Message(f"case {case.number}: {lacking} of {count} points of plate {plate} are missing")
            for case, lacking in zip(own, missing, strict=True)
            if lacking
        ]
    return remarks
