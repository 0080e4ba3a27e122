"""Pictures of a statement: differences at check points over the block, photos per point of ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.results.footprints import footprints
from photogram.results.result import Result
from photogram.results.statement.comparison import Compared
from photogram.results.statement.standards import Lengths
from photogram.show.pictures import arrows, decimal_sign, ellipses, new_figure, round_length
from photogram.show.style import BLUE, INK, SOFT, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 6.3
"""Inches of a picture."""
REACH = 0.08
"""Of the extent, what the largest difference is drawn as."""
NINETY_FIVE = 2.4477
"""Half-axes of the ellipse of 95 percent, in standard deviations."""
NAMED = 60
CELLS = 120
"""Of the longer side of the map of overlap."""


def differences(found: Compared, control: Floats, labels: dict[str, str]) -> Figure | None:
    """Draw (k, 3) control, check points, their differences in plan, and those in height as colours."""
    if not len(found) and not len(control):
        return None
    places = [each[:, :2] for each in (found.places, control) if len(each)]
    every = np.concatenate(places)
    extent = np.ptp(every, axis=0)
    figure = new_figure(WIDTH, float(np.clip(WIDTH * (extent[1] + 1e-9) / (extent[0] + 1e-9), 2.6, WIDTH)))
    axes = figure.add_subplot()
    axes.set_aspect("equal", adjustable="datalim")
    if len(control):
        axes.plot(*control[:, :2].T, "^", color=SOFT, markersize=6, label=labels["control"], linestyle="none")
    if len(found):
        _points(figure, axes, found, float(extent.max()), labels)
    axes.margins(0.12)
    axes.legend(loc="upper left", fontsize="small")
    return _in_plan(figure, axes, labels)


def _in_plan(figure: Figure, axes: Axes, labels: dict[str, str]) -> Figure:
    axes.set_xlabel(f"{labels['east']}, {labels['unit']}")
    axes.set_ylabel(f"{labels['north']}, {labels['unit']}")
    axes.ticklabel_format(useOffset=False, style="plain")
    decimal_sign(figure, labels["decimal"])
    return figure


def _points(figure: Figure, axes: Axes, found: Compared, extent: float, labels: dict[str, str]) -> None:
    plan, d = found.places[:, :2], found.differences
    heights = np.where(np.isfinite(d[:, 2]), d[:, 2], 0.0)
    most = max(float(np.abs(heights).max()), 1e-12)
    drawn = axes.scatter(
        plan[:, 0],
        plan[:, 1],
        c=heights,
        cmap="RdBu_r",
        vmin=-most,
        vmax=most,
        marker="s",
        s=26,
        edgecolors=INK,
        linewidths=0.5,
        label=labels["check"],
        zorder=3,
    )
    figure.colorbar(drawn, ax=axes, shrink=0.8, label=f"{labels['height']}, {labels['unit']}")
    both = np.isfinite(d[:, :2]).all(axis=1)
    if both.any():
        largest = max(float(np.hypot(*d[both, :2].T).max()), 1e-12)
        scale = largest / (REACH * max(extent, 1e-9))
        style: dict[str, Any] = {"color": VERMILION, "width": 0.003, "zorder": 4}
        arrows(axes, plan[both], d[both, :2], scale, **style)
        own = found.blocks(found.covariance)[both, :2, :2]
        ellipses(axes, plan[both], own, NINETY_FIVE / scale, color=BLUE, linewidth=0.6, zorder=2)
        length = round_length(largest)
        sizes = (f"{size:.3g} {labels['unit']}" for size in (length, length / scale))
        label = " = ".join(sizes).replace(".", labels["decimal"])
        axes.plot([], [], color=VERMILION, label=label)
    if len(found) <= NAMED:
        for name, place in zip(found.names, plan, strict=True):
            axes.annotate(name, place, (4, 4), textcoords="offset points", fontsize="x-small", color=SOFT)


def lengths(found: Lengths, labels: dict[str, str]) -> Figure:
    """Draw errors of calibrated lengths over these, with one standard deviation, and their limits."""
    figure = new_figure(WIDTH, 3.0)
    axes = figure.add_subplot()
    order = np.argsort(found.calibrated, kind="stable")
    test = found.test
    axes.errorbar(found.calibrated, test.errors, test.sd, fmt="o", color=BLUE, markersize=3, elinewidth=0.7)
    if test.limits is not None:
        for sign in (1.0, -1.0):
            limits = sign * test.limits[order]
            axes.plot(found.calibrated[order], limits, "--", color=VERMILION, linewidth=0.9)
    axes.axhline(0.0, color=SOFT, linewidth=0.6)
    axes.set_xlabel(f"{labels['length']}, {labels['unit']}")
    axes.set_ylabel(f"{labels['error']}, {labels['unit']}")
    decimal_sign(figure, labels["decimal"])
    return figure


def overlap(result: Result, labels: dict[str, str]) -> Figure | None:
    """Draw how many adjusted photos see each place of the ground; None without footprints."""
    outlines = footprints(result).outlines[:, :, :2]
    outlines = outlines[np.isfinite(outlines).all(axis=(1, 2))]
    if not len(outlines):
        return None
    low, high = outlines.min(axis=(0, 1)), outlines.max(axis=(0, 1))
    cell = float((high - low).max()) / CELLS
    if not cell > 0:
        return None
    x, y = (np.arange(low[k] + cell / 2, high[k], cell) for k in (0, 1))
    counts = photos_per_place(outlines, x, y)
    figure = new_figure(WIDTH, float(np.clip(WIDTH * len(y) / len(x), 2.4, WIDTH)))
    axes = figure.add_subplot()
    shown = np.ma.masked_equal(counts, 0)
    drawn = axes.pcolormesh(x, y, shown, cmap="viridis", shading="nearest", rasterized=True)
    figure.colorbar(drawn, ax=axes, shrink=0.8, label=labels["photos"])
    axes.set_aspect("equal")
    return _in_plan(figure, axes, labels)


def photos_per_place(outlines: Floats, x: Floats, y: Floats) -> Floats:
    """Return (len(y), len(x)) how many of (P, k, 2) closed outlines hold each place of a grid."""
    counts = np.zeros((len(y), len(x)))
    for outline in outlines:
        columns = np.flatnonzero((x >= outline[:, 0].min()) & (x <= outline[:, 0].max()))
        rows = np.flatnonzero((y >= outline[:, 1].min()) & (y <= outline[:, 1].max()))
        if len(columns) and len(rows):
            grid = np.stack(np.meshgrid(x[columns], y[rows]), axis=-1).reshape(-1, 2)
            counts[np.ix_(rows, columns)] += _inside(grid, outline).reshape(len(rows), len(columns))
    return counts


def _inside(places: Floats, outline: Floats) -> Bools:
    """Return which places an outline holds: lines to the east cross it an odd number of times."""
    x, y = places[:, :1], places[:, 1:]
    (x0, y0), (x1, y1) = outline[:-1].T, outline[1:].T
    crosses = (y0 > y) != (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
    return np.asarray((crosses & (x < at)).sum(axis=1) % 2 == 1)
