"""Curves of radial distortion with what is known of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.plots.panels import Where, handed_out, panels
from photogram.plots.picture_data import Curves, pictured
from photogram.show.style import COLOURS, FAINT, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CAMERAS = 3
"""That are drawn at most, side by side."""


def distortion(result: object, ax: Where = None) -> Any:
    """Draw the radial distortion of cameras: the curve, its balanced form, and their standard deviations.

    Bands are one standard deviation to either side; what is beyond all images is dashed.

    Parameters
    ----------
    result
        An adjusted block or collection.
    ax
        Axes, as many as there are panels (three below each other for each camera of a block, two for a
        collection; three cameras at most), or a figure to put them in; a new one when None.

    Returns
    -------
    An array of axes, row by row.

    Raises
    ------
    InputError
        No camera has radial distortion; another number of axes.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    TypeError
        A result without photos and points.
    """
    cameras = pictured(result).distortion[:CAMERAS]
    if not cameras:
        raise InputError("there is no distortion to draw: no camera has radial terms, or they are all zero")
    rows, columns = max(rows_of(each) for each in cameras), len(cameras)
    width = 6.4 if columns == 1 else 4.8 * columns
    with panels(ax, rows, columns, width, 0.6 + 2.3 * rows, sharex="col") as found:
        for column, each in enumerate(cameras):
            draw_curves(found[column::columns], each)
    return handed_out(found)


def rows_of(curves: Curves) -> int:
    """Return how many panels the curves of a camera have: one for each, and one for standard deviations."""
    return len(curves.curves) + any(curve.bands for curve in curves.curves)


def draw_curves(panels: list[Axes], curves: Curves) -> None:
    """Draw the curves of one camera into panels below each other."""
    factor, unit = curves.shown_as
    seen = curves.radii <= curves.observed
    taken = 0
    for number, (axes, curve) in enumerate(zip(panels, curves.curves, strict=False)):
        for other in curves.others:
            axes.plot(curves.radii, factor * other, color=FAINT, linewidth=0.5, alpha=0.5)
        for name, sd in curve.bands.items():
            low, high = factor * (curve.values - sd), factor * (curve.values + sd)
            colour = COLOURS[taken % len(COLOURS)]
            taken += 1
            axes.fill_between(
                curves.radii, low, high, alpha=0.3, linewidth=0, color=colour, label=f"± sd of the {name}"
            )
            # Bands are thin on curves of hundreds of micrometres: once more by themselves.
            _dashed(panels[-1], curves.radii, factor * sd, seen, colour, f"sd of the {name}")
        _dashed(axes, curves.radii, factor * curve.values, seen, INK, "")
        axes.axhline(0.0, color=FAINT, linewidth=0.5)
        if len(curves.others):
            # Single photos whose curves go astray do not set the scale.
            ends = np.quantile(factor * curves.others, [0.1, 0.9], axis=0)
            bottom = min(0.0, float(ends.min()), float(factor * curve.values.min()))
            top = max(0.0, float(ends.max()), float(factor * curve.values.max()))
            axes.set_ylim(bottom - 0.1 * (top - bottom), top + 0.1 * (top - bottom))
        axes.set_title(curve.name if number else f"Radial distortion of {curves.camera}")
        if curve.bands:
            axes.legend(loc="best")
        axes.set_ylabel(unit)
    if taken:
        panels[rows_of(curves) - 1].set_ylim(bottom=0.0)
        panels[-1].set_ylabel(f"sd, {unit}")
        panels[-1].legend(loc="best")
    panels[-1].set_xlabel(f"radius, {curves.unit}; dashed beyond {curves.observed:.4g}, where images end")


def _dashed(axes: Axes, radii: Floats, values: Floats, seen: Any, colour: str, label: str) -> None:
    last = max(int(np.count_nonzero(seen)), 1)
    axes.plot(radii[:last], values[:last], color=colour, label=label or None)
    axes.plot(radii[last - 1 :], values[last - 1 :], color=colour, linestyle="--")
