"""Common forms of several pages, and the residuals of one case (subroutine VSPRINT; figures 16 to 25)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.fits import Residuals
from photogram.io.angles import degrees_minutes_seconds

if TYPE_CHECKING:
    from photogram.comparator import CaseResult

WIDTH = 110


def centred(title: str) -> list[str]:
    """Return a title with a blank line below."""
    return [title.center(WIDTH), ""]


def nearest(case: CaseResult) -> str:
    """Return the orientation line of a case."""
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


HEAD = [
    "                                         RESIDUALS, MEASURED SYSTEM            RESIDUALS, GRID SYSTEM",
    "  PT.NO.        X ADJ        Y ADJ           VX         VY            NO.          VX         VY",
]


def residual_page(title: str, case: CaseResult, residuals: Residuals) -> list[str]:
    """Return a page of residuals."""
    return [*centred(title), nearest(case), "", *residual_lines(residuals)]


def residual_lines(residuals: Residuals) -> list[str]:
    """Return the table of residuals with its sums, in micrometres."""
    rows = zip(
        residuals.points.tolist(),
        residuals.xy_um.tolist(),
        residuals.comparator_um.tolist(),
        residuals.grid_um.tolist(),
        strict=True,
    )
    lines = [
        f"{point:7d}{x:15.2f}{y:13.2f}{vx:13.3f}{vy:11.3f}{point:15d}{gx:12.3f}{gy:11.3f}"
        for point, (x, y), (vx, vy), (gx, gy) in rows
    ]
    squares = sums("SUM VV", residuals.squares_um2, 35, 15)
    sigma = sums("SIGMA", residuals.sigma_um, 35, 15)
    unit = f"STANDARD ERROR OF UNIT WEIGHT ={number(residuals.sigma0_um, 9, 4)} MICRONS"
    return [*HEAD, *lines, "", squares, f"  N = {len(residuals.points)}", sigma, "", unit]


def sums(name: str, values: Iterable[float], width: int, gap: int) -> str:
    """Return a line of sums in both systems."""
    x, y, grid_x, grid_y = (number(value, 11, 4) for value in values)
    return f"  {name:<{width}}{x}{y}{'':{gap}}{grid_x}{grid_y}"
