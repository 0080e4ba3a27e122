"""Outliers among pointings and point means after the adjustment, and messages on them.

Prior standard deviations are unknown. Residuals are compared with the other measurements (externally
studentized, :mod:`photogram.statistics`). Outliers of the adjustment are removed and the rest is readjusted
until none remains. The change of the corrections is the effect of the outliers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.comparator.averages import Reduction
from photogram.comparator.case import PlacedCase, exchanged
from photogram.comparator.fits import fit_affine, fit_rigid, rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.joint import JointFit
from photogram.comparator.readings import Case, Session
from photogram.comparator.variance import (
    CombinedLinear,
    CombinedPolynomial,
    combine_linear,
    combine_polynomial,
)
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.show.quantity import members
from photogram.statistics.limits import externally_studentized, studentized_limit
from photogram.words import phrase

MAX_ROUNDS = 30  # of removal: each removes residuals of at least half the largest
LEAST_POINTS = 6  # per case; the search ends before a case has fewer
# Outliers are at least a nanometre: residuals of error-free measurements are rounding errors
LEAST_UM = 1e-3
MATCH = 0.1  # A point measured instead of another one is within this part of their distance


@dataclass(frozen=True)
class FarPointing:
    """Pointing that is inconsistent with the others of its case."""

    case: int  # Numbers of case and point; index of the pointing in the case, from 0
    point: int
    row: int
    deviation_um: float  # Deviation from the mean of the point, in the inconsistent coordinate
    ratio: float  # The deviation over its standard deviation, from the other pointings of the case
    limit: float  # Critical value of the ratio


@dataclass(frozen=True)
class Outlier:
    """Measured point that is inconsistent with the adjustment of the others."""

    case: int  # Numbers
    point: int
    # Measured minus expected comparator coordinates, from the adjustment without outliers
    off_um: tuple[float, float]
    ratio: float  # The residual over its standard deviation at its removal
    instead: int | None  # The plate point expected at this position, or None

    @property
    def distance_um(self) -> float:
        return math.hypot(*self.off_um)


@dataclass(frozen=True)
class Screening:
    outliers: tuple[Outlier, ...]  # By case, then by point
    limit: float  # Critical value of the ratios of all coordinates at the level of 5 percent
    # Effect of the outliers on corrected coordinates: root mean square over the measured points, without
    # rotation and translation. 0 without outliers
    change_um: float
    sigma_um: float  # Standard deviation of unit weight without the outliers
    # (k, 2) absolute test values of all points of each case before the first removal
    ratios: tuple[Floats, ...]
    freedom: float  # Degrees of freedom without the outliers

    @property
    def harmful(self) -> bool:
        """Whether outliers change corrected coordinates by more than their uncertainty."""
        return self.change_um > self.sigma_um


@dataclass(frozen=True, eq=False)
class PointingTests:
    case: Case  # The case
    deviations: Floats  # (k, 2) from the mean of the point or leg
    ratios: Floats  # (k, 2) externally studentized; 0 for single pointings
    freedom: int  # Degrees of freedom of the standard deviation in x, and in y


def pointing_tests(cases: Sequence[Case]) -> list[PointingTests]:
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
    """Return outlying pointings; `others` tests share the level with these."""
    outlying = []
    number = sum(test.ratios.size for test in tests) + others
    for test in tests:
        limit = studentized_limit(test.freedom, number)
        worst = np.abs(test.ratios).argmax(axis=1)
        rows = np.arange(len(worst))
        for row in np.flatnonzero(np.abs(test.ratios[rows, worst]) > limit).tolist():
            deviation, ratio = (float(values[row, worst[row]]) for values in (test.deviations, test.ratios))
            point = int(test.case.points[row])
            outlying.append(FarPointing(test.case.number, point, row, deviation, abs(ratio), limit))
    return outlying


def screen(
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
    grids: Mapping[int, Grid],
    others: int = 0,
) -> Screening:
    """Return measured points that are outliers of the last stage.

    `others` is the number of tests that share the level with these.
    """
    remaining = list(cases)
    removed: list[tuple[int, int, float]] = []
    clean, limit = stage, math.inf
    first: tuple[tuple[Floats, ...], float] | None = None
    for _ in range(MAX_ROUNDS):
        tests, freedom = _ratios(remaining, clean)
        first = first or (tuple(tests), freedom)
        ratios = [values.max(axis=1) for values in tests]
        limit = studentized_limit(freedom, 2 * sum(map(len, ratios)) + others)
        worst = max(float(values.max()) for values in ratios)
        if not worst > limit:
            break
        outlying = [values >= max(limit, worst / 2) for values in ratios]
        rest = [_without(case, out) for case, out in zip(remaining, outlying, strict=True)]
        if min(len(case.points) for case in rest) < LEAST_POINTS:
            break
        try:
            fits = [fit_affine(case.points, case.means_um, case.grid_um) for case in rest]
            linear = combine_linear(rest, fits)
            curved = isinstance(stage, CombinedPolynomial)
            clean = combine_polynomial(rest, linear) if curved else linear
        except AdjustmentError:
            break
        for k, (case, values, out) in enumerate(zip(remaining, ratios, outlying, strict=True)):
            removed += [(k, int(case.points[row]), float(values[row])) for row in np.flatnonzero(out)]
        remaining = rest
    outliers = tuple(
        _outlier(cases[k], grids[cases[k].case.plate], clean, k, point, ratio)
        for k, point, ratio in sorted(removed)
    )
    change = 0.0
    if outliers:  # root mean square at the measured points, without rotation and shift
        places = np.vstack([case.means_um for case in cases])
        corrected = stage.correction.apply(places), clean.correction.apply(places)
        residuals = fit_rigid(np.arange(len(places)), *corrected).residuals.grid_um
        change = math.sqrt(float((residuals**2).mean()))
    assert first is not None
    return Screening(outliers, limit, change, clean.sigma0_um, *first)


def _ratios(
    cases: Sequence[PlacedCase], stage: CombinedLinear | CombinedPolynomial
) -> tuple[list[Floats], float]:
    """Return absolute studentized residuals (k, 2) per case, and the trace of R R^T.

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


