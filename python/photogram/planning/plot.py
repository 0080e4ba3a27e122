"""A plan as a picture: the patterns in plan, the expected standard deviation in height as colour.

matplotlib is an extra (`pip install 'photogram[plots]'`) and takes long to import; it is imported only here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import PhotogramError
from photogram.show.pictures import new_figure
from photogram.show.style import FAINT, ORDERED, VERMILION, in_style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection
    from matplotlib.figure import Figure, SubFigure

    from photogram.planning.pattern import Pattern

_PANEL = 6.0
"""Longer side of a panel, inches."""
_ELONGATED = 2.5
"""Panels of blocks that are so much wider than high stand one above the other."""
_KINDS = (("full control", "^"), ("height control", "o"), ("plane control", "s"))


@overload
def figure(patterns: Sequence[Pattern], given: None = None) -> Figure: ...


@overload
def figure(patterns: Sequence[Pattern], given: Figure | SubFigure) -> Figure | SubFigure: ...


@in_style
def figure(patterns: Sequence[Pattern], given: Figure | SubFigure | None = None) -> Figure | SubFigure:
    """Return a figure with a panel for each pattern, in one scale of lengths and one of colours."""
    heights = np.concatenate([pattern.point_sd[pattern.new_points, 2] for pattern in patterns])
    if heights.size == 0:
        raise PhotogramError("there are no new points to be shown")
    plan = np.vstack([pattern.point_plan[pattern.result.used_points] for pattern in patterns])
    made, axes = _panels(given, len(patterns), *np.maximum(np.ptp(plan, axis=0), 1e-9))
    colours = [_panel(each, pattern, heights) for each, pattern in zip(axes, patterns, strict=True)]
    unit = patterns[0].block.linear_unit
    made.colorbar(colours[0], ax=axes, label=f"expected standard deviation in height, {unit}", aspect=30)
    named: dict[str, Artist] = {}
    for each in axes:
        handles, labels = each.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    made.legend(named.values(), named.keys(), loc="outside lower center", ncols=4)
    return made


def _panels(
    given: Figure | SubFigure | None, count: int, width: float, height: float
) -> tuple[Figure | SubFigure, list[Axes]]:
    """Make panels for blocks of a width and height, in a figure that fits them unless one is given."""
    stacked = width > _ELONGATED * height
    rows, columns = (count, 1) if stacked else (1, count)
    across = max(2 * _PANEL if stacked else min(_PANEL, _PANEL * width / height), 3.5)
    up = min(across * height / width, _PANEL)
    size = (columns * (across + 0.5) + 1.5, rows * (up + 0.8) + 0.6)
    made = new_figure(*size) if given is None else given
    axes = made.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for each in axes.ravel():
        each.set_aspect("equal")
        each.locator_params(axis="x", nbins=max(3, round(across)))
    return made, list(axes.ravel())


def _panel(axes: Axes, pattern: Pattern, heights: Floats) -> PathCollection:
    new, unit = pattern.new_points, pattern.block.linear_unit
    sd = pattern.point_sd[new, 2]
    # The worst on top: where points are dense, they are what a planner looks for.
    order = np.argsort(sd)
    x, y = pattern.point_plan[new][order].T
    colours = axes.scatter(
        x,
        y,
        c=sd[order],
        s=float(np.clip(2e4 / max(1, len(sd)), 2, 30)),
        vmin=heights.min(),
        vmax=heights.max(),
        cmap=ORDERED,
        linewidths=0,
    )
    axes.plot(*pattern.photo_plan.T, "+", color=FAINT, markersize=4, label="photo")
    held = np.isfinite(pattern.block.point_sd) & pattern.result.used_points[:, np.newaxis]
    plane, height = held[:, :2].any(axis=1), held[:, 2]
    for (name, marker), chosen in zip(
        _KINDS, (plane & height, height & ~plane, plane & ~height), strict=True
    ):
        if chosen.any():
            x, y = pattern.point_plan[chosen].T
            axes.scatter(
                x, y, marker=marker, s=60, c="white", edgecolors=VERMILION, linewidths=1.6, label=name
            )
    quality = pattern.points[-1]
    figures = f"rms {quality.rms_sd[2]:#.3g} {unit}, largest {quality.max_sd[2]:#.3g} {unit}"
    axes.set_title(f"{pattern.name}\n{figures}")
    axes.set_xlabel(f"{pattern.axes[0]}, {unit}")
    axes.set_ylabel(f"{pattern.axes[1]}, {unit}")
    axes.label_outer()
    return colours
