"""Trajectory corrections over time, with standard deviations."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.messages import unknown_name
from photogram.show.sketch.marks import Line, Mark, Panel, band, error_bars, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, GREEN, INK, VERMILION
from photogram.words import phrase

TIMES_OF_CURVE = 160
COLOURS = (BLUE, VERMILION, GREEN)
TICK_HEIGHT = 0.03  # Of the times of observations, as a part of the height of the panel


def trajectory(result: Any, *, name: str | None = None) -> Plot:
    """Plot trajectory corrections over time, with one standard deviation bands.

    The left panel shows positions, the right one rotations about the axes of the photo. Lines below mark the
    times of further observations of the trajectory.

    Parameters
    ----------
    name
        Of the trajectory; None: the first.

    Raises
    ------
    InputError
        A trajectory that is not there, or that has one record.
    AdjustmentError, OutOfMemoryError
        As :meth:`photogram.Result.covariance`.
    """
    every = result.trajectories
    name = next(iter(every), "") if name is None else name
    if name not in every:
        raise InputError(unknown_name("trajectory", name, every) if every else phrase("plot.trajectory"))
    own = every[name]
    first, last = own.given.table.span
    if not last > first:
        raise InputError(phrase("plot.span", name=name))
    times = np.linspace(first, last, TIMES_OF_CURVE)
    corrections, sd = own.corrections(times), own.poses(times).sd
    records = [
        each.moment.time
        for each in result.block.observations
        if each.moment is not None and each.moment.trajectory is own.given
    ]
    unit = result.block.linear_unit
    heads = f"position, {unit}", "rotation, rad"
    panels = list[Panel]()
    for values, rooms, head in zip(corrections, np.split(sd, 2, axis=1), heads, strict=True):
        (low, high), marks = spread(values - rooms, values + rooms), list[Mark]()
        for k, (own, room, colour) in enumerate(zip(values.T, rooms.T, COLOURS, strict=True)):
            marks.append(band(times, own - room, own + room, colour, 0.2))
            marks.append(Line(np.column_stack([times, own]), colour, 1.2, label="xyz"[k]))
        if records:  # The times of observations
            feet = np.column_stack([records, np.full(len(records), low)])
            tops = feet[:, 1] + TICK_HEIGHT * (high - low)
            marks.append(Line(error_bars(feet, feet[:, 1], tops), INK, 1.0))
        panels.append(Panel(np.column_stack([spread(times), (low, high)]), marks, "", "time, s", head))
    panels[0] = replace(panels[0], title=name, legend="below")
    return Plot(9.0, 3.4, panels, 2)
