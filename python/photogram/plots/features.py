"""How far points are from the features that are fitted to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.errors import InputError
from photogram.plots.panels import Where, handed_out, note, panels
from photogram.plots.picture_data import Deviations, pictured
from photogram.show.style import COLOURS, FAINT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = 4
"""Features that have a panel at most."""
NAMED = 40
"""Points whose names are written at most."""


def features(result: object, ax: Where = None) -> Any:
    """Draw the deviations of points from the features that are fitted to them, with U to either side.

    Parameters
    ----------
    result
        An adjusted block with features.
    ax
        Axes, as many as there are features with deviations (four at most), or a figure to put them in; a new
        one when None.

    Returns
    -------
    The axes, or an array of them where there are several features.

    Raises
    ------
    InputError
        No feature has deviations; another number of axes.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    TypeError
        A result without photos and points.
    """
    every = pictured(result).deviations
    if not every:
        raise InputError("there are no deviations to draw: no feature is fitted to more than two points")
    shown = every[:SHOWN]
    with panels(ax, len(shown), 1, 7.0, 0.4 + 2.5 * len(shown)) as found:
        for axes, each in zip(found, shown, strict=True):
            _panel(axes, each)
        if len(every) > SHOWN:
            note(found[-1], [f"the first {SHOWN} of {len(every)} features are drawn"])
    return handed_out(found)


def _panel(axes: Axes, each: Deviations) -> None:
    factor, unit = each.shown_as
    places = np.arange(len(each.points))
    axes.axhline(0.0, color=FAINT, linewidth=0.8)
    count = len(each.directions)
    for k, direction in enumerate(each.directions):
        # Side by side, so that bars do not hide each other.
        across = places + 0.2 * (k - (count - 1) / 2)
        values, bars = factor * each.values[:, k], factor * np.nan_to_num(each.expanded[:, k])
        axes.errorbar(
            across, values, bars, fmt="o", markersize=3.5, linewidth=1.0, color=COLOURS[k], label=direction
        )
    axes.set_title(each.title)
    axes.set_ylabel(f"deviation ± U, {unit}")
    if len(places) <= NAMED:
        long = max(map(len, each.points)) * len(places) > 80
        axes.set_xticks(places, each.points, rotation=90 if long else 0)
    else:
        axes.set_xlabel("points, in the order of the feature")
    if count > 1:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=count, frameon=False)