def _outlier(
    case: PlacedCase,
    grid: Grid,
    stage: CombinedLinear | CombinedPolynomial,
    index: int,
    point: int,
    ratio: float,
) -> Outlier:
    """Compare a measured point with its expected position and its neighbours."""
    fit = stage.cases[index]
    row = int(np.flatnonzero(case.points == point)[0])
    measured = stage.correction.apply(case.means_um[row : row + 1])[0]
    plate = exchanged(grid.xy_um, case.orientation.left_handed)
    places = (plate - fit.translation_um) @ rotation_matrix(fit.rotation_rad)
    expected = places[int(np.flatnonzero(grid.points == point)[0])]
    nearest = int(np.hypot(*(places - measured).T).argmin())
    near = math.dist(places[nearest], measured) < MATCH * math.dist(places[nearest], expected)
    x, y = (measured - expected).tolist()
    return Outlier(case.number, point, (x, y), ratio, int(grid.points[nearest]) if near else None)


MAX_NAMED = 40  # largest outliers of each type


def problems(
    session: Session,
    cases: Sequence[PlacedCase],
    screening: Screening,
    far: Sequence[FarPointing],
    joint: JointFit | None,
) -> list[Message]:
    """Return problems: an unusable correction, grids worse than their standard deviations, outliers."""
    messages = []
    if screening.harmful:
        harm = phrase("comparators.harm", change=screening.change_um, sd=screening.sigma_um)
        messages.append(Message(harm))
    for plate, result in joint.plates.items() if joint else ():
        if result.test and (reason := result.test.problem()):
            text = phrase("comparators.grid-test", plate=plate, sd=result.sigma_um, reason=reason)
            messages.append(Message(text))
    by_point: dict[tuple[int, int], list[Outlier]] = {}
    numbers = {case.number: case for case in session.cases}
    for outlier in screening.outliers:
        by_point.setdefault((numbers[outlier.case].plate, outlier.point), []).append(outlier)
    single: list[tuple[float, Message]] = []
    for (plate, point), outliers in sorted(by_point.items()):
        measured = [case.number for case in cases if case.case.plate == plate and point in case.points]
        if len(outliers) > 1 and [outlier.case for outlier in outliers] == measured:
            instead = {outlier.instead for outlier in outliers}
            code = "wrong-point" if len(instead) > 1 or None in instead else "exchanged"
            fields = {"plate": plate, "point": point, "instead": instead.pop()}
            messages.append(Message(phrase(f"comparators.{code}", **fields)))
            continue
        for outlier in outliers:
            code = "outlier" if outlier.instead is None else "outlier-exchanged"
            fields = members(outlier, "case", "point", "ratio", "instead", distance="distance_um")
            text = phrase(f"comparators.{code}", limit=screening.limit, **fields)
            case = numbers[outlier.case]
            place = case.places[case.points.tolist().index(point)]
            single.append((outlier.ratio, place.message(text)))
    pointings = []
    for pointing in far:
        fields = members(pointing, "case", "point", "ratio", "limit")
        text = phrase("comparators.far-pointing", distance=abs(pointing.deviation_um), **fields)
        pointings.append((pointing.ratio, numbers[pointing.case].places[pointing.row].message(text)))
    return [*messages, *_largest(single, "more-outliers"), *_largest(pointings, "more-pointings")]


def _largest(messages: list[tuple[float, Message]], code: str) -> list[Message]:
    """Return the messages with the largest ratios, and the number of others."""
    ordered = [message for _, message in sorted(messages, key=lambda each: each[0], reverse=True)]
    more = len(ordered) - MAX_NAMED
    rest = [Message(phrase(f"comparators.{code}", count=more))] if more > 0 else []
    return ordered[:MAX_NAMED] + rest


def plate_remarks(session: Session, cases: Sequence[PlacedCase]) -> list[Message]:
    """Return warnings on invalid grid calibrations and unmeasured points."""
    remarks = []
    for plate in dict.fromkeys(case.case.plate for case in cases):
        count = len(session.grids[plate].points)
        on_plate = [case for case in cases if case.case.plate == plate]
        corners = [case.orientation.corner for case in on_plate]
        missing = {case.number: count - len(case.points) for case in on_plate}
        if len({corners.count(corner) for corner in range(1, 5)}) > 1 or any(missing.values()):
            remarks.append(Message.of("comparator.rotations", plate=str(plate)))
        remarks += [
            Message(phrase("comparators.missing", case=case, n=points, count=count, plate=plate))
            for case, points in missing.items()
            if points
        ]
    return remarks
