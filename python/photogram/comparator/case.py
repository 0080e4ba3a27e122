"""One case ready for adjustment: means of its points, and the grid in the handedness of the comparator."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.grouping import group, group_as_listed
from photogram.comparator.legs import reduce_legs
from photogram.comparator.orientation import Orientation, detect_orientation, exchanged
from photogram.comparator.pointing import PointReadings, pool, read_points
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.grid import Grid
    from photogram.comparator.pointing import Precision
    from photogram.comparator.readings import Case, Integers
    from photogram.messages import Message

__all__ = ["PlacedCase", "place_case"]

SCALES = (0.5, 2.0)
"""A scale beyond these means that measurements and grid are in different units."""


@dataclass(frozen=True, eq=False)
class PlacedCase:
    """A case with its means.

    Attributes
    ----------
    case
        The case as it was measured.
    readings
        Its points with their means and sums of squares, in the order of the grouping.
    points, counts
        (n,) their numbers, and how often each was read.
    means_um
        (n, 2) mean comparator coordinates.
    grid_um
        (n, 2) grid coordinates, X and Y exchanged where the comparator is left-handed.
    orientation
        How the plate lies.
    from_legs
        Points that were measured on their legs.
    """

    case: Case
    readings: list[PointReadings]
    points: Integers
    counts: Integers
    means_um: Floats
    grid_um: Floats
    orientation: Orientation
    from_legs: frozenset[int]

    @property
    def number(self) -> int:
        """Number of the case."""
        return self.case.number

    @property
    def precision(self) -> Precision:
        """Pointing precision of the case (equations 13 to 24)."""
        return pool(self.readings)


def place_case(case: Case, grid: Grid, *, as_listed: bool = False) -> tuple[PlacedCase, list[Message]]:
    """Reduce legs, group readings, form means, and detect how the plate lies.

    Parameters
    ----------
    case, grid
        The case and its plate.
    as_listed
        Bring points into the order of the listing.

    Raises
    ------
    InputError
        Parallel legs; two points read at one place; points in one line; measurements in another unit.
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


def _refuse_equal_places(case: Case, points: Integers, means: Floats) -> None:
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
