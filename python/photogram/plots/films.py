"""Fiducial residuals and film patterns as vectors over the camera frame."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.errors import InputError
from photogram.plots.picture_data import VectorField
from photogram.show.sketch.marks import Arrows, Mark, Markers, Names, Panel, ScaleBar
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, round_length
from photogram.words import phrase

MAX_FIELDS = 6
MARGIN = 0.14  # Margin around the points, as a part of their extent
LONGEST_VECTOR = 0.11  # Longest vector, as a part of the extent of the points


def films(result: Any) -> Plot:
    """Plot fiducial residuals, mean over photos of each camera, and film patterns.

    Raises
    ------
    InputError
        If there are neither marks nor patterns.
    """
    every = result._plot_data().films
    if not every:
        raise InputError(phrase("plot.films"))
    shown = every[:MAX_FIELDS]
    columns = min(2, len(shown))
    said = f"the first {MAX_FIELDS} of {len(every)} fields are drawn" if len(every) > MAX_FIELDS else ""
    panels = [_panel(each, said if each is shown[-1] else "") for each in shown]
    return Plot(4.6 * columns, 4.9 * -(-len(shown) // columns), panels, columns)


def _panel(each: VectorField, said: str) -> Panel:
    low, high = each.places.min(axis=0), each.places.max(axis=0)
    extent = max(float((high - low).max()), 1e-12)
    marks: list[Mark] = [Markers(each.places, ".", 4.0, FAINT, layer=1.0)]
    longest = float(np.hypot(*each.vectors.T).max(initial=0.0))
    bars: list[ScaleBar] = []
    if longest > 0:
        scale = LONGEST_VECTOR * extent / longest
        marks.append(Arrows(each.places, scale * each.vectors, INK, 0.004))
        bar = round_length(1e3 * longest)
        bars = [(1e-3 * scale * bar, INK, f"{bar:g} µm")]
    if each.labels:
        marks.append(Names(each.places, each.labels, [INK] * len(each.labels)))
    limits = np.array([low, high]) + MARGIN * extent * np.array([[-1.0], [1.0]])
    return Panel(limits, marks, each.title, "x, mm", "y, mm", equal=True, notes=[said], bars=bars)
