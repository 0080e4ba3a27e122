"""Points measured on the four legs of their lines instead of on the intersection (subroutine LINLIN)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.grouping import rows_by_point
from photogram.comparator.readings import Case
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.messages import Message

__all__ = ["LegPoint", "intersect_legs", "reduce_legs"]

LEGS = (1, 2, 3, 4)
PARALLEL = 1e-3
"""Sine of the angle below which lines do not intersect usefully; those of a plate cross at right angles."""


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

    Raises
    ------
    InputError
        The lines are parallel, or two legs of one line coincide.
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

    Raises
    ------
    InputError
        Lines that are parallel, with the place of the first reading of the point; a point measured both on
        its intersection and on its legs.
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
