"""Distances of points from the features fitted to them."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.plots.picture_data import display_unit
from photogram.plots.selection import first_panels
from photogram.show.page import about
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, error_bars, horizontal_line, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import COLOURS, FAINT

MAX_FEATURES = 4
MAX_POINT_NAMES = 40


def features(result: Any) -> Plot:
    """Plot the deviations of points from fitted features, with U to either side.

    Raises
    ------
    InputError
        If no feature has deviations.
    """
    found: Any = getattr(result, "features", None) or ()
    shown = [each for each in found if each.deviations.size]

    def drawn(each: Any) -> Panel:
        return _panel(each, result.block.linear_unit, found.k * each.deviation_sd)

    panels = first_panels("features", "features", shown, MAX_FEATURES, drawn)
    return Plot(7.0, 0.4 + 2.5 * len(panels), panels)


def _panel(feature: Any, unit: str, expanded: Floats) -> Panel:
    factor, unit = display_unit(unit, float(np.abs(feature.deviations).max(initial=0.0)))
    places, count = np.arange(len(feature.points)), feature.deviations.shape[1]
    values, bars = factor * feature.deviations, factor * np.nan_to_num(expanded)
    # Side by side, so that bars do not overlap.
    across = places[:, np.newaxis] + 0.2 * (np.arange(count) - (count - 1) / 2)
    marks: list[Mark] = [horizontal_line(0.0, FAINT, 0.8)]
    for k, direction in enumerate(("outward", "axial")[:count]):
        at = np.column_stack([across[:, k], values[:, k]])
        ends = error_bars(at, at[:, 1] - bars[:, k], at[:, 1] + bars[:, k])
        marks += [Line(ends, COLOURS[k], 1.0), Markers(at, "o", 3.5, COLOURS[k], label=direction)]
    named = len(places) <= MAX_POINT_NAMES
    return Panel(
        np.column_stack([spread(across), spread(0.0, values - bars, values + bars)]),
        marks,
        about("feature.points", name=feature.name, kind=feature.kind, n=len(feature.points)),
        "" if named else "points, in the order of the feature",
        f"deviation ± U, {unit}",
        legend="beside" if count > 1 else "",
        across_names=feature.points if named else (),
        turned=max(map(len, feature.points)) * len(places) > 80,
    )
