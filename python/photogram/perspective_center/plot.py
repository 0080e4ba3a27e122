"""Plots of a run: residual vectors in the model and radial distortion on the plate, a row for each set."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import InputError
from photogram.show.pictures import drawn, round_length
from photogram.show.sketch.declared import Panel, Sketch, around
from photogram.show.sketch.marks import Arrows, Band, Level, Line, Mark, Markers
from photogram.show.sketch.on_axes import figure
from photogram.show.style import INK, MARKED

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.perspective_center.solution import PerspectiveCenter

WIDTH, ROW = 11.0, 5.0
"""Inches of a picture, and of one set in it."""
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
    return drawn(figure(run_sketch(results)), path)


def run_sketch(results: list[PerspectiveCenter]) -> Sketch:
    """Return a picture with a row for each set: residual vectors, radial distortion."""
    # One scale for all sets, so that they can be compared.
    longest = max(float(np.hypot(*result.residual.T).max()) for result in results)
    largest = max(
        1000.0 * max(float(np.abs(result.radial_distortion).max()), result.sigma0_plate or 0.0)
        for result in results
    )
    panels = [
        panel
        for result in results
        for panel in (residual_vectors(result, longest), distortion_curve(result, largest))
    ]
    return Sketch(WIDTH, ROW * len(results), panels, 2)


def residual_vectors(result: PerspectiveCenter, longest: float) -> Panel:
    """Return measured minus projected at every point, greatly enlarged, with a vector of known length above.

    `longest` is the residual, in the unit of the model, that gets the longest vector.
    """
    extent = float(np.ptp(result.projected, axis=0).max()) or 1.0
    enlargement = LONGEST * extent / longest if longest > 0 else 1.0
    marks: list[Mark] = [
        Markers(result.projected, "o", 2.5),
        Arrows(result.projected, result.residual * enlargement, ACCENT, 0.004),
    ]
    known = round_length(longest)
    bar = known * enlargement, ACCENT, f"{known:g} model units (x {enlargement:,.0f})"
    title = f"{_name(result)}: measured − projected"
    axes = "X, model units", "Y, model units"
    return Panel(around(result.projected, LONGEST), marks, title, *axes, equal=True, bars=[bar])


def distortion_curve(result: PerspectiveCenter, largest: float) -> Panel:
    """Return radial distortion against radius: every point, the mean of equal radii, and the standard error.

    `largest` is the distortion in micrometres that the axis has room for. A point at the principal point has
    no direction outward: what the report calls its distortion is its distance, and the curve leaves it out.
    """
    radius, micrometres = result.fixed_radius, 1000.0 * result.radial_distortion
    off_centre = radius > 0
    reach, right = 1.4 * largest or 1.0, 1.05 * (float(radius.max()) or 1.0)
    marks: list[Mark] = []
    if result.sigma0_plate is not None:
        sigma = 1000.0 * result.sigma0_plate
        across, up = np.array([0.0, right]), np.full(2, sigma)
        label = f"± standard error of unit weight, {sigma:.1f} µm"
        marks.append(Band(across, -up, up, BAND, 1.0, label=label))
    places = np.column_stack([radius, micrometres])
    marks += [Level(0.0, INK, 0.8), Markers(places, "o", 3.5, opacity=0.75, label="points")]
    if off_centre.any():
        means = _means(radius[off_centre], micrometres[off_centre])
        marks.append(Line(np.column_stack(means), ACCENT, 1.8, label="mean of equal radii"))
    limits = np.array([[0.0, -reach], [right, reach]])
    axes = "radius on the plate, mm", "distortion, µm, positive outward"
    return Panel(limits, marks, "Radial distortion on the plate", *axes, legend="best")


def _means(radius: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Average the values of (nearly) equal radii."""
    order = np.argsort(radius, kind="stable")
    steps = np.diff(radius[order]) > SAME_RADIUS * max(float(radius.max()), 1e-12)
    groups = np.split(order, np.flatnonzero(steps) + 1)
    means = np.array([[radius[group].mean(), values[group].mean()] for group in groups])
    return means[:, 0], means[:, 1]


def _name(result: PerspectiveCenter) -> str:
    return f"Set {result.grid.number}, Z = {result.grid.model[:, 2].mean():g}"
