"""Common plots of plates and digital exposures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.sketch.marks import Arrows, Line, Mark, Panel, Polygons, ScaleBar, boxes, spread
from photogram.show.sketch.marks import band as area
from photogram.show.sketch.plot import Plot
from photogram.show.style import COLOURS, INK, MARKED, SKY
from photogram.stellar.curves import histogram

_MEAN_RESIDUAL = 0.05  # Length in the plot, relative to its extent


def band(x: Floats, y: Floats, error: Floats, colour: str, label: str) -> list[Mark]:
    """Return a curve with its mean error."""
    return [area(x, y - error, y + error, colour, 0.2), Line(np.column_stack([x, y]), colour, label=label)]


def curves(marks: Sequence[Mark], across: str, up: str, title: str = "") -> Panel:
    """Return a panel that contains all given lines and bands."""
    lines = [line for mark in marks if isinstance(mark, Line) for line in mark.lines]
    x, y = np.concatenate(lines).T
    bands = [outline[:, 1] for mark in marks if isinstance(mark, Polygons) for outline in mark.places]
    limits = np.column_stack([spread(x), spread(y, *bands)])
    return Panel(limits, marks, title, across, up, legend="below")


def vectors(
    places: Floats, residuals: Floats, groups: list[tuple[str, Any]], unit: str
) -> tuple[list[Arrows], ScaleBar]:
    """Return residual vectors (m, 2) in a unit, and their scale.

    Positions have the unit of the axes; groups are names and the residuals of each, with one colour.
    """
    extent = float(np.ptp(places, axis=0).max()) or 1.0
    size = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))) or 1.0
    scale = _MEAN_RESIDUAL * extent / size
    marks = [
        Arrows(places[chosen], scale * residuals[chosen], COLOURS[k % len(COLOURS)], 0.0022, label=label)
        for k, (label, chosen) in enumerate(groups)
    ]
    bar = float(f"{2 * size:.0e}")
    return marks, (scale * bar, INK, f"{bar:g} {unit}")


def bells(every: dict[str, Floats], unit: str) -> Plot:
    """Return named histograms of residuals with normal curves."""
    panels = [_bell(values, f"residuals in {name}", unit) for name, values in every.items()]
    return Plot(11.0, 3.8, panels, len(panels))


def _bell(values: Floats, title: str, unit: str) -> Panel:
    found = histogram(values)
    edges, counts = found.edges, np.asarray(found.counts, float)
    bars = boxes(np.column_stack([edges[:-1], 0 * counts]), np.column_stack([edges[1:], counts]))
    x = np.linspace(edges[0], edges[-1], 200)
    density = np.exp(-0.5 * ((x - found.mean) / found.sd) ** 2) / (found.sd * np.sqrt(2 * np.pi))
    curve = len(values) * (edges[1] - edges[0]) * density
    marks = [Polygons(bars, SKY, 0.6, "white", 1.0, 1.0), Line(np.column_stack([x, curve]), MARKED)]
    (left, right), (_, top) = spread(edges), spread(0.0, counts, curve)
    limits = np.array([[left, 0.0], [right, top]])
    return Panel(limits, marks, f"{title}: sd {found.sd:.3g} {unit}", unit, "number")
