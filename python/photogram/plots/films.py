"""Residuals of fiducial marks and patterns of films, as vectors over the frame of a camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.errors import InputError
from photogram.plots.panels import Where, handed_out, labels, note, panels, scale_bars
from photogram.plots.picture_data import VectorField, pictured
from photogram.show.pictures import round_length
from photogram.show.style import FAINT, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = 6
"""Fields that have a panel at most."""
ROOM = 0.14
"""Around the places, of their extent."""
LONGEST = 0.11
"""Of the longest vector, of the extent of the places."""


def films(result: object, ax: Where = None) -> Any:
    """Draw residuals of fiducial marks, mean over the photos of each camera, and patterns of films.

    Parameters
    ----------
    result
        An adjusted block with scanned films.
    ax
        Axes, as many as there are cameras with marks and films with a pattern (six at most), or a figure to
        put them in; a new one when None.

    Returns
    -------
    The axes, or an array of them where there are several fields.

    Raises
    ------
    InputError
        No marks and no patterns; another number of axes.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    TypeError
        A result without photos and points.
    """
    every = pictured(result).films
    if not every:
        raise InputError("there are neither residuals of marks nor patterns of films to draw")
    shown = every[:SHOWN]
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    with panels(ax, rows, columns, 4.6 * columns, 4.9 * rows) as found:
        for axes, each in zip(found, shown, strict=False):
            _panel(axes, each)
        for unused in found[len(shown) :]:
            unused.set_visible(False)
        if len(every) > SHOWN:
            note(found[len(shown) - 1], [f"the first {SHOWN} of {len(every)} fields are drawn"])
    return handed_out(found[: len(shown)])


def _panel(axes: Axes, each: VectorField) -> None:
    low, high = each.places.min(axis=0), each.places.max(axis=0)
    extent = max(float((high - low).max()), 1e-12)
    margin = ROOM * extent
    axes.set_aspect("equal", anchor="NW")
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_xlabel("x, mm")
    axes.set_ylabel("y, mm")
    axes.plot(*each.places.T, ".", color=FAINT, markersize=4.0, zorder=1.0)
    longest = float(np.hypot(*each.vectors.T).max(initial=0.0))
    bars = []
    if longest > 0:
        scale = LONGEST * extent / longest
        axes.quiver(
            *each.places.T,
            *(scale * each.vectors).T,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            color=INK,
            width=0.004,
            headwidth=3.5,
            headlength=4.5,
            zorder=2.0,
        )
        bar = round_length(1e3 * longest)
        bars = [(1e-3 * scale * bar, INK, f"{bar:g} µm")]
    scale_bars(axes, bars, each.title)
    if each.labels:
        labels(axes, each.places, each.labels, [INK] * len(each.labels))
