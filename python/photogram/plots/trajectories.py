"""What the adjustment has moved a trajectory by, over time, with its standard deviation."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.show.axes import Where
from photogram.show.sketch.declared import Panel, Sketch, spread
from photogram.show.sketch.marks import Band, Line, Mark, Segments, error_bars
from photogram.show.sketch.on_axes import on_axes
from photogram.show.style import BLUE, GREEN, INK, VERMILION

TIMES = 160
"""At which corrections and their bands are computed."""
COLOURS = (BLUE, VERMILION, GREEN)
TALL = 0.03
"""Marks of the times of observations, of the height of a panel."""


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
    heads = f"position, {unit}", "rotation, rad"
    panels = [
        _panel(times, corrections[part], sd[:, 3 * part : 3 * part + 3], records, head)
        for part, head in enumerate(heads)
    ]
    panels[0] = replace(panels[0], title=name, legend="best")
    return on_axes(Sketch(9.0, 3.4, panels, 2), ax)


def _panel(times: Floats, values: Floats, sd: Floats, records: list[float], head: str) -> Panel:
    """Return (t, 3) corrections with their bands, and the times of observations."""
    low, high = spread(values - sd, values + sd)
    marks = list[Mark]()
    for k, colour in enumerate(COLOURS):
        own, band = values[:, k], sd[:, k]
        marks.append(Band(times, own - band, own + band, colour, 0.2))
        marks.append(Line(np.column_stack([times, own]), colour, 1.2, label="xyz"[k]))
    if records:
        feet = np.column_stack([records, np.full(len(records), low)])
        marks.append(Segments(error_bars(feet, feet[:, 1], feet[:, 1] + TALL * (high - low)), INK, 1.0))
    return Panel(np.column_stack([spread(times), (low, high)]), marks, "", "time, s", head)
