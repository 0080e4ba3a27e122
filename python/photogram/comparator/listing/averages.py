"""Average residuals and the partial calibration of the grid (subroutine AVGRES, figure 29)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from photogram.comparator.listing.forms import centred, number

if TYPE_CHECKING:
    from photogram.comparator.calibration import PlateResult

__all__ = ["averages_page"]

HEAD = [
    f"{'AVERAGE RESIDUALS BY LOCATION':>69}{'AVERAGE RESIDUALS BY POINT':>36}",
    "  POINT         X ADJ        Y ADJ      LOC.          VX         VY          NO.          VX         VY",
]


def averages_page(title: str, result: PlateResult) -> list[str]:
    """Return a page of average residuals of one plate."""
    averages, listed = result.averages, result.listed
    located = {}
    if averages.locations is not None and averages.location_um is not None:
        located = dict(zip(averages.locations.tolist(), averages.location_um.tolist(), strict=True))
    rows = zip(averages.points.tolist(), averages.xy_um.tolist(), averages.grid_um.tolist(), strict=True)
    lines = []
    for point, (x, y), (grid_x, grid_y) in rows:
        vx, vy = located.get(point, (math.nan, math.nan))
        lines.append(
            f"{point:7d}{number(x, 15, 2)}{number(y, 13, 2)}{point:10d}{number(vx, 13, 3)}{number(vy, 11, 3)}"
            f"{point:13d}{grid_x:12.3f}{grid_y:11.3f}"
        )
    points = len(averages.points)
    squares = (averages.grid_um**2).sum(axis=0)
    of_locations = (
        (math.nan, math.nan) if averages.location_um is None else (averages.location_um**2).sum(axis=0)
    )
    sigmas = [math.sqrt(value / (points - 1)) for value in (*of_locations, *squares)]
    random_x, random_y = listed.random_um
    exchange = "X AND Y OF THE PLATE ARE EXCHANGED (LEFT-HANDED)" if averages.left_handed else ""
    return [
        *centred(title),
        f"PLATE {averages.plate}   {len(averages.cases)} CASES   {exchange}",
        "",
        *HEAD,
        *lines,
        "",
        _sums("SUM VV", (*of_locations, *squares)),
        f"  N = {points}",
        _sums("SIGMA", sigmas),
        f"  STANDARD DEVIATION{number(listed.mean_comparator_um, 43, 4)}{number(listed.mean_grid_um, 47, 4)}",
        "",
        f"RANDOM ERRORS SIGMA X = {number(random_x, 8, 4)}   SIGMA Y = {number(random_y, 8, 4)}",
        f"UNBIASED GRID STANDARD ERROR = {number(listed.grid_um, 8, 4)}  (LISTING)",
        f"UNBIASED GRID STANDARD ERROR = {number(result.text_um, 8, 4)}  (EQUATION 64)",
        f"UNBIASED GRID STANDARD ERROR = {number(result.unbiased_um, 8, 4)}  (ALL PARAMETERS COUNTED)",
        "",
        "NOTE - GRID CALIBRATION CORRECTIONS ARE VALID ONLY IF ALL AVERAGE RESIDUALS ARE COMPUTED FROM A",
        "       MULTIPLE OF FOUR EXACTLY 90 DEGREE ROTATION CASES.",
    ]


def _sums(name: str, values: tuple[float, ...] | list[float]) -> str:
    x, y, grid_x, grid_y = (number(value, 11, 4) for value in values)
    return f"  {name:<45}{x}{y}{'':14}{grid_x}{grid_y}"
