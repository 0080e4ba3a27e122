"""Residuals of one case in both systems (subroutine VSPRINT; figures 16 to 25)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.comparator.listing.forms import centred, nearest, number

if TYPE_CHECKING:
    from photogram.comparator.calibration import CaseResult
    from photogram.comparator.residuals import Residuals

__all__ = ["residual_lines", "residual_page"]

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
    squares = _sums("SUM VV", residuals.squares_um2)
    sigma = _sums("SIGMA", residuals.sigma_um)
    unit = f"STANDARD ERROR OF UNIT WEIGHT ={number(residuals.sigma0_um, 9, 4)} MICRONS"
    return [*HEAD, *lines, "", squares, f"  N = {len(residuals.points)}", sigma, "", unit]


def _sums(name: str, values: tuple[float, ...]) -> str:
    x, y, grid_x, grid_y = (number(value, 11, 4) for value in values)
    return f"  {name:<35}{x}{y}{'':15}{grid_x}{grid_y}"
