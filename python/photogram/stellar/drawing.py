"""What the pictures of plates and of digital exposures have alike (extra `plots`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.pictures import arrows, new_figure
from photogram.show.style import COLOURS, INK, MARKED, SKY
from photogram.stellar.curves import histogram

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LENGTH = 0.05
"""Length of a residual of the mean size, of the extent of the picture."""


def panels(width: float, height: float, columns: int = 1) -> tuple[Figure, Any]:
    """Return a figure (inches) with its axes, one beside the other."""
    figure = new_figure(width, height)
    return figure, figure.subplots(1, columns)


def band(axes: Any, x: Floats, y: Floats, error: Floats, colour: str, label: str) -> None:
    """Draw a curve with its mean error."""
    axes.plot(x, y, color=colour, label=label)
    axes.fill_between(x, y - error, y + error, color=colour, alpha=0.2, linewidth=0)


def vectors(
    figure: Figure, axes: Any, places: Floats, residuals: Floats, groups: list[tuple[str, Any]], unit: str
) -> None:
    """Draw residual vectors and their scale.

    Parameters
    ----------
    figure, axes
        Where to.
    places, residuals
        (m, 2) in the unit of the axes, and in `unit`.
    groups
        Names, and which residuals are theirs: each has a colour.
    unit
        Of the residuals.
    """
    extent = float(np.ptp(places, axis=0).max()) or 1.0
    size = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))) or 1.0
    scale = size / (_LENGTH * extent)
    for k, (label, chosen) in enumerate(groups):
        style = {"color": COLOURS[k % len(COLOURS)], "width": 0.0022, "label": label}
        arrows(axes, places[chosen], residuals[chosen], scale, **style)
    bar = float(f"{2 * size:.0e}")
    axes.margins(0.08)
    axes.autoscale_view()
    key = axes.quiver([], [], [], [], angles="xy", scale_units="xy", scale=scale, width=0.0035, color=INK)
    axes.quiverkey(key, 0.86, 1.02, bar, f"{bar:g} {unit}", labelpos="E", coordinates="axes")
    figure.legend(loc="outside lower center", ncols=6)


def bell(axes: Any, values: Floats, title: str, unit: str) -> None:
    """Draw the histogram of residuals with the normal curve."""
    found = histogram(values)
    middle, width = 0.5 * (found.edges[1:] + found.edges[:-1]), np.diff(found.edges)
    axes.bar(middle, found.counts, width=width, color=SKY, alpha=0.6, edgecolor="white")
    curve = np.linspace(found.edges[0], found.edges[-1], 200)
    density = np.exp(-0.5 * ((curve - found.mean) / found.sd) ** 2) / (found.sd * np.sqrt(2 * np.pi))
    axes.plot(curve, len(values) * width[0] * density, color=MARKED)
    axes.set(title=f"{title}: sd {found.sd:.3g} {unit}", xlabel=unit, ylabel="number")
