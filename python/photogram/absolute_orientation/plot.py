"""A plan of the control with its residuals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram.absolute_orientation.stations import Stations
from photogram.arguments.types import Floats
from photogram.show.sketch.marks import Arrows, Line, Mark, Markers, Names, Panel, around
from photogram.show.sketch.plot import Plot
from photogram.show.style import INK, PURPLE, VERMILION, round_length

LONGEST_RESIDUAL = 0.12  # As a part of the larger side of the plan


def control_plot(
    stations: Stations,
    rows: NDArray[np.intp],
    plan: Floats,
    residuals: Floats,
    used: NDArray[np.bool_],
    rms: float,
) -> Plot:
    """Plot control residuals: arrows in plan, bars for elevations."""
    unit = stations.ground_unit
    size = float(np.ptp(plan, axis=0).max())
    largest = float(np.nanmax(np.abs(residuals)))
    factor = LONGEST_RESIDUAL * size / largest if largest > 0 else 0.0
    high = float(np.clip(5.5 * np.ptp(plan[:, 1]) / (np.ptp(plan[:, 0]) or 1.0), 2.0, 8.0))
    vectors, ends = _residuals(plan, residuals * factor)
    names = [stations.ids[row] for row in rows.tolist()]
    length = round_length(LONGEST_RESIDUAL * size / factor) if factor else 0.0
    panel = Panel(
        around(np.vstack([plan, ends]), 0.1),
        [*_stations(used, plan), *vectors, Names(plan, names, [INK] * len(names), ends)],
        f"Residuals of control, rms {rms:.3g} {unit}",
        f"X, {unit}",
        f"Y, {unit}",
        equal=True,
        bars=[(length * factor, INK, f"{length:g} {unit}, given minus transformed")] if factor else [],
        legend="below",
    )
    return Plot(6.5, high + 1.8, [panel])


def _stations(used: NDArray[np.bool_], plan: Floats) -> list[Mark]:
    full, plan_only = used.all(axis=1), ~used[:, 2]
    kinds = (
        ("full control", full, "^"),
        ("horizontal control", plan_only, "s"),
        ("height control", ~(full | plan_only), "o"),
    )
    return [
        Markers(plan[chosen], shape, 6.0, face="none", label=name)
        for name, chosen, shape in kinds
        if chosen.any()
    ]


def _residuals(plan: Floats, enlarged: Floats) -> tuple[list[Mark], Floats]:
    """Return marks of scaled residuals, and points along them to be avoided by names."""
    flat, high = np.isfinite(enlarged[:, :2]).any(axis=1), np.isfinite(enlarged[:, 2])
    steps = np.nan_to_num(enlarged)
    up = np.column_stack([np.zeros(len(plan)), steps[:, 2]])
    marks: list[Mark] = []
    if flat.any():
        marks.append(Arrows(plan[flat], steps[flat, :2], VERMILION, 0.004, label="plan residual", layer=3.0))
    bars = np.stack([plan[high], plan[high] + up[high]], axis=1)
    marks.append(Line(bars, PURPLE, 3.0, label="height residual (up: positive)"))
    parts = np.linspace(0.25, 1.0, 4)[:, np.newaxis, np.newaxis]
    return marks, np.concatenate([plan + parts * steps[:, :2], plan + parts * up]).reshape(-1, 2)
