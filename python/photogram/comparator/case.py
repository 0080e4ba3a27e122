"""Preparation of one case: plate orientation, leg intersections, means, close-out."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from photogram.arguments.objects import require
from photogram.arguments.types import Floats, Indices
from photogram.comparator.fits import LEAST_POINTS
from photogram.comparator.grid import Grid
from photogram.comparator.readings import (
    Case,
    PointReadings,
    Precision,
    group,
    group_as_listed,
    pool,
    read_points,
    rows_by_point,
)
from photogram.errors import InputError
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.point_sets import mutually_nearest
from photogram.words import Phrase, phrase

# Quarter rotations that move a corner of the plate to its first corner (least X and Y), with KROTC of the
# listing.
CORNERS = {1: (-1, -1), 4: (1, -1), 3: (1, 1), 2: (-1, 1)}
TURNS = {1: 0, 4: -1, 3: 2, 2: 1}
MATCH = 0.05  # A rotated point must match another one within this part of the spacing
_SQUARED = 1e150  # Micrometres above which squares exceed double precision


@dataclass(frozen=True)
class Orientation:
    """Orientation of a plate on the comparator."""

    # KROTC of the listing, the plate corner nearest the comparator zero. 1: least X, least Y. 2: least X,
    # greatest Y. 3: greatest X, greatest Y. 4: greatest X, least Y
    corner: int
    nearest_point: int  # The point of the plate in that corner
    left_handed: bool  # Whether the axes of the comparator are left-handed relative to the plate


def exchanged(xy: Floats, left_handed: bool) -> Floats:
    """Exchange X and Y if the comparator is left-handed (subroutine FLIPM)."""
    return xy[..., ::-1] if left_handed else xy


def detect_orientation(grid: Grid, points: Indices, xy_um: Floats) -> Orientation:
    """Detect the orientation of a plate from the measurements.

    The sign of the determinant of the affine transformation grid -> comparator gives the handedness. The
    program compares distances of pairs of points from the comparator zero (8 and 12 for point 1, and so on).
    Here, the transformation gives these positions, so the points may be unmeasured or missing on the plate.
    """
    plate = grid.xy_um[grid.rows_of(points)]
    largest = np.abs([plate, xy_um]).max(initial=0.0)
    require(largest < _SQUARED, "x, y", "less", value=float(largest), high=_SQUARED)
    centred = plate - plate.mean(axis=0)
    matrix, _, rank, _ = np.linalg.lstsq(centred, xy_um - xy_um.mean(axis=0), rcond=1e-6)
    if rank < 2:
        raise InputError(phrase("comparators.collinear"))
    low, high = grid.xy_um.min(axis=0), grid.xy_um.max(axis=0)
    middle, quarter = (low + high) / 2, (high - low) / 4

    def distance(offset: tuple[float, float]) -> float:
        place = (middle + quarter * offset - plate.mean(axis=0)) @ matrix + xy_um.mean(axis=0)
        return float(np.hypot(*place))

    sums = {
        corner: distance((sign_x, 0.0)) + distance((0.0, sign_y))
        for corner, (sign_x, sign_y) in CORNERS.items()
    }
    corner = min(sums, key=lambda key: sums[key])
    away = grid.xy_um - (middle + 2 * quarter * CORNERS[corner])
    return Orientation(
        corner=corner,
        nearest_point=int(grid.points[np.hypot(*away.T).argmin()]),
        left_handed=bool(np.linalg.det(matrix) < 0),
    )


def locations(grid: Grid, corner: int) -> Indices | None:
    """Return the comparator location number of each plate point (subroutine COMPVS).

    Locations are numbered like the points of a plate with corner 1 nearest the comparator zero. Returns (l,)
    numbers by row of the plate; None if the rotated pattern does not coincide with itself.
    """
    low, high = grid.xy_um.min(axis=0), grid.xy_um.max(axis=0)
    centred = grid.xy_um - (low + high) / 2
    turned = centred @ np.linalg.matrix_power(np.array([[0, 1], [-1, 0]]), TURNS[corner] % 4)
    # Typical spacing; the least distance may belong to two points outside the pattern.
    spacing = math.sqrt(float((high - low).prod()) / len(centred))
    if spacing == 0:
        return None
    nearest = mutually_nearest(turned, centred, MATCH * spacing)
    if (nearest < 0).any():
        return None
    numbers: Indices = grid.points[nearest]
    return numbers


LEGS = (1, 2, 3, 4)
# Sine of the angle below which line intersections are rejected; plate lines are perpendicular
PARALLEL = 1e-3


def intersect_legs(legs_um: Floats) -> Floats:
    """Return the intersection of the lines through legs 1 and 3, and 2 and 4."""
    first, second, third, fourth = legs_um
    along, across = third - first, fourth - second
    # Solve first + s along = second + t across for s (Cramer).
    determinant = along[1] * across[0] - along[0] * across[1]
    if abs(determinant) <= PARALLEL * float(np.hypot(*along) * np.hypot(*across)):
        raise InputError(phrase("comparators.parallel"))
    gap = second - first
    meeting: Floats = first + (gap[1] * across[0] - gap[0] * across[1]) / determinant * along
    return meeting


def reduce_legs(case: Case) -> tuple[Case, list[Message]]:
    """Replace the leg readings of each point by one intersection.

    Readings of each leg are averaged first. Points with fewer than four legs are omitted with a warning. The
    results are the case and the warnings.
    """
    if not case.legs.any():
        return case, []
    keep = case.legs == 0
    xy_um = case.xy_um.copy()
    messages = list[Message]()
    on_legs = np.flatnonzero(case.legs > 0)
    on_intersections = set(case.points[keep].tolist())
    for point, own_rows in rows_by_point(case.points[on_legs]):
        rows = on_legs[own_rows]
        place = case.places[rows[0]]
        if point in on_intersections:
            raise place.error(phrase("comparators.legs-mixed", point=point))
        legs = [rows[case.legs[rows] == leg] for leg in LEGS]
        present = sum(len(leg) > 0 for leg in legs)
        if present < len(LEGS):
            messages.append(place.message(phrase("comparators.legs", point=point, present=present)))
            continue
        with at_place(place, phrase("comparators.point", case=case.number, point=point)):
            xy_um[rows[0]] = intersect_legs(np.array([case.xy_um[leg].mean(axis=0) for leg in legs]))
        keep[rows[0]] = True
    rows = np.flatnonzero(keep)
    without = replace(
        case,
        points=case.points[rows],
        legs=np.zeros(len(rows), dtype=np.int64),
        xy_um=xy_um[rows],
        places=tuple(case.places[row] for row in rows),
    )
    return without, messages


SCALES = (0.5, 2.0)  # outside it, units of measurements and grid differ


@dataclass(frozen=True, eq=False)
class PlacedCase:
    case: Case
    readings: list[PointReadings]  # in grouping order
    points: Indices  # (n,) point numbers and numbers of readings
    counts: Indices
    means_um: Floats  # (n, 2) mean comparator coordinates
    grid_um: Floats  # (n, 2) grid coordinates, X and Y exchanged if the comparator is left-handed
    orientation: Orientation

    @property
    def number(self) -> int:
        return self.case.number

    @property
    def precision(self) -> Precision:
        """Pointing precision of the case (equations 13 to 24)."""
        return pool(self.readings)


def place_case(case: Case, grid: Grid, *, as_published: bool = False) -> tuple[PlacedCase, list[Message]]:
    """Reduce legs, group readings, form means, and detect the orientation of a case.

    `as_published` orders the points like subroutine GROUP, which may exchange points.
    """
    name = phrase("comparators.case", case=case.number)
    reduced, messages = reduce_legs(case)
    if (count := len(np.unique(reduced.points))) < 3:
        too_few = phrase("comparators.few-points", count=count, least=LEAST_POINTS)
        raise case.place.error(phrase("error.at", what=name, message=too_few))
    order = (group_as_listed if as_published else group)(reduced.points)
    readings = read_points(reduced.points[order], reduced.xy_um[order])
    points = np.array([reading.point for reading in readings])
    means = np.array([reading.mean_um for reading in readings])
    _, first, counts = np.unique(means, axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        at = means[first[counts > 1][0]]
        equal = points[(means == at).all(axis=1)].tolist()
        place = reduced.places[int(np.flatnonzero(reduced.points == equal[1])[0])]
        fields = {"case": reduced.number, "first": equal[0], "second": equal[1]}
        raise place.error(phrase("comparators.equal-points", **fields))
    # Points with several identical readings, possibly copies
    if identical := [reading.point for reading in readings if reading.identical]:
        place = reduced.places[int(np.flatnonzero(reduced.points == identical[0])[0])]
        copied = {"case": reduced.number, "points": ", ".join(map(str, identical))}
        messages.append(place.message(phrase("comparators.identical", **copied)))
    with at_place(case.place, name):
        orientation = detect_orientation(grid, points, means)
    placed = PlacedCase(
        case=case,
        readings=readings,
        points=points,
        counts=np.array([reading.count for reading in readings]),
        means_um=means,
        grid_um=exchanged(grid.xy_um[grid.rows_of(points)], orientation.left_handed),
        orientation=orientation,
    )
    spread, extent = (np.linalg.norm(xy - xy.mean(axis=0)) for xy in (means, placed.grid_um))
    if not SCALES[0] < extent / spread < SCALES[1]:
        scale = float(extent / spread)
        raise case.place.error(phrase("comparators.scale", case=case.number, scale=scale))
    return placed, messages


SUSPECT_UM, REMEASURE_UM = 2.0, 4.0  # mean shifts: check the second point, measure the case again
FEW_READINGS = 9  # largest number of readings of a case that requires a close-out
ENOUGH = 3  # pointings of a close-out


@dataclass(frozen=True, eq=False)
class Closeout:
    """Returns to a point: numbers of pointings per visit, and means (visits, 2)."""

    point: int
    counts: tuple[int, ...]
    means_um: Floats

    @property
    def sequential_shifts_um(self) -> Floats:
        """(visits - 1, 2) mean of each return minus the previous mean."""
        return np.diff(self.means_um, axis=0)

    @property
    def total_shift_um(self) -> Floats | None:
        """(2,) mean of the last visit minus the first one; None without a return."""
        if len(self.counts) < 2:
            return None
        shift: Floats = self.means_um[-1] - self.means_um[0]
        return shift

    @property
    def verdict(self) -> str:
        """`none` (no return), `good`, `suspect` (over 2 um) or `remeasure` (4 um or more)."""
        if self.total_shift_um is None:
            return "none"
        largest = float(np.abs(self.sequential_shifts_um).max(initial=np.abs(self.total_shift_um).max()))
        if largest >= REMEASURE_UM:
            return "remeasure"
        return "suspect" if largest > SUSPECT_UM else "good"


def close_out(case: Case) -> tuple[list[Closeout], list[Message]]:
    """Check the returns to the first point of a case and, if any, to the second."""
    first, *others = dict.fromkeys(case.points.tolist())
    closeouts = [_visits(case, first)]
    if others and len((second := _visits(case, others[0])).counts) > 1:
        closeouts.append(second)
    if len(closeouts[0].counts) < 2 and len(case.points) <= FEW_READINGS:
        fields = {"case": case.number, "count": len(case.points), "point": first}
        raise case.place.error(phrase("comparators.not-closed", **fields))
    return closeouts, [case.place.message(remark) for remark in _remarks(case.number, closeouts)]


def _visits(case: Case, point: int) -> Closeout:
    rows = np.flatnonzero(case.points == point)
    visits = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    means = np.array([case.xy_um[visit].mean(axis=0) for visit in visits])
    return Closeout(point, tuple(len(visit) for visit in visits), means)


def _remarks(case: int, closeouts: list[Closeout]) -> Iterator[Phrase]:
    first = closeouts[0]
    if first.verdict == "none":
        yield phrase("comparators.no-closeout", case=case, point=first.point)
    elif (count := first.counts[-1]) < ENOUGH:
        fields = {"case": case, "point": first.point, "count": count}
        yield phrase("comparators.short-closeout", least=ENOUGH, **fields)
    suspect = "comparators.shifted" if len(closeouts) > 1 else "comparators.shifted-first"
    codes = {"remeasure": "comparators.moved", "suspect": suspect}
    for closeout in closeouts:
        if closeout.verdict in codes:
            shift = float(np.abs(closeout.means_um - closeout.means_um[0]).max())
            yield phrase(codes[closeout.verdict], case=case, point=closeout.point, shift=shift)
