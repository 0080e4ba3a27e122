"""Average residuals and the partial calibration of the grid (subroutine AVGRES, figure 29)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.listing.forms import centred, number

if TYPE_CHECKING:
    from photogram.comparator.averages import LocationAverages
    from photogram.comparator.calibration import PlateResult

__all__ = ["averages_page"]

HEAD = [
    f"{'AVERAGE RESIDUALS BY LOCATION':>69}{'AVERAGE RESIDUALS BY POINT':>36}",
    "  POINT         X ADJ        Y ADJ      LOC.          VX         VY          NO.          VX         VY",
]


def averages_page(title: str, result: PlateResult) -> list[str]:
    """Return a page of average residuals of one plate."""
    averages, listed = result.averages, result.listed
    first = averages.by_location[0] if averages.by_location else None
    located = _located(first) if first else {}
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
    places = len(averages.location_um)
    of_locations = (averages.location_um**2).sum(axis=0) if places else np.full(2, math.nan)
    sigmas = [
        *(math.sqrt(value / (places - 1)) if places else math.nan for value in of_locations),
        *(math.sqrt(value / (points - 1)) for value in squares),
    ]
    random_x, random_y = listed.random_um
    exchange = "X AND Y OF THE PLATE ARE EXCHANGED (LEFT-HANDED)" if averages.left_handed else ""
    return [
        *centred(title),
        f"PLATE {averages.plate}   {len(averages.cases)} CASES   {exchange}",
        "",
        *HEAD,
        *lines,
        *(line for place in averages.by_location[1:] for line in _elsewhere(place)),
        "",
        _sums("SUM VV", (*of_locations, *squares)),
        f"  N = {points}" if places in (0, points) else f"  N = {places} LOCATIONS, {points} POINTS",
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


def _located(place: LocationAverages) -> dict[int, list[float]]:
    return dict(zip(place.locations.tolist(), place.residuals_um.tolist(), strict=True))


def _elsewhere(place: LocationAverages) -> list[str]:
    """Return the averages by location of the cases whose plate lay at another place."""
    cases = " ".join(str(case) for case in place.cases)
    rows = zip(place.locations.tolist(), place.xy_um.tolist(), place.residuals_um.tolist(), strict=True)
    return [
        "",
        f"  THE PLATE LAY AT ANOTHER PLACE IN CASES {cases}: THEIR LOCATIONS ARE AVERAGED APART",
        *(
            f"{'':7}{x:15.2f}{y:13.2f}{location:10d}{vx:13.3f}{vy:11.3f}"
            for location, (x, y), (vx, vy) in rows
        ),
    ]


def _sums(name: str, values: Iterable[float]) -> str:
    x, y, grid_x, grid_y = (number(value, 11, 4) for value in values)
    return f"  {name:<45}{x}{y}{'':14}{grid_x}{grid_y}"
