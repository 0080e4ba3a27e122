"""The summary of an adjustment that the command line prints."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.markup import escape

if TYPE_CHECKING:
    from photogram.block import Floats
    from photogram.result import Result

__all__ = ["summarize"]

SHOWN = 20
"""How many remarks are shown at most."""


def summarize(result: Result, console: Console) -> None:
    """Print how an adjustment ended: problems first, then the figures that judge it, with their units.

    Parameters
    ----------
    result
        What to tell about.
    console
        Where to print.
    """
    for message in result.messages[:SHOWN]:
        console.print(f"[yellow]remark:[/] {escape(str(message))}")
    if len(result.messages) > SHOWN:
        console.print(f"[yellow]and {len(result.messages) - SHOWN} more remarks[/] (all are in report.txt)")
    colour = "green" if result.converged else "bold red"
    console.print(f"[{colour}]{result.status}[/] after {len(result.iterations)} iterations")
    for name, value in _figures(result):
        console.print(f"  {name:<42} {escape(value)}")
    largest = _largest_residuals(result)
    if largest:
        console.print("  largest standardized residuals (no unit), with the residual in micrometres")
        for line in largest:
            console.print(f"    {escape(line)}")


def _figures(result: Result) -> list[tuple[str, str]]:
    """Name the figures that judge an adjustment."""
    block, variance = result.block, result.variance_of_unit_weight
    counts = (len(block.photo_ids), result.used_points.sum(), result.used_images.sum())
    used = np.isfinite(result.point_positions)
    held = np.isfinite(block.point_sd) & used
    undefined = "undefined (no degrees of freedom)"
    deviation = undefined if variance is None else f"{math.sqrt(variance):.4f} (no unit, a priori 1)"
    figures = [
        ("photographs, points, image points used", ", ".join(map(str, counts))),
        ("held components of control", str(held.sum())),
        ("weighted sum of squares", f"{result.sums_of_squares.total:.6g} (no unit)"),
        ("degrees of freedom", str(result.degrees_of_freedom)),
        ("standard deviation of unit weight", deviation),
        ("rms of image residuals, x and y", f"{_rms(1000 * result.residuals, '.2f')} micrometres"),
    ]
    unit = "linear units"
    differences = result.point_differences
    if block.geographic:
        unit = "seconds of arc, seconds of arc, linear units"
        differences = differences * [math.degrees(3600), math.degrees(3600), 1]
    for name, chosen in (("control", held), ("components not held", ~held & used)):
        if np.isfinite(differences[chosen]).any():
            rms = _rms(np.where(chosen, differences, np.nan), ".4g")
            figures.append((f"rms of differences, {name}", f"{rms} {unit}"))
    return figures


def _rms(columns: Floats, form: str) -> str:
    """Write the root mean square of the finite numbers of each column; a dash where there is none."""
    known = [column[~np.isnan(column)] for column in columns.T]
    return ", ".join(format(np.sqrt(np.mean(column**2)), form) if column.size else "-" for column in known)


def _largest_residuals(result: Result, count: int = 5) -> list[str]:
    """Describe the image coordinates with the largest standardized residuals, largest first."""
    size = np.nan_to_num(np.abs(result.standardized)).ravel()
    lines = []
    for at in np.argsort(-size, kind="stable")[:count].tolist():
        row, axis = divmod(at, 2)
        photo = result.block.photo_ids[result.block.image_photos[row]]
        point = result.block.point_ids[result.block.image_points[row]]
        value, residual = result.standardized[row, axis], 1000 * result.residuals[row, axis]
        lines.append(f"{value:8.2f}  point {point:8} photo {photo:8} {'xy'[axis]} {residual:8.2f}")
    return lines
