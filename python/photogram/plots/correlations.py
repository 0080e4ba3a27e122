"""Correlation matrices of camera parameters."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.plots.picture_data import Correlated
from photogram.plots.selection import first_panels
from photogram.show.sketch.marks import Mark, Mesh, Panel, Shades, Texts
from photogram.show.sketch.plot import Plot

MAX_CAMERAS = 4
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
    panels = first_panels("correlations", "cameras", cameras, MAX_CAMERAS, _matrix)
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
