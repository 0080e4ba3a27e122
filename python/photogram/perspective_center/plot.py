"""Plots of a run: residual vectors and radial distortion, a row for each set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.perspective_center.solution import PerspectiveCenter
from photogram.plots.picture_data import VectorField
from photogram.plots.residuals import vector_panel
from photogram.show.quantity import Axis
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, band, horizontal_line
from photogram.show.sketch.plot import Plot
from photogram.show.style import INK, MARKED

MODEL = tuple(Axis.of(name, "model units") for name in "XY")
SAME_RADIUS = 0.02  # Points are averaged if their radii differ by less than this part of the largest


def run_sketch(results: Sequence[PerspectiveCenter]) -> Plot | None:
    """Return the plot of a run; all sets have the same scales. None without sets."""
    if not results:
        return None
    longest = max(float(np.hypot(*each.residual.T).max()) for each in results)
    largest = max(max(np.abs(each.radial_distortion).max(), each.sigma0_plate or 0.0) for each in results)
    panels = []
    for each in results:
        title = f"{set_name(each)}: measured − projected"
        vectors = VectorField(title, each.projected, each.residual, axes=MODEL)
        panels += [vector_panel(vectors, longest), _distortion_curve(each, 1000.0 * float(largest))]
    return Plot(11.0, 5.0 * len(results), panels, 2)


def set_name(result: PerspectiveCenter) -> str:
    """Return the name of a set: its number and its mean height."""
    return f"Set {result.grid.number}, Z = {result.grid.model[:, 2].mean():g}"


def _distortion_curve(result: PerspectiveCenter, largest: float) -> Panel:
    """Return distortion over radius; `largest` is the axis range (um).

    The curve omits a point at the principal point, because the sign of its distortion is undefined.
    """
    radius, distortion = result.fixed_radius, 1000.0 * result.radial_distortion
    reach, right = 1.4 * largest or 1.0, 1.05 * (float(radius.max()) or 1.0)
    marks: list[Mark] = []
    if result.sigma0_plate is not None:
        sigma = np.full(2, 1000.0 * result.sigma0_plate)
        label = f"± standard error of unit weight, {sigma[0]:.1f} µm"
        marks.append(band(np.array([0.0, right]), -sigma, sigma, "#e4e4e4", 1.0, label=label))
    places = np.column_stack([radius, distortion])
    marks += [horizontal_line(0.0, INK, 0.8), Markers(places, "o", 3.5, opacity=0.75, label="points")]
    if (radius > 0).any():
        marks.append(Line(_means(places[radius > 0]), MARKED, 1.8, label="mean of equal radii"))
    limits = np.array([[0.0, -reach], [right, reach]])
    axes = "radius on the plate, mm", "distortion, µm, positive outward"
    return Panel(limits, marks, "Radial distortion on the plate", *axes, legend="below")


def _means(places: Floats) -> Floats:
    ordered = places[np.argsort(places[:, 0], kind="stable")]
    steps = np.diff(ordered[:, 0]) > SAME_RADIUS * max(float(ordered[-1, 0]), 1e-12)
    return np.array([group.mean(axis=0) for group in np.split(ordered, np.flatnonzero(steps) + 1)])
