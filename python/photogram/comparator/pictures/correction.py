"""The correction over the range of the comparator: surfaces, and a grid distorted by it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.listing.parameters import table_nodes
from photogram.comparator.pictures.style import MAIN, MM, key, plain
from photogram.show.pictures import new_figure, round_length
from photogram.show.style import FAINT, signed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.arguments.types import Floats
    from photogram.comparator.calibration import Calibration
    from photogram.comparator.polynomial import Polynomial

FINE = 121
MAGNIFICATION = 10_000
"""Of the net: a micrometre is drawn as 10 mm."""


def _range(polynomial: Polynomial) -> tuple[Floats, Floats]:
    """Return the least and greatest x and y of the measured range, micrometres."""
    centre, half = np.array(polynomial.frame.centre_um), np.array(polynomial.frame.half_range_um)
    return centre - half, centre + half


def _mesh(polynomial: Polynomial, count: int) -> tuple[Floats, Floats]:
    """Return places (count, count, 2) over the range and the corrections there."""
    low, high = _range(polynomial)
    x, y = np.meshgrid(np.linspace(low[0], high[0], count), np.linspace(low[1], high[1], count))
    places = np.stack([x, y], axis=-1)
    return places, polynomial.evaluate(places.reshape(-1, 2)).reshape(places.shape)


def correction_surface(calibration: Calibration, polynomial: Polynomial, whose: str = "") -> Figure:
    """Draw the corrections in x and in y as contour maps on one scale, with the places measured."""
    places, values = _mesh(polynomial, FINE)
    measured = np.vstack([fit.residuals.xy_um for fit in calibration.last_fits]) / MM
    largest = float(np.abs(values).max()) or 1.0
    step = round_length(largest / 5)
    levels = step * np.arange(-np.ceil(largest / step), np.ceil(largest / step) + 1)
    figure = new_figure(10.5, 4.9)
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    for axis, panel in enumerate(axes):
        x, y = places[..., 0] / MM, places[..., 1] / MM
        filled = panel.contourf(x, y, values[..., axis], levels=levels, cmap=signed())
        lines = panel.contour(x, y, values[..., axis], levels=levels, colors="k", linewidths=0.4)
        panel.clabel(lines, fontsize=7, fmt="%g")
        panel.plot(*measured.T, ".", color="k", markersize=3, alpha=0.7, clip_on=False)
        panel.set_title(f"correction in {'xy'[axis]}", fontsize=10, loc="left")
        plain(panel, "x, mm", "y, mm")
        panel.margins(0.0)
    bar = figure.colorbar(filled, ax=axes, shrink=0.9)
    bar.set_label("µm", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    figure.suptitle(f"Nonlinear correction{whose}; dots are the places measured", fontsize=11)
    return figure


def distorted_grid(calibration: Calibration, polynomial: Polynomial, whose: str = "") -> Figure:
    """Draw the program's net: lines through its 5 x 5 nodes, displaced 10,000 times the correction.

    Nodes and magnification are always the same, so that calibrations can be compared over the years.
    """
    nodes = np.array(table_nodes(calibration.session.centre_um)[::2])[:, ::2]
    figure = new_figure(6.2, 6.0)
    axes = figure.subplots()
    corners = nodes[0, 0], nodes[-1, -1]
    along = np.linspace(0.0, 1.0, FINE)
    for part in np.linspace(0.0, 1.0, len(nodes)):
        for line in (np.column_stack([along, along * 0 + part]), np.column_stack([along * 0 + part, along])):
            places = corners[1] + line * (corners[0] - corners[1])
            moved = places / MM + polynomial.evaluate(places) * (MAGNIFICATION / MM)
            axes.plot(*moved.T, color=MAIN, linewidth=1.2, zorder=2)
    axes.plot(*(nodes.reshape(-1, 2) / MM).T, "*", color=FAINT, markersize=5, zorder=1)
    plain(axes, "x, mm", "y, mm")
    key([axes], MAGNIFICATION / MM, 1.0)
    axes.set_title(
        f"Net displaced by the nonlinear correction{whose}, {MAGNIFICATION:,} times magnified", fontsize=11
    )
    return figure
