"""What the pictures share: colours, panels, scales of vectors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.show import pictures
from photogram.show.style import BLUE, FAINT, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from photogram.arguments.types import Floats

MAIN, ACCENT = BLUE, VERMILION
MM = 1000.0
ACROSS = 4
"""Panels beside each other."""


def panels(count: int, *, side: float = 3.4, shared: bool = True) -> tuple[Figure, list[Axes]]:
    """Return a figure of square panels, and its axes; their limits are shared, or each has its own."""
    columns = min(count, ACROSS)
    rows = -(-count // columns)
    figure = pictures.new_figure(max(side * columns, 5.0), side * rows + 0.6)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=shared, sharey=shared).ravel().tolist()
    for unused in axes[count:]:
        unused.set_visible(False)
    return figure, axes[:count]


def plain(axes: Axes, xlabel: str, ylabel: str) -> None:
    """Give a map its labels and equal scales, and take away what distracts."""
    axes.set_aspect("equal")
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.margins(0.08)


def magnification(places_mm: Floats, vectors_um: Floats) -> float:
    """Return millimetres of the picture a micrometre: the longest vector almost spans the spacing."""
    extent = float(np.ptp(places_mm, axis=0).max()) or 1.0
    spacing = extent / max(math.sqrt(len(places_mm)) - 1, 1)
    longest = float(np.hypot(*vectors_um.T).max(initial=0.0))
    return 0.9 * spacing / longest if longest > 0 else 1.0


def arrows(axes: Axes, places_um: Floats, vectors_um: Floats, scale: float, colour: str = MAIN) -> None:
    """Draw vectors from places, `scale` millimetres of the picture for each micrometre."""
    places, vectors = places_um / MM, vectors_um * scale
    axes.plot(*places.T, ".", color=FAINT, markersize=5, zorder=1)
    pictures.arrows(axes, places, vectors, color=colour, width=0.006, headwidth=3.5, headlength=4.5, zorder=2)


def key(panels: Sequence[Axes], scale: float, length_um: float) -> None:
    """Draw a length of micrometres in the lower right corner of panels with common limits."""
    low, high = panels[0].get_ylim()
    panels[0].set_ylim(low - 0.06 * (high - low), high)
    for axes in panels:
        left, right = axes.get_xlim()
        part = length_um * scale / (right - left)
        options: dict[str, Any] = {"transform": axes.transAxes, "color": ACCENT}
        axes.plot([0.98 - part, 0.98], [0.035, 0.035], linewidth=2.5, solid_capstyle="butt", **options)
        axes.text(0.96 - part, 0.035, f"{length_um:g} µm", ha="right", va="center", fontsize=8, **options)
