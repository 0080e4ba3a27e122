"""Pictures of what calibrations are worth (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Floats
from photogram.plots.panels import Where, handed_out, note, panels, placed
from photogram.show.pictures import arrows, round_length
from photogram.show.style import BLUE, COLOURS, FAINT, INK, ORDERED, VERMILION
from photogram.targets.compared import Difference
from photogram.targets.maps import UncertaintyCurve, UncertaintyMap, distance_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_difference", "draw_uncertainty", "draw_uncertainty_against_distance", "steps_of_125"]

DOTS = 4000
"""Corners that are drawn: of more every so many-th."""
ARROWS = 24
"""Vectors along the longer side of a picture."""
WIDTH = 7.6
"""Inches."""
FARTHEST = 2.0
"""Decades of contours below the largest."""
SHADES = 4
"""Of colour from one contour to the next."""


def draw_uncertainty(found: UncertaintyMap, path: Path | None = None, ax: Where = None) -> Any:
    """Draw a map of the uncertainty of projection: contours, the corners that were seen and their hull.

    Parameters
    ----------
    found
        The map.
    path
        Of a file for the picture, in the format that its suffix names; None: none is written.
    ax
        Axes, or a figure to put them in; a new figure when None.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError
        A suffix that names no format.
    ModuleNotFoundError
        matplotlib is absent.
    """
    return placed(partial(_uncertainty, found), path, ax)


def draw_difference(found: Difference, path: Path | None = None, ax: Where = None) -> Any:
    """Draw the difference of two calibrations: its length as contours, its vectors; a panel each distance.

    Parameters
    ----------
    found
        The difference.
    path, ax
        As of :func:`draw_uncertainty`; as many axes as there are distances, and as many more where it is
        drawn beside what the uncertainties explain.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`draw_uncertainty`.
    """
    return placed(partial(_difference, found), path, ax)


def draw_uncertainty_against_distance(
    curves: Sequence[UncertaintyCurve], path: Path | None = None, ax: Where = None
) -> Any:
    """Draw the uncertainty of projection against distance, a curve for each pixel, with its minimum.

    Parameters
    ----------
    curves
        The curves.
    path, ax
        As of :func:`draw_uncertainty`.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`draw_uncertainty`.
    """
    return placed(partial(_against_distance, curves), path, ax)


def steps_of_125(low: float, high: float) -> Floats:
    """Return values 1, 2, 5 times powers of ten that enclose what lies between two positive numbers."""
    start = round_length(max(low, high / 10**FARTHEST))
    powers = np.arange(math.floor(math.log10(start)), math.ceil(math.log10(high)) + 1)
    steps = np.concatenate([np.array([1.0, 2.0, 5.0]) * 10.0**power for power in powers])
    above = np.flatnonzero(steps >= high * (1 - 1e-9))
    return np.asarray(steps[(steps >= start * (1 - 1e-9)) & (np.arange(len(steps)) <= above[0])])


def _uncertainty(found: UncertaintyMap, ax: Where) -> Any:
    with panels(ax, 1, 1, WIDTH, _height(found.size)) as (axes,):
        _contours(axes, found.columns, found.rows, found.sd, "px")
        _seen(axes, found.corners, found.coverage)
        _frame(axes, found.size)
        axes.set_title(f"{found.title}\n{found.model}", fontsize=9.0)
    return handed_out([axes])


def _difference(found: Difference, ax: Where) -> Any:
    chi2 = found.chi2
    rows = len(found.distances)
    columns = 1 if chi2 is None else 2
    with panels(ax, rows, columns, WIDTH * columns, rows * _height(found.size)) as axes:
        for number, distance in enumerate(found.distances):
            here = axes[number * columns]
            _contours(here, found.columns, found.rows, found.lengths[number], "px")
            _vectors(here, found, number)
            _frame(here, found.size)
            names = f"{found.cameras[1]} less {found.cameras[0]}"
            here.set_title(f"{names} {distance_text(distance, found.unit)}, px", fontsize=9.0)
            if chi2 is not None:
                beside = axes[number * columns + 1]
                _contours(beside, found.columns, found.rows, chi2[number], "")
                _frame(beside, found.size)
                beside.set_title(
                    "over what uncertainties explain: d' Q⁻¹ d / 2, about 1 where they do", fontsize=9.0
                )
        note(axes[-columns], found.remarks)
    return handed_out(axes)


def _against_distance(curves: Sequence[UncertaintyCurve], ax: Where) -> Any:
    from matplotlib.ticker import LogLocator, NullFormatter

    with panels(ax, 1, 1, WIDTH, 4.2) as (axes,):
        for each, colour in zip(curves, cycle(COLOURS), strict=False):
            finite = np.isfinite(each.distances)
            x, y = each.pixel
            axes.plot(each.distances[finite], each.sd[finite], color=colour, label=f"pixel {x:g}, {y:g}")
            for value in each.sd[~finite]:
                axes.axhline(value, color=colour, linestyle=":", linewidth=0.8)
            if np.isfinite(each.minimum[0]):
                axes.plot(*each.minimum, marker="o", markersize=5, color=colour)
        first = curves[0]
        axes.set(xscale="log", yscale="log", xlabel=f"distance, {first.unit}", ylabel="sd, px")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
        axes.grid(color=FAINT, alpha=0.25, linewidth=0.5)
        axes.set_title(
            f"{first.camera}: standard deviation of projection (datum {first.datum});"
            " dots: smallest, dotted: at infinity",
            fontsize=9.0,
        )
        axes.legend()
    return handed_out([axes])


def _height(size: tuple[int, int]) -> float:
    return 1.1 + 0.82 * WIDTH * size[1] / size[0]


def _contours(axes: Axes, columns: Floats, rows: Floats, values: Floats, unit: str) -> None:
    """Draw filled contours at 1, 2, 5 steps with their values on the lines."""
    from matplotlib.colors import LogNorm
    from matplotlib.patheffects import withStroke

    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return
    levels = steps_of_125(float(positive.min()), float(positive.max()))
    norm = LogNorm(levels[0], levels[-1])
    shown = np.ma.masked_invalid(values)
    places = np.arange(SHADES * (len(levels) - 1) + 1) / SHADES
    shades = np.exp(np.interp(places, np.arange(len(levels)), np.log(levels)))
    filled = axes.contourf(columns, rows, shown, shades, cmap=ORDERED, norm=norm, extend="min")
    lines = axes.contour(columns, rows, shown, levels, colors=INK, linewidths=0.7)
    for text in axes.clabel(lines, fmt=lambda value: f"{value:g}", fontsize=8.0):
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    bar = axes.figure.colorbar(filled, ax=axes, shrink=0.85, ticks=levels, format="%g")
    bar.ax.minorticks_off()
    bar.set_label(unit)


def _seen(axes: Axes, corners: Floats, coverage: Floats) -> None:
    if not len(corners):
        return
    step = -(-len(corners) // DOTS)
    axes.plot(*corners[::step].T, ".", color=INK, markersize=2.5, alpha=0.6, markeredgewidth=0.0)
    axes.plot(*np.vstack([coverage, coverage[:1]]).T, color=VERMILION, linewidth=1.2)


def _vectors(axes: Axes, found: Difference, number: int) -> None:
    """Draw some of the vectors, the longest where the board was seen as long as their distance."""
    step = max(1, round(len(found.columns) / ARROWS))
    every = (slice(None, None, step), slice(None, None, step))
    places = np.stack(np.meshgrid(found.columns, found.rows), axis=-1)[every].reshape(-1, 2)
    vectors = found.vectors[number][every].reshape(-1, 2)
    largest = float(np.nanmax(np.where(found.inside, found.lengths[number], np.nan)))
    known = np.hypot(*vectors.T) <= 2 * largest
    spacing = step * (found.columns[1] - found.columns[0])
    arrows(axes, places[known], vectors[known], scale=largest / spacing, color=BLUE, width=0.002)


def _frame(axes: Axes, size: tuple[int, int]) -> None:
    axes.set(xlim=(-0.5, size[0] - 0.5), ylim=(size[1] - 0.5, -0.5), aspect="equal")
    axes.set(xlabel="column, px", ylabel="row, px")


check_arguments(globals(), ["draw_difference", "draw_uncertainty", "draw_uncertainty_against_distance"])
