"""What the adjustment has moved a trajectory by, over time, with its standard deviation."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.errors import InputError
from photogram.show.axes import Where, handed_out, panels
from photogram.show.style import INK

TIMES = 160
"""At which corrections and their bands are computed."""
COLOURS = ("#0072b2", "#d55e00", "#009e73")


def trajectory(result: Any, ax: Where = None, *, name: str | None = None) -> Any:
    """Draw the corrections of a trajectory over time, bands of one standard deviation about them.

    Below stand the times of observations beside images that are of it.

    Parameters
    ----------
    result
        An adjusted block that has trajectories.
    ax
        Two axes, or a figure to put them in; a new one when None.
    name
        Of the trajectory; None: the first.

    Returns
    -------
    An array of two axes: corrections of positions, and rotations about the axes of the photo.

    Raises
    ------
    InputError
        A trajectory that is not there, or that has one record; another number of axes.
    AdjustmentError, OutOfMemoryError
        As :meth:`photogram.Result.covariance`.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    """
    every = result.trajectories
    name = next(iter(every), "") if name is None else name
    if name not in every:
        raise InputError(f"the block has no trajectory {name}" if name else "the block has no trajectory")
    own = every[name]
    first, last = own.given.table.span
    if not last > first:
        raise InputError(f"the trajectory {name} has one record, and so no span of time")
    times = np.linspace(first, last, TIMES)
    corrections, sd = own.corrections(times), own.poses(times).sd
    records = [
        each.moment.time
        for each in result.block.observations
        if each.moment is not None and each.moment.trajectory is own.given
    ]
    unit = result.block.linear_unit
    with panels(ax, 1, 2, 9.0, 3.4) as axes:
        for part, (axis, head) in enumerate(zip(axes, (f"position, {unit}", "rotation, rad"), strict=True)):
            for k, colour in enumerate(COLOURS):
                value, own_sd = corrections[part][:, k], sd[:, 3 * part + k]
                axis.fill_between(times, value - own_sd, value + own_sd, color=colour, alpha=0.2, linewidth=0)
                axis.plot(times, value, color=colour, linewidth=1.2, label="xyz"[k])
            low = axis.get_ylim()[0]
            axis.plot(records, np.full(len(records), low), "|", color=INK, markersize=5, clip_on=False)
            axis.set(xlabel="time, s", ylabel=head)
        axes[0].legend(loc="best", frameon=False, ncols=3)
        axes[0].set_title(name, loc="left", fontsize=10)
    return handed_out(axes)
