"""A plan of the control with its residuals."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from photogram.absolute_orientation.orientation import Orientation
from photogram.arguments.types import Floats
from photogram.show.axes import Where, figure_of, labels, panels, scale_bars
from photogram.show.methods import axes_of
from photogram.show.pictures import arrows, round_length
from photogram.show.style import INK, PURPLE, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LONGEST = 0.12
"""Length of the longest residual, as a fraction of the plan's larger side."""
WIDE = 4.0
"""Inches of axes beyond which the legend has two columns."""


def figure(result: Orientation) -> Figure:
    """Return the plan of :func:`residuals` as a figure that belongs to no window."""
    return figure_of(partial(residuals, result))


@axes_of.register(Orientation)
def residuals(result: Orientation, ax: Where = None) -> Axes:
    """Draw plan residuals as arrows and those of elevations as bars, given minus transformed.

    Parameters
    ----------
    result
        An orientation.
    ax
        Axes, or a figure to put them in; a new figure when None.

    Returns
    -------
    The axes.

    Raises
    ------
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    """
    rows = np.flatnonzero(result.took_part)
    plan = result.adjusted_control[rows, :2]
    own, unit = result.residuals_ground[rows], result.stations.ground_unit
    size = float(np.ptp(plan, axis=0).max())
    largest = float(np.nanmax(np.abs(own)))
    factor = LONGEST * size / largest if largest > 0 else 0.0
    high = float(np.clip(5.5 * np.ptp(plan[:, 1]) / (np.ptp(plan[:, 0]) or 1.0), 2.0, 8.0))
    with panels(ax, 1, 1, 6.5, high + 1.8) as [axes]:
        _stations(axes, result, rows, plan)
        ends = _residuals(axes, plan, own * factor)
        axes.set_aspect("equal")
        axes.margins(0.1)
        axes.autoscale_view()
        axes.ticklabel_format(useOffset=False, style="plain")
        axes.set_xlabel(f"X, {unit}")
        axes.set_ylabel(f"Y, {unit}")
        axes.locator_params(nbins=6)
        # Below the labels of the axis: beside small axes there would be no room for names.
        room = axes.get_window_extent().width / axes.figure.dpi
        columns = 2 if room > WIDE else 1
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, 0.0), borderaxespad=4.5, ncols=columns)
        axes.set_xlim(axes.get_xlim())
        axes.set_ylim(axes.get_ylim())
        rms = result.rms / result.similarity.scale
        length = round_length(LONGEST * size / factor) if factor else 0.0
        bars = [(length * factor, INK, f"{length:g} {unit}, given minus transformed")] if factor else []
        scale_bars(axes, bars, f"Residuals of control, rms {rms:.3g} {unit}")
        names = [result.stations.ids[row] for row in rows.tolist()]
        labels(axes, plan, names, [INK] * len(names), ends, gap=6.0)
    return axes


def _stations(axes: Axes, result: Orientation, rows: NDArray[np.intp], plan: Floats) -> None:
    used = result.used[rows]
    full, plan_only = used.all(axis=1), ~used[:, 2]
    kinds = (
        ("full control", full, "^"),
        ("horizontal control", plan_only, "s"),
        ("height control", ~(full | plan_only), "o"),
    )
    for name, chosen, marker in kinds:
        if chosen.any():
            axes.plot(*plan[chosen].T, marker, color=INK, markerfacecolor="none", label=name)


def _residuals(axes: Axes, plan: Floats, enlarged: Floats) -> Floats:
    """Draw residuals, already in the scale of the plan; return places along them, which names spare."""
    flat = np.isfinite(enlarged[:, :2]).any(axis=1)
    steps = np.nan_to_num(enlarged)
    if flat.any():
        arrows(axes, plan[flat], steps[flat, :2], width=0.004, zorder=3, color=VERMILION)
        axes.plot([], [], color=VERMILION, label="plan residual")
    high = np.isfinite(enlarged[:, 2])
    up = np.column_stack([np.zeros(len(plan)), steps[:, 2]])
    ends = plan[high] + up[high]
    axes.vlines(
        plan[high, 0],
        plan[high, 1],
        ends[:, 1],
        color=PURPLE,
        linewidth=3,
        label="height residual (up: positive)",
    )
    # Bars do not widen the limits of the axes by themselves.
    axes.update_datalim(ends)
    parts = np.linspace(0.25, 1.0, 4)[:, np.newaxis, np.newaxis]
    return np.concatenate([plan + parts * steps[:, :2], plan + parts * up]).reshape(-1, 2)
