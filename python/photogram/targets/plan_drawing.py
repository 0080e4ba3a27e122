"""A picture of planned views: where the corners of the board are in each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.lazy_dataclasses import replace
from photogram.network.hull import hull
from photogram.show.sketch.declared import Panel
from photogram.show.sketch.marks import Mark, Markers, Polygons
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, VERMILION
from photogram.targets.drawing import in_pixels

if TYPE_CHECKING:
    from photogram.targets import ViewPlan

__all__ = ["plot_planned_views"]

PANELS_PER_ROW, PANEL_INCHES = 4, 2.2


def plot_planned_views(plan: ViewPlan) -> Plot:
    """Plot where the corners of the board are in each picture; the point 0 is red where it is shown.

    Parameters
    ----------
    plan
        The plan.
    """
    corners = plan.calibrated.calibration.corners
    (size,) = corners.sizes
    assert size is not None
    rows = -(-len(plan.views) // PANELS_PER_ROW)
    panels = list[Panel]()
    for number in range(len(plan.views)):
        own = corners.xy[corners.picture == number]
        marks: list[Mark] = [
            Polygons(hull(own)[np.newaxis], FAINT, 0.5, BLUE, 0.5, 1.0),
            Markers(own, ".", 2.5, BLUE),
        ]
        if corners.point[corners.picture == number][0] == 0:
            marks.append(Markers(own[:1], "o", 5.0, VERMILION))
        title = f"{number + 1}"
        panels.append(replace(in_pixels(size), marks=marks, title=title, across="", up="", unnumbered=True))
    every = [*panels, *[None] * (rows * PANELS_PER_ROW - len(panels))]
    return Plot(
        PANEL_INCHES * PANELS_PER_ROW, rows * (0.3 + PANEL_INCHES * size[1] / size[0]), every, PANELS_PER_ROW
    )


check_arguments(globals(), __all__)
