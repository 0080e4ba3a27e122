"""Forms that several pages share."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from photogram.show.angles import degrees_minutes_seconds

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.calibration import CaseResult

__all__ = ["angle", "centred", "nearest", "number", "triangle"]

WIDTH = 110


def centred(title: str) -> list[str]:
    """Return a title with a blank line below."""
    return [title.center(WIDTH), ""]


def nearest(case: CaseResult) -> str:
    """Return the line on the orientation of a case."""
    point = case.placed.orientation.nearest_point
    return f"GRID POINT {point} IS NEAREST THE COMPARATOR ORIGIN"


def number(value: float | None, width: int, decimals: int) -> str:
    """Return a number in its field; a missing one as a dash."""
    if value is None or math.isnan(value):
        return "-".rjust(width)
    return f"{value:{width}.{decimals}f}"


def angle(radians: float) -> str:
    """Return an angle in degrees, minutes and seconds of arc."""
    degrees, minutes, seconds = degrees_minutes_seconds(radians, 3)
    sign = "-" if radians < 0 and (degrees or minutes or seconds) else " "
    return f"{sign}{degrees:3d} DEG {minutes:2d} MIN {seconds:6.3f} SEC"


def triangle(names: Iterable[str], matrix: Floats) -> list[str]:
    """Return the lower triangle of a covariance matrix, with names."""
    rows = []
    for row, name in enumerate(names):
        values = "".join(f"{value:13.5E}" for value in np.asarray(matrix)[row, : row + 1])
        rows.append(f"  {name:<8}{values}")
    return rows
