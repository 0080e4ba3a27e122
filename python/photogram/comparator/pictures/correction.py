"""Plots of the correction: surfaces and a distorted grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.listing.parameters import table_nodes
from photogram.comparator.pictures.vectors import MAIN, MM, OF_COMPARATOR, plan
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, Shades, around, contours
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, round_length

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator import Calibration
    from photogram.comparator.polynomial import Polynomial

FINE = 121
MAGNIFICATION = 10_000  # of the net: a micrometre is drawn as 10 mm


def correction_surface(calibration: Calibration, polynomial: Polynomial, whose: str = "") -> Plot:
    """Draw contour maps of the corrections in x and y with the measured points."""
    centre, half = np.array(polynomial.frame.centre_um), np.array(polynomial.frame.half_range_um)
    x, y = np.linspace(centre - half, centre + half, FINE).T
    places = np.stack(np.meshgrid(x, y), axis=-1)
    values = polynomial.evaluate(places.reshape(-1, 2)).reshape(places.shape)
    measured = np.vstack([fit.residuals.xy_um for fit in calibration.last_fits]) / MM
    largest = float(np.abs(values).max()) or 1.0
    step = round_length(largest / 5)
    levels = step * np.arange(-np.ceil(largest / step), np.ceil(largest / step) + 1)
    shades = Shades(levels[0], levels[-1], "µm", "signed")
    panels = [
        Panel(
            np.array([centre - half, centre + half]) / MM,
            [
                *contours(x / MM, y / MM, values[..., axis], levels, shades, "black", 0.4),
                Markers(measured, ".", 3.0, INK, opacity=0.7),
            ],
            f"correction in {'xy'[axis]}",
            *OF_COMPARATOR,
            equal=True,
            shades=shades if axis else None,
        )
        for axis in range(2)
    ]
    title = f"Nonlinear correction{whose}; dots are the places measured"
    return Plot(10.5, 4.9, panels, 2, title=title)


def distorted_grid(calibration: Calibration, polynomial: Polynomial, whose: str = "") -> Plot:
    """Draw the program's 5 x 5 net, displaced by 10,000 times the correction.

    Nodes and magnification are constant, for comparisons over the years.
    """
    nodes = np.array(table_nodes(calibration.session.centre_um)[::2])[:, ::2]
    corners = nodes[0, 0], nodes[-1, -1]
    along = np.linspace(0.0, 1.0, FINE)
    lines: list[Floats] = []
    for part in np.linspace(0.0, 1.0, len(nodes)):
        for line in (np.column_stack([along, along * 0 + part]), np.column_stack([along * 0 + part, along])):
            places = corners[1] + line * (corners[0] - corners[1])
            lines.append(places / MM + polynomial.evaluate(places) * (MAGNIFICATION / MM))
    stars = Markers(nodes.reshape(-1, 2) / MM, "*", 5.0, FAINT, layer=1.0)
    marks: list[Mark] = [stars, *(Line(line, MAIN, 1.2) for line in lines)]
    limits = around(np.vstack([stars.places, *lines]))
    title = f"Net displaced by the nonlinear correction{whose}, {MAGNIFICATION:,} times magnified"
    return Plot(6.2, 6.0, [plan(limits, marks, title, OF_COMPARATOR, (MAGNIFICATION / MM, 1.0))])
