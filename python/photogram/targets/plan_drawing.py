"""A picture of planned views: where the corners of the board are in each of them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from photogram.arguments.annotations import check_arguments
from photogram.network.hull import hull
from photogram.plots.placed import placed
from photogram.show.axes import Where, handed_out, panels
from photogram.show.style import BLUE, FAINT, VERMILION
from photogram.targets.drawing import in_pixels
from photogram.targets.view_plan_result import ViewPlan

__all__ = ["draw_planned_views"]

ACROSS, PANEL = 4, 2.2
"""Panels side by side, and how wide each is, inches."""


def draw_planned_views(plan: ViewPlan, path: Path | None = None, ax: Where = None) -> Any:
    """Draw where the corners of the board are in each picture; the point 0 is red where it is shown.

    Parameters
    ----------
    plan
        The plan.
    path, ax
        As of :func:`photogram.targets.draw_uncertainty`; four axes for each four views begun.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`photogram.targets.draw_uncertainty`.
    """
    return placed(partial(_views, plan), path, ax)


def _views(plan: ViewPlan, ax: Where) -> Any:
    corners = plan.calibrated.calibration.corners
    (size,) = corners.sizes
    assert size is not None
    rows = -(-len(plan.views) // ACROSS)
    with panels(ax, rows, ACROSS, PANEL * ACROSS, rows * (0.3 + PANEL * size[1] / size[0])) as found:
        for number, axes in enumerate(found):
            if number >= len(plan.views):
                axes.set_axis_off()
                continue
            own = corners.xy[corners.picture == number]
            in_pixels(axes, size)
            axes.set(xlabel="", ylabel="", xticks=[], yticks=[], title=f"{number + 1}")
            axes.fill(*hull(own).T, facecolor=FAINT, edgecolor=BLUE, linewidth=1.0, alpha=0.5)
            axes.plot(*own.T, ".", color=BLUE, markersize=2.5)
            if corners.point[corners.picture == number][0] == 0:
                axes.plot(*own[0], "o", color=VERMILION, markersize=5.0)
    return handed_out(found)


check_arguments(globals(), __all__)
