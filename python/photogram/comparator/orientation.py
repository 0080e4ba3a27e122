"""How the plate lies: its corner nearest the comparator's zero, its upper side (main program, COMPVS)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.neighbours import mutually_nearest

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.grid import Grid
    from photogram.comparator.readings import Integers

__all__ = ["Orientation", "detect_orientation", "exchanged", "locations"]

# Quarter turns that bring a corner of the plate to the place of its first corner (least X and Y), with the
# listing's KROTC.
CORNERS = {1: (-1, -1), 4: (1, -1), 3: (1, 1), 2: (-1, 1)}
TURNS = {1: 0, 4: -1, 3: 2, 2: 1}
MATCH = 0.05
"""A turned point must meet another one within this part of the spacing."""
_SQUARED = 1e150
"""Micrometres beyond which squares leave the range of double precision."""


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


def detect_orientation(grid: Grid, points: Integers, xy_um: Floats) -> Orientation:
    """Detect from the measurements how a plate lies.

    The sign of the determinant of the affine transformation grid -> comparator is the handedness. The program
    compares sums of distances of two points each from the comparator's zero (8 and 12 for point 1, and so
    on); here the places of these points follow from the transformation, so that they need not be measured,
    nor be on the plate.

    Raises
    ------
    InputError
        The points lie in a line, or fewer than three are there; coordinates whose squares are no numbers.
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


def locations(grid: Grid, corner: int) -> Integers | None:
    """Return the number of the comparator location at which each point of the plate lies (subroutine COMPVS).

    Locations are numbered like the points of a plate that lies with corner 1 nearest the comparator's zero.

    Returns
    -------
    (l,) numbers, row by row of the plate; None where the turned pattern does not meet itself.
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
    numbers: Integers = grid.points[nearest]
    return numbers
