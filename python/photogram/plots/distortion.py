"""Curves of radial distortion with standard deviations, and correlations of camera parameters."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.plots.picture_data import Correlated, Curves, display_unit
from photogram.plots.selection import first_panels
from photogram.show.sketch.marks import Line, Mark, Mesh, Panel, Shades, Texts, band, horizontal_line, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import COLOURS, FAINT, INK
from photogram.words import phrase

MAX_CAMERAS = 3


def distortion(result: Any) -> Plot:
    """Plot radial distortion of cameras: curve, balanced form, standard deviations.

    Bands show one standard deviation to either side. Dashed lines are beyond all observations.

    Raises
    ------
    InputError
        If no camera has radial distortion.
    """
    cameras = result._plot_data().distortion[:MAX_CAMERAS]
    if not cameras:
        raise InputError(phrase("plot.distortion"))
    found = side_by_side(cameras)
    width = 6.4 if len(cameras) == 1 else 4.8 * len(cameras)
    return Plot(width, 0.6 + 2.3 * (len(found) // len(cameras)), found, len(cameras), shared=True)


def side_by_side(cameras: Sequence[Curves]) -> list[Panel | None]:
    """Return panels of cameras by column: curves, and standard deviations below."""
    columns = [_column(each) for each in cameras]
    rows = max(map(len, columns))
    return [own[row] if row < len(own) else None for row in range(rows) for own in columns]


def _column(curves: Curves) -> list[Panel]:
    factor, unit = display_unit(curves.unit)
    seen = curves.radii <= curves.observed
    across, colours = spread(curves.radii), cycle(COLOURS)
    found, deviations, sizes = list[Panel](), list[Mark](), list[Floats]()
    named = f"radius, {curves.unit}; dashed beyond {curves.observed:.4g}, where images end"
    banded = any(curve.bands for curve in curves.curves)
    for number, curve in enumerate(curves.curves):
        marks: list[Mark] = [
            Line(np.column_stack([curves.radii, factor * other]), FAINT, 0.5, opacity=0.5)
            for other in curves.others
        ]
        for name, sd in curve.bands.items():
            low, high = factor * (curve.values - sd), factor * (curve.values + sd)
            colour = next(colours)
            marks.append(band(curves.radii, low, high, colour, 0.3, label=f"± sd of the {name}"))
            # Bands are thin on curves of hundreds of micrometres, and are therefore also drawn separately.
            deviations += _dashed(curves.radii, factor * sd, seen, colour, f"sd of the {name}")
            sizes.append(factor * sd)
        marks += [*_dashed(curves.radii, factor * curve.values, seen, INK, ""), horizontal_line(0.0, FAINT)]
        title = curve.name if number else f"Radial distortion of {curves.camera}"
        below = "" if banded or number + 1 < len(curves.curves) else named
        # Without effect of extreme single photos.
        ends = [*np.quantile(curves.others, [0.1, 0.9], axis=0)] if len(curves.others) else []
        bands = (curve.values + sign * sd for sd in curve.bands.values() for sign in (-1, 1))
        reach = spread(0.0, *(factor * each for each in (curve.values, *ends, *bands)))
        limits = np.column_stack([across, reach])
        found.append(Panel(limits, marks, title, below, unit, legend="below" if curve.bands else ""))
    if banded:
        limits = np.column_stack([across, (0.0, spread(*sizes)[1])])
        found.append(Panel(limits, deviations, "", named, f"sd, {unit}", legend="below"))
    return found


def _dashed(radii: Floats, values: Floats, seen: Bools, colour: str, label: str) -> list[Mark]:
    last, places = max(int(np.count_nonzero(seen)), 1), np.column_stack([radii, values])
    return [Line(places[:last], colour, label=label), Line(places[last - 1 :], colour, dash="--")]


MAX_MATRICES = 4
MAX_WRITTEN_PARAMETERS = 14  # Matrices of more parameters are drawn without coefficients
SHADES = Shades(-1.0, 1.0, "correlation, -1 to 1", "signed")


def correlations(result: Any) -> Plot:
    """Plot the correlations of the estimated parameters of cameras.

    Raises
    ------
    InputError
        If no camera has two estimated parameters, or covariances are missing.
    """
    cameras = result._plot_data().correlations
    panels = first_panels("correlations", "cameras", cameras, MAX_MATRICES, _matrix)
    columns = min(2, len(panels))
    side = 2.2 + 0.36 * max(len(panel.up_names) for panel in panels)
    return Plot(columns * (side + 0.9), -(-len(panels) // columns) * (side + 0.2), panels, columns)


def _matrix(each: Correlated) -> Panel:
    count = len(each.names)
    first, last = -0.5, count - 0.5
    marks: list[Mark] = [Mesh(np.array([[first, first], [last, last]]), each.coefficients, SHADES)]
    if count <= MAX_WRITTEN_PARAMETERS:
        rows, columns = np.nonzero(~np.eye(count, dtype=bool))
        values = each.coefficients[rows, columns].tolist()
        texts = [
            f"{value:z.2f}".replace("0.", ".", 1) if abs(value) < 0.995 else f"{value:.3f}"
            for value in values
        ]
        colours = ["white" if abs(value) > 0.7 else "black" for value in values]
        marks.append(Texts(np.column_stack([columns, rows]).astype(float), texts, 6.5, colours, "middle"))
    return Panel(
        np.array([[first, last], [last, first]]),
        marks,
        f"{each.camera}, {each.remark}".removesuffix(", "),
        equal=True,
        across_names=each.names,
        up_names=each.names,
        turned=max(map(len, each.names)) > 3,
        bare=True,
        shades=SHADES,
    )
