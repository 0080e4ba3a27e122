"""Distances of points from the features fitted to them."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.plots.picture_data import Deviations, display_unit
from photogram.plots.selection import first_panels
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
    panels = first_panels("features", "features", result._plot_data().deviations, MAX_FEATURES, _panel)
    return Plot(7.0, 0.4 + 2.5 * len(panels), panels)


def _panel(each: Deviations) -> Panel:
    factor, unit = display_unit(each.unit, float(np.abs(each.values).max(initial=0.0)))
    places, count = np.arange(len(each.points)), len(each.directions)
    values, bars = factor * each.values, factor * np.nan_to_num(each.expanded)
    # Side by side, so that bars do not overlap.
    across = places[:, np.newaxis] + 0.2 * (np.arange(count) - (count - 1) / 2)
    marks: list[Mark] = [horizontal_line(0.0, FAINT, 0.8)]
    for k, direction in enumerate(each.directions):
        at = np.column_stack([across[:, k], values[:, k]])
        ends = error_bars(at, at[:, 1] - bars[:, k], at[:, 1] + bars[:, k])
        marks += [Line(ends, COLOURS[k], 1.0), Markers(at, "o", 3.5, COLOURS[k], label=direction)]
    named = len(places) <= MAX_POINT_NAMES
    return Panel(
        np.column_stack([spread(across), spread(0.0, values - bars, values + bars)]),
        marks,
        each.title,
        "" if named else "points, in the order of the feature",
        f"deviation ± U, {unit}",
        legend="beside" if count > 1 else "",
        across_names=each.points if named else (),
        turned=max(map(len, each.points)) * len(places) > 80,
    )
