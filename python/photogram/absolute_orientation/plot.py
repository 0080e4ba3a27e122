"""A plan of the control with its residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from photogram.absolute_orientation.orientation import Orientation
from photogram.arguments.types import Floats
from photogram.show.pictures import arrows, drawn, new_figure, round_length
from photogram.show.style import PURPLE, VERMILION
from photogram.show.ways import picture_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure"]


LONGEST = 0.12
"""Length of the longest residual, as a fraction of the plan's larger side."""


@picture_of.register(Orientation)
def picture(result: Orientation) -> bytes:
    """Return the plan as a picture (PNG)."""
    return drawn(figure(result))


def figure(result: Orientation) -> Figure:
    """Draw plan residuals as arrows and those of elevations as bars, given minus transformed.

    Needs matplotlib (`pip install 'photogram[plots]'`).
    """
    made = new_figure(8, 7.5)
    axes = made.add_subplot()
    rows = np.flatnonzero(result.took_part)
    plan = result.adjusted_control[rows, :2]
    residuals = result.residuals_ground[rows]
    size = float(np.ptp(plan, axis=0).max())
    largest = float(np.nanmax(np.abs(residuals)))
    factor = LONGEST * size / largest if largest > 0 else 0.0
    _stations(axes, result, rows, plan)
    _residuals(axes, plan, residuals * factor)
    _key(axes, plan, size, factor, result.stations.ground_unit)
    axes.set_aspect("equal")
    axes.margins(0.15)
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.set_xlabel(f"X, {result.stations.ground_unit}")
    axes.set_ylabel(f"Y, {result.stations.ground_unit}")
    rms = result.rms / result.similarity.scale
    axes.set_title(f"Control, given minus transformed; rms {rms:.3g} {result.stations.ground_unit}")
    axes.locator_params(nbins=6)
    made.legend(loc="outside lower center", ncols=3, frameon=False)
    return made


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
            axes.plot(*plan[chosen].T, marker, color="0.25", markerfacecolor="none", label=name)
    for row, place in zip(rows.tolist(), plan, strict=True):
        axes.annotate(result.stations.ids[row], place, (6, 6), textcoords="offset points", fontsize=8)


def _residuals(axes: Axes, plan: Floats, enlarged: Floats) -> None:
    """Draw residuals, already in the scale of the plan."""
    flat = np.isfinite(enlarged[:, :2]).any(axis=1)
    if flat.any():
        arrows(axes, plan[flat], np.nan_to_num(enlarged[flat, :2]), width=0.004, zorder=3, color=VERMILION)
        axes.plot([], [], color=VERMILION, label="plan residual")
    high = np.isfinite(enlarged[:, 2])
    ends = plan[high, 1] + enlarged[high, 2]
    axes.vlines(
        plan[high, 0], plan[high, 1], ends, color=PURPLE, linewidth=3, label="height residual (up: positive)"
    )
    # Bars do not widen the limits of the axes by themselves.
    axes.update_datalim(np.column_stack([plan[high, 0], ends]))


def _key(axes: Axes, plan: Floats, size: float, factor: float, unit: str) -> None:
    """Draw a bar of a round length below the plan."""
    if factor == 0:
        return
    length = round_length(LONGEST * size / factor)
    corner = plan.min(axis=0) - [0.0, 0.2 * size]
    axes.plot([corner[0], corner[0] + length * factor], [corner[1]] * 2, color="0.25", linewidth=2)
    axes.annotate(f"{length:g} {unit}", corner, (0, -12), textcoords="offset points", fontsize=8)
