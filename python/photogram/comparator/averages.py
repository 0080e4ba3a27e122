"""Average residuals by grid point and by comparator location (subroutine AVGRES)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.orientation import exchanged, locations
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.case import PlacedCase
    from photogram.comparator.grid import Grid
    from photogram.comparator.readings import Integers
    from photogram.comparator.residuals import Residuals

__all__ = ["LocationAverages", "PlateAverages", "average_residuals"]

SAME_PLACE = 0.25
"""Locations nearer to each other than this part of the spacing of the plate are one."""


@dataclass(frozen=True, eq=False)
class LocationAverages:
    """Average comparator residuals of the cases in which the plate lay at one place of the comparator.

    Attributes
    ----------
    cases
        Numbers of these cases.
    locations
        (m,) numbers of the comparator locations: those of the plate with corner 1 nearest the comparator's
        zero.
    xy_um
        (m, 2) where they are: mean comparator coordinates.
    residuals_um
        (m, 2) averages of the comparator residuals there.
    """

    cases: tuple[int, ...]
    locations: Integers
    xy_um: Floats
    residuals_um: Floats


@dataclass(frozen=True, eq=False)
class PlateAverages:
    """Average residuals of the cases of one plate, in the axes of its first case.

    X and Y are exchanged against the axes of the plate where that case is left-handed (`left_handed`), as the
    report prints them.

    Attributes
    ----------
    plate
        Number of the plate.
    left_handed
        Whether X and Y are exchanged.
    cases
        Numbers of the cases.
    points
        (l,) points of the plate that were measured.
    counts
        (l,) in how many cases.
    grid_um
        (l, 2) averages of the grid residuals by point: the corrections of the grid.
    squares_um2
        (2,) sums of squares of all grid residuals in X and in Y.
    by_location
        Averages of the comparator residuals, for each place where the plate lay; none where the pattern of
        the plate does not meet itself when the plate is turned.
    xy_um
        (l, 2) coordinates of the last case with corner 1 nearest the comparator's zero, else of the last
        case; NaN where missing.
    """

    plate: int
    left_handed: bool
    cases: tuple[int, ...]
    points: Integers
    counts: Integers
    grid_um: Floats
    squares_um2: Floats
    by_location: tuple[LocationAverages, ...]
    xy_um: Floats

    @property
    def location_um(self) -> Floats:
        """(m, 2) averages by location, of all places."""
        return np.vstack([np.empty((0, 2)), *(place.residuals_um for place in self.by_location)])

    @property
    def corrections_um(self) -> Floats:
        """(l, 2) corrections of the grid in the axes of the plate: to be added to the given coordinates."""
        return exchanged(self.grid_um, self.left_handed)


def average_residuals(
    grid: Grid, cases: Sequence[PlacedCase], residuals: Sequence[Residuals]
) -> PlateAverages:
    """Average the residuals of all cases of one plate.

    Parameters
    ----------
    grid
        The plate.
    cases, residuals
        Its cases, and the residuals of one stage of the adjustment.
    """
    left_handed = cases[0].orientation.left_handed
    rows = [grid.rows_of(case.points) for case in cases]
    values = [
        exchanged(own.grid_um, case.orientation.left_handed != left_handed)
        for case, own in zip(cases, residuals, strict=True)
    ]
    all_rows, all_values = np.concatenate(rows), np.vstack(values)
    counts = np.bincount(all_rows, minlength=len(grid.points))
    measured = np.flatnonzero(counts)
    last = max(range(len(cases)), key=lambda k: (cases[k].orientation.corner == 1, k))
    xy = np.full((len(grid.points), 2), np.nan)
    xy[rows[last]] = residuals[last].xy_um
    return PlateAverages(
        plate=grid.number,
        left_handed=left_handed,
        cases=tuple(case.number for case in cases),
        points=grid.points[measured],
        counts=counts[measured],
        grid_um=_means(all_rows, all_values, len(grid.points))[measured],
        squares_um2=(all_values**2).sum(axis=0),
        by_location=_by_location(grid, cases, residuals),
        xy_um=xy[measured],
    )


def _by_location(
    grid: Grid, cases: Sequence[PlacedCase], residuals: Sequence[Residuals]
) -> tuple[LocationAverages, ...]:
    """Average by location; cases whose plate lay elsewhere have other locations, whatever their numbers."""
    maps = {case.orientation.corner: locations(grid, case.orientation.corner) for case in cases}
    rows = []
    for case in cases:
        numbers = maps[case.orientation.corner]
        if numbers is None:
            return ()
        rows.append(grid.rows_of(numbers[grid.rows_of(case.points)]))
    extent = np.ptp(grid.xy_um, axis=0)
    apart = SAME_PLACE * math.sqrt(float(extent.prod()) / len(grid.points))
    together: list[tuple[list[int], Floats]] = []
    for k, own in enumerate(residuals):
        for members, places in together:
            away = np.abs(own.xy_um - places[rows[k]])
            if np.isfinite(away).any() and np.nanmax(away) < apart:
                members.append(k)
                known = np.isfinite(places[rows[k], 0])
                places[rows[k][~known]] = own.xy_um[~known]
                break
        else:
            places = np.full((len(grid.points), 2), np.nan)
            places[rows[k]] = own.xy_um
            together.append(([k], places))
    return tuple(_averaged(grid, members, cases, rows, residuals) for members, _ in together)


def _averaged(
    grid: Grid,
    members: list[int],
    cases: Sequence[PlacedCase],
    rows: Sequence[Integers],
    residuals: Sequence[Residuals],
) -> LocationAverages:
    own = np.concatenate([rows[k] for k in members])
    places = _means(own, np.vstack([residuals[k].xy_um for k in members]), len(grid.points))
    values = _means(own, np.vstack([residuals[k].comparator_um for k in members]), len(grid.points))
    measured = np.isfinite(values[:, 0])
    return LocationAverages(
        tuple(cases[k].number for k in members), grid.points[measured], places[measured], values[measured]
    )


def _means(rows: Integers, values: Floats, count: int) -> Floats:
    """Average values by row; NaN where there are none."""
    counts = np.bincount(rows, minlength=count)
    sums = np.column_stack([np.bincount(rows, weights=values[:, axis], minlength=count) for axis in range(2)])
    means: Floats = np.divide(
        sums, counts[:, np.newaxis], out=np.full(sums.shape, np.nan), where=counts[:, None] > 0
    )
    return means
