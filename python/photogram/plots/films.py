"""Fiducial residuals and film patterns as vectors over the camera frame."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.plots.picture_data import VectorField
from photogram.plots.selection import first_panels
from photogram.show.sketch.marks import Arrows, Mark, Markers, Names, Panel, ScaleBar, around
from photogram.show.sketch.plot import Plot, side_by_side
from photogram.show.style import FAINT, INK, round_length

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
    panels = first_panels("films", "fields", result._plot_data().films, MAX_FIELDS, _panel)
    return side_by_side(panels, 2, 4.8)


def _panel(each: VectorField) -> Panel:
    extent = max(float(np.ptp(each.places, axis=0).max()), 1e-12)
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
    limits = around(each.places, MARGIN)
    return Panel(limits, marks, each.title, "x, mm", "y, mm", equal=True, bars=bars)
