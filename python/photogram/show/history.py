"""Values on several occasions as tables and control charts, of whatever they are."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from photogram.show.page import Cell, Column, Row, Table, decimals_of, fixed
from photogram.show.pictures import new_figure
from photogram.show.style import FAINT, INK, MARKED, in_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.statistics.history import History, Series

__all__ = ["control_charts", "history_document", "series_table", "values_table"]

ACROSS = 3
"""Charts beside each other."""


def series_table(history: History, whose: str) -> Table:
    """Return one line for each quantity: mean, drift, the largest test of a step, and what was found."""
    columns = (
        Column("Quantity", text=True),
        Column("Unit", text=True),
        Column("Mean"),
        Column("sd", figures=2),
        Column("Drift a unit of time", figures=3),
        Column("sd", figures=2),
        Column("Largest t of a step", decimals=2),
        Column("p of constancy", figures=2),
        Column("Found", text=True),
    )
    note = (
        f"Of {history.tests} single tests together one rejects by chance with probability {history.level:g}:"
        f" |t| beyond {history.limit:.3g} is accepted. Drift and steps as if nothing else changed."
    )
    return Table(f"What changed in {whose}", columns, [_line(own) for own in history.series], note)


def _line(own: Series) -> Row:
    found = ", ".join(change.kind for change in own.changes)
    steps = [t for t in own.steps.tolist() if not math.isnan(t)]
    return [
        own.name,
        _micro(own.unit),
        Cell(fixed(own.mean, decimals_of(own.sd)), sorts=own.mean),
        own.mean_sd,
        None if math.isnan(own.drift) else own.drift,
        None if math.isnan(own.drift) else own.drift_sd,
        max(steps, key=abs, default=None),
        own.test.probability_above if own.test else None,
        Cell(found or "constant", tone="look" if found else ""),
    ]


def values_table(history: History, whose: str) -> Table:
    """Return all values: what was determined on each occasion, and how far it is from the others."""
    columns = (
        Column("Quantity", text=True),
        Column("Occasion", text=True),
        Column("Value"),
        Column("sd", figures=2),
        Column("Less the others", figures=3),
        Column("t", decimals=2),
        Column("Unit", text=True),
    )
    rows: list[Row] = []
    for own in history.series:
        for k, occasion in enumerate(history.occasions):
            value, off = float(own.values[k]), float(own.off[k])
            t = off / float(own.off_sd[k])
            beyond = abs(t) > history.limit
            rows.append(
                [
                    own.name,
                    occasion,
                    Cell(fixed(value, decimals_of(own.sd)), sorts=value),
                    float(own.sd[k]),
                    off,
                    Cell(f"{t:.2f}", tone="look" if beyond else "", sorts=t),
                    _micro(own.unit),
                ]
            )
    return Table(f"All values of {whose}", columns, rows)


def _micro(unit: str) -> str:
    """Return a unit as pages write it."""
    return unit.replace("um", "µm").replace("arc seconds", "″").replace("percent", "%")


@in_style
def control_charts(history: History, title: str) -> Figure:
    """Draw every quantity over time: values with their standard deviations, mean, limits, what changed.

    Dashed lines are where |t| of a value against the others reaches the limit of all tests. Marked is what is
    beyond. Needs matplotlib (`pip install 'photogram[plots]'`).
    """
    count = len(history.series)
    across = min(ACROSS, count)
    figure = new_figure(3.6 * across, 2.2 * -(-count // across) + 0.5)
    panels = figure.subplots(-(-count // across), across, squeeze=False, sharex=True).ravel().tolist()
    for panel in panels[count:]:
        panel.set_visible(False)
    t = history.times
    for panel, own in zip(panels, history.series, strict=False):
        panel.errorbar(t, own.values, own.sd, fmt="o", color=INK, markersize=3.5, linewidth=1.0)
        expected = own.values - own.off
        for sign in (-1, 1):
            panel.plot(t, expected + sign * history.limit * own.off_sd, "--", color=FAINT, linewidth=0.8)
        panel.axhline(own.mean, color=FAINT, linewidth=0.8)
        if own.changes:
            panel.plot(t, own.model, color=MARKED, linewidth=1.2)
        else:
            beyond = abs(own.off) > history.limit * own.off_sd
            panel.plot(t[beyond], own.values[beyond], "o", color=MARKED, markersize=6, fillstyle="none")
        panel.set_title(own.name, fontsize=9)
        panel.set_ylabel(_micro(own.unit))
        panel.ticklabel_format(useOffset=False)
    figure.suptitle(title, fontsize=11)
    return figure


def history_document(history: History) -> dict[str, object]:
    """Return a history as plain values for a JSON document."""
    return {
        "occasions": list(history.occasions),
        "times": history.times.tolist(),
        "tests": history.tests,
        "level": history.level,
        "limit": history.limit,
        "constancy": {
            "variance": history.constancy.variance,
            "degrees_of_freedom": history.constancy.degrees_of_freedom,
            "probability": history.constancy.probability_above,
        },
        "series": [
            {
                "name": own.name,
                "unit": own.unit,
                "values": own.values.tolist(),
                "sd": own.sd.tolist(),
                "mean": own.mean,
                "mean_sd": own.mean_sd,
                "model": own.model.tolist(),
                "off": own.off.tolist(),
                "off_sd": own.off_sd.tolist(),
                "drift": own.drift,
                "drift_sd": own.drift_sd,
                "steps_t": own.steps.tolist(),
                "probability": own.test.probability_above if own.test else None,
                "changes": [
                    {
                        "kind": change.kind,
                        "size": change.size,
                        "sd": change.sd,
                        "t": change.statistic,
                        "log10_p": change.log10_p,
                        "occasion": None if change.at is None else history.occasions[change.at],
                        "sentence": change.sentence,
                    }
                    for change in own.changes
                ],
            }
            for own in history.series
        ],
    }
