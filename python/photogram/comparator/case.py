"""One case ready for adjustment: how its plate lies, intersections of legs, means in order of the points."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.comparator.grid import Grid
from photogram.comparator.pointing import (
    PointReadings,
    Precision,
    group,
    group_as_listed,
    pool,
    read_points,
    rows_by_point,
)
from photogram.comparator.readings import Case
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.neighbours import mutually_nearest

# Quarter turns that bring a corner of the plate to the place of its first corner (least X and Y), with the
# listing's KROTC.
CORNERS = {1: (-1, -1), 4: (1, -1), 3: (1, 1), 2: (-1, 1)}
TURNS = {1: 0, 4: -1, 3: 2, 2: 1}
MATCH = 0.05  # A turned point must meet another one within this part of the spacing
_SQUARED = 1e150  # Micrometres beyond which squares leave the range of double precision


@dataclass(frozen=True)
class Orientation:
    """How a plate lies on the comparator.

    Attributes
    ----------
    corner
        1 to 4, the listing's KROTC: the corner nearest the comparator's zero is that with least X and Y (1),
        least X and greatest Y (2), greatest X and Y (3), greatest X and least Y (4).
    nearest_point
        The point of the plate in that corner.
    left_handed
        Whether the axes of the comparator are left-handed against those of the plate.
    """

    corner: int
    nearest_point: int
    left_handed: bool


def exchanged(xy: Floats, left_handed: bool) -> Floats:
    """Exchange X and Y where the comparator is left-handed (subroutine FLIPM)."""
    return xy[..., ::-1] if left_handed else xy


def detect_orientation(grid: Grid, points: Indices, xy_um: Floats) -> Orientation:
    """Detect from the measurements how a plate lies.

    The sign of the determinant of the affine transformation grid -> comparator is the handedness. The program
    compares sums of distances of two points each from the comparator's zero (8 and 12 for point 1, and so
    on); here the places of these points follow from the transformation, so that they need not be measured,
    nor be on the plate.
    """
    plate = grid.xy_um[grid.rows_of(points)]
    largest = np.abs([plate, xy_um]).max(initial=0.0)
    if not largest < _SQUARED:
        raise InputError(f"coordinates of points are too large to compute with: {largest:g} um")
    centred = plate - plate.mean(axis=0)
    matrix, _, rank, _ = np.linalg.lstsq(centred, xy_um - xy_um.mean(axis=0), rcond=1e-6)
    if rank < 2:
        raise InputError("the points measured lie in one line")
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
    """Return the number of the comparator location at which each point of the plate lies (subroutine COMPVS).

    Locations are numbered like the points of a plate that lies with corner 1 nearest the comparator's zero.

    Returns (l,) numbers, row by row of the plate; None where the turned pattern does not meet itself.
    """
    low, high = grid.xy_um.min(axis=0), grid.xy_um.max(axis=0)
    centred = grid.xy_um - (low + high) / 2
    turned = centred
    for _ in range(TURNS[corner] % 4):
        turned = np.column_stack([-turned[:, 1], turned[:, 0]])
    # Typical of neighbours; the least distance may be that of two points outside the pattern.
    spacing = math.sqrt(float((high - low).prod()) / len(centred))
    if spacing == 0:
        return None
    nearest = mutually_nearest(turned, centred, MATCH * spacing)
    if (nearest < 0).any():
        return None
    numbers: Indices = grid.points[nearest]
    return numbers


LEGS = (1, 2, 3, 4)
# Sine of the angle below which lines do not intersect usefully; those of a plate cross at right angles
PARALLEL = 1e-3


@dataclass(frozen=True)
class LegPoint:
    """A point that its legs determine: its number and how many readings each leg has."""

    point: int
    readings: tuple[int, int, int, int]


def intersect_legs(legs_um: Floats) -> Floats:
    """Return where the line through legs 1 and 3 meets the one through legs 2 and 4.

    Parameters
    ----------
    legs_um
        (4, 2) mean coordinates of the legs.
    """
    first, second, third, fourth = legs_um
    along, across = third - first, fourth - second
    # Solve first + s along = second + t across for s (Cramer).
    determinant = along[1] * across[0] - along[0] * across[1]
    if abs(determinant) <= PARALLEL * float(np.hypot(*along) * np.hypot(*across)):
        raise InputError("NO INTERSECTION FOR PARALLEL LINES")
    gap = second - first
    meeting: Floats = first + (gap[1] * across[0] - gap[0] * across[1]) / determinant * along
    return meeting


def reduce_legs(case: Case) -> tuple[Case, list[LegPoint], list[Message]]:
    """Put one intersection in the place of the leg readings of each point.

    The readings of each leg are averaged first. A point with fewer than four legs is left out, with a remark.
    """
    if not case.legs.any():
        return case, [], []
    keep = case.legs == 0
    xy_um = case.xy_um.copy()
    reduced, messages = [], []
    on_legs = np.flatnonzero(case.legs > 0)
    on_intersections = set(case.points[keep].tolist())
    for point, own_rows in rows_by_point(case.points[on_legs]):
        rows = on_legs[own_rows]
        place = case.places[rows[0]]
        if point in on_intersections:
            raise place.error(f"point {point} is measured both on its intersection and on its legs")
        own = [rows[case.legs[rows] == leg] for leg in LEGS]
        present = sum(len(leg) > 0 for leg in own)
        if present < len(LEGS):
            messages.append(
                place.message(f"POINT NUMBER {point} IS REJECTED BECAUSE ONLY {present} LEGS WERE READ.")
            )
            continue
        try:
            xy_um[rows[0]] = intersect_legs(np.array([case.xy_um[leg].mean(axis=0) for leg in own]))
        except InputError as error:
            raise place.error(f"case {case.number}, point {point}: {error.message}") from None
        keep[rows[0]] = True
        counts = [len(leg) for leg in own]
        reduced.append(LegPoint(point, (counts[0], counts[1], counts[2], counts[3])))
    kept = np.flatnonzero(keep)
    without = replace(
        case,
        points=case.points[kept],
        legs=np.zeros(len(kept), dtype=np.int64),
        xy_um=xy_um[kept],
        places=tuple(case.places[row] for row in kept),
    )
    return without, reduced, messages


SCALES = (0.5, 2.0)  # A scale beyond these means that measurements and grid are in different units


@dataclass(frozen=True, eq=False)
class PlacedCase:
    """A case with its means."""

    case: Case  # The case as it was measured
    # Its points with their means and sums of squares, in the order of the grouping
    readings: list[PointReadings]
    points: Indices  # (n,) their numbers, and how often each was read
    counts: Indices
    means_um: Floats  # (n, 2) mean comparator coordinates
    grid_um: Floats  # (n, 2) grid coordinates, X and Y exchanged where the comparator is left-handed
    orientation: Orientation  # How the plate lies
    from_legs: frozenset[int]  # Points that were measured on their legs

    @property
    def number(self) -> int:
        """Number of the case."""
        return self.case.number

    @property
    def precision(self) -> Precision:
        """Pointing precision of the case (equations 13 to 24)."""
        return pool(self.readings)


def place_case(case: Case, grid: Grid, *, as_listed: bool = False) -> tuple[PlacedCase, list[Message]]:
    """Reduce legs, group readings (as the listing does if asked), form means, and detect how the plate lies.

    Raises InputError: parallel legs; two points read at one place; points in one line; measurements in
    another unit.
    """
    reduced, legs, messages = reduce_legs(case)
    if len(np.unique(reduced.points)) < 3:
        raise case.place.error(
            f"case {case.number} has {len(np.unique(reduced.points))} points;"
            " a linear adjustment needs at least 4"
        )
    order = (group_as_listed if as_listed else group)(reduced.points)
    readings = read_points(reduced.points[order], reduced.xy_um[order])
    points = np.array([reading.point for reading in readings])
    means = np.array([reading.mean_um for reading in readings])
    _refuse_equal_places(reduced, points, means)
    messages += _identical(reduced, readings)
    try:
        orientation = detect_orientation(grid, points, means)
    except InputError as error:
        raise case.place.error(f"case {case.number}: {error.message}") from None
    placed = PlacedCase(
        case=case,
        readings=readings,
        points=points,
        counts=np.array([reading.count for reading in readings]),
        means_um=means,
        grid_um=exchanged(grid.xy_um[grid.rows_of(points)], orientation.left_handed),
        orientation=orientation,
        from_legs=frozenset(leg.point for leg in legs),
    )
    _refuse_other_unit(placed)
    return placed, messages


def _identical(case: Case, readings: list[PointReadings]) -> list[Message]:
    """Remark on points whose readings do not vary at all, as if they had been copied."""
    points = [reading.point for reading in readings if reading.identical]
    if not points:
        return []
    place = case.places[int(np.flatnonzero(case.points == points[0])[0])]
    listed = ", ".join(str(point) for point in points)
    return [place.message(f"case {case.number}: ALL READINGS FOR POINT NO {listed} ARE IDENTICAL")]


def _refuse_equal_places(case: Case, points: Indices, means: Floats) -> None:
    """Two points of a plate are never at one place: one of them has the wrong number, or was not measured."""
    _, first, counts = np.unique(means, axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        at = means[first[counts > 1][0]]
        equal = points[(means == at).all(axis=1)].tolist()
        place = case.places[int(np.flatnonzero(case.points == equal[1])[0])]
        raise place.error(f"case {case.number}: points {equal[0]} and {equal[1]} have identical readings")


def _refuse_other_unit(placed: PlacedCase) -> None:
    spread = np.linalg.norm(placed.means_um - placed.means_um.mean(axis=0))
    scale = float(np.linalg.norm(placed.grid_um - placed.grid_um.mean(axis=0)) / spread)
    if not SCALES[0] < scale < SCALES[1]:
        raise placed.case.place.error(
            f"case {placed.number}: the grid is {scale:.4g} times the measured size: are the units mixed?"
        )
