"""Plots of a run: residual vectors in the model and radial distortion on the plate, a row for each set.

matplotlib is an extra (`pip install 'photogram[plots]'`) and is imported only here.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import InputError
from photogram.show.pictures import arrows, drawn, new_figure, round_length
from photogram.show.style import INK, MARKED, in_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from photogram.arguments.types import Floats
    from photogram.perspective_center.solution import PerspectiveCenter

WIDTH, ROW = 11.0, 5.0
"""Inches of a figure, and of one set in it."""
LONGEST = 0.12
"""The longest residual vector, as part of the extent of the grid."""
ACCENT, BAND = MARKED, "#e4e4e4"
SAME_RADIUS = 0.02
"""Points whose radii differ by less than this part of the largest are averaged into one point of the
curve."""


def draw(results: list[PerspectiveCenter], path: Path) -> bytes:
    """Draw a run in the format that the name of a file asks for.

    Raises
    ------
    InputError
        There is nothing to draw, or the suffix names no format of matplotlib.
    """
    if not results:
        raise InputError("no set was solved: there is nothing to draw", file=path)
    return drawn(figure(results), path)


@in_style
def figure(results: list[PerspectiveCenter]) -> Figure:
    """Return a figure with a row for each set: residual vectors, radial distortion."""
    drawing = new_figure(WIDTH, ROW * len(results))
    axes = drawing.subplots(len(results), 2, squeeze=False, width_ratios=(1.0, 1.15))
    # One scale for all sets, so that they can be compared.
    longest = max(float(np.hypot(*result.residual.T).max()) for result in results)
    largest = max(
        1000.0 * max(float(np.abs(result.radial_distortion).max()), result.sigma0_plate or 0.0)
        for result in results
    )
    for (left, right), result in zip(axes, results, strict=True):
        residual_vectors(left, result, longest)
        distortion_curve(right, result, largest)
    return drawing


def residual_vectors(axes: Axes, result: PerspectiveCenter, longest: float) -> None:
    """Draw measured minus projected at every point, greatly enlarged, with a vector of known length beside.

    `longest` is the residual, in the unit of the model, that gets the longest vector.
    """
    x, y = result.projected.T
    extent = float(np.ptp(result.projected, axis=0).max()) or 1.0
    enlargement = LONGEST * extent / longest if longest > 0 else 1.0
    axes.plot(x, y, "o", color=INK, markersize=2.5)
    arrows(axes, result.projected, result.residual * enlargement, width=0.004, color=ACCENT)
    known = round_length(longest)
    margin = 0.12 * extent
    corner = np.array([x.min(), y.min() - 1.35 * margin])
    arrows(axes, corner[None], np.array([[known * enlargement, 0.0]]), width=0.004, color=ACCENT)
    axes.annotate(
        f"{known:g} model units (x {enlargement:,.0f})",
        (corner[0] + known * enlargement, corner[1]),
        xytext=(6, 0), textcoords="offset points", va="center", fontsize=8, color=ACCENT,
    )  # fmt: skip
    axes.set_xlim(x.min() - margin, x.max() + margin)
    axes.set_ylim(y.min() - 2 * margin, y.max() + margin)
    axes.set_aspect("equal")
    axes.set(xlabel="X, model units", ylabel="Y, model units", title=f"{_name(result)}: measured − projected")


def distortion_curve(axes: Axes, result: PerspectiveCenter, largest: float) -> None:
    """Draw radial distortion against radius: every point, the mean of equal radii, and the standard error.

    `largest` is the distortion in micrometres that the axis has room for. A point at the principal point has
    no direction outward: what the report calls its distortion is its distance, and the curve leaves it out.
    """
    radius, micrometres = result.fixed_radius, 1000.0 * result.radial_distortion
    off_centre = radius > 0
    if result.sigma0_plate is not None:
        sigma = 1000.0 * result.sigma0_plate
        axes.axhspan(-sigma, sigma, color=BAND, label=f"± standard error of unit weight, {sigma:.1f} µm")
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.plot(radius, micrometres, "o", color=INK, markersize=3.5, alpha=0.75, label="points", clip_on=False)
    if off_centre.any():
        means = _means(radius[off_centre], micrometres[off_centre])
        axes.plot(*means, "-", color=ACCENT, linewidth=1.8, label="mean of equal radii")
    reach = 1.4 * largest or 1.0
    axes.set_ylim(-reach, reach)
    axes.set_xlim(left=0.0)
    axes.set(
        xlabel="radius on the plate, mm",
        ylabel="distortion, µm, positive outward",
        title="Radial distortion on the plate",
    )
    axes.legend(loc="lower left", ncols=3, columnspacing=1.2)


def _means(radius: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Average the values of (nearly) equal radii."""
    order = np.argsort(radius, kind="stable")
    steps = np.diff(radius[order]) > SAME_RADIUS * max(float(radius.max()), 1e-12)
    groups = np.split(order, np.flatnonzero(steps) + 1)
    means = np.array([[radius[group].mean(), values[group].mean()] for group in groups])
    return means[:, 0], means[:, 1]


def _name(result: PerspectiveCenter) -> str:
    return f"Set {result.grid.number}, Z = {result.grid.model[:, 2].mean():g}"
