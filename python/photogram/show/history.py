"""Values on several occasions as tables and control charts, of whatever they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.show.cells import page_table, unit_written
from photogram.show.judgement import judged, tests_section
from photogram.show.lines import Field, field, table_lines
from photogram.show.page import Document, Drawing, Fact, Part, Section, Table, decimals_of
from photogram.show.quantity import Axis, Quantities, Quantity, component, members, of_each, records
from photogram.show.sketch.declared import Panel, Sketch, spread
from photogram.show.sketch.marks import Level, Line, Mark, Markers, Segments, error_bars
from photogram.show.style import FAINT, INK, MARKED

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.statistics.history import History, Series
    from photogram.statistics.verdict import Verdict

ACROSS = 3
"""Charts beside each other."""


def series(history: History) -> list[Quantity]:
    """Return a row for each quantity: mean, drift, the largest test of a step, and what was found."""
    own = history.series
    axes = tuple(Axis.of(each.name, each.unit) for each in own)
    of, found = np.arange(len(own)), [", ".join(change.kind for change in each.changes) for each in own]
    steps = [max((t for t in each.steps.tolist() if t == t), key=abs, default=np.nan) for each in own]
    p = [each.test.probability_above if each.test else None for each in own]
    names = [found_ or "constant" for found_ in found]
    return [
        component(axes, of)[0],
        of_each(own, "mean", axes, "value", of=of, head="Mean"),
        of_each(own, "mean_sd", axes, "deviation", of=of, head="sd", figures=2),
        of_each(own, "drift", axes, "deviation", of=of, head="Drift a unit of time"),
        of_each(own, "drift_sd", axes, "deviation", of=of, head="sd", figures=2),
        Quantity(np.array(steps), head="Largest t of a step", decimals=2),
        Quantity(p, head="p of constancy", member="probability", figures=2),
        Quantity(names, kind="name", head="Found", marked=np.array([bool(each) for each in found])),
    ]


def series_table(history: History, whose: str) -> Table:
    """Return one line for each quantity: mean, drift, the largest test of a step, and what was found."""
    note = (
        f"Of {history.tests} single tests together one rejects by chance with probability {history.level:g}:"
        f" |t| beyond {history.limit:.3g} is accepted. Drift and steps as if nothing else changed."
    )
    return page_table(f"What changed in {whose}", series(history), note, _deviations(history))


def series_lines(history: History) -> list[str]:
    """Return the same as lines of text; times are years."""
    components, mean, mean_sd, drift, drift_sd, steps, _, found = series(history)
    forms = [f".{decimals_of(each.sd)}f" for each in history.series]
    return table_lines(
        [
            *field(components, 36, gap="  "),
            *field(mean, 9, forms, "mean"),
            *field(mean_sd, 9, forms, "sd"),
            *field(drift, 14, forms, "drift a year"),
            *field(drift_sd, 9, forms, "sd"),
            *field(steps, 8, ".2f", "step t"),
            *field(found, 0, head="found", gap="  "),
        ]
    )


def history_text(calibrations: Sequence[Field], histories: Mapping[str, History]) -> list[str]:
    """Return calibrations as lines of text, and what changed in some things, by what stands above each."""
    lines = table_lines(calibrations)
    for whose, own in histories.items():
        lines += ["", whose, *series_lines(own)]
    return lines


def history_page(
    what: str,
    calibrations: Quantities,
    histories: Mapping[str, History],
    verdict: Verdict,
    highlights: Sequence[Fact],
    *,
    intro: str = "",
    more: Sequence[Section] = (),
) -> Document:
    """Return the page of calibrations in the order of their days, with what changed and `more` sections."""
    days = next(each.values for each in calibrations if each.member == "day")
    named = histories.items()
    sections = [
        charts_section(histories),
        Section("changes", "What changed", [series_table(own, name) for name, own in named], intro),
        Section("calibrations", "Calibrations", [page_table("Calibrations", calibrations)]),
        *more,
        Section("values", "All values", [values_table(own, name) for name, own in named]),
        tests_section(verdict),
    ]
    return Document(
        what=what,
        title=f"{len(days)} calibrations, {days[0]} to {days[-1]}",
        judgements=[judged(verdict)],
        advice=verdict.next,
        highlights=highlights,
        sections=sections,
    )


def charts_section(histories: Mapping[str, History]) -> Section:
    """Return the control charts of some things, by their names, as a section of a page."""
    charts: list[Part] = [
        Drawing(f"charts-{k}", name, "", partial(control_charts, own, name[:1].upper() + name[1:]))
        for k, (name, own) in enumerate(histories.items())
    ]
    return Section("charts", "Control charts", charts, _CHARTS)


_CHARTS = (
    "Each value with its standard deviation; the line is the mean of all. Dashed: beyond, a value differs"
    " from all others, whose common errors are taken into account. Coloured: what was accepted as a change."
)


def values_table(history: History, whose: str) -> Table:
    """Return all values: what was determined on each occasion, and how far it is from the others."""
    own, occasions = history.series, history.occasions
    axes = tuple(Axis.of(each.name, each.unit) for each in own)
    of = np.repeat(np.arange(len(own)), len(occasions))
    values, sd, off, off_sd = (
        np.concatenate([getattr(each, name) for each in own]) for name in ("values", "sd", "off", "off_sd")
    )
    t = off / off_sd
    table = [
        component(axes, of)[0],
        Quantity([*occasions] * len(own), kind="name", head="Occasion"),
        Quantity(values, axes, "value", head="Value", of=of),
        Quantity(sd, axes, "deviation", head="sd", figures=2, of=of),
        Quantity(off, axes, "deviation", head="Less the others", of=of),
        Quantity(t, head="t", decimals=2, marked=np.abs(t) > history.limit),
    ]
    return page_table(f"All values of {whose}", table, by=_deviations(history))


def _deviations(history: History) -> Floats:
    return np.array([each.sd for each in history.series]).T


def control_charts(history: History, title: str) -> Sketch:
    """Return every quantity over time: values with their standard deviations, mean, limits, what changed.

    Dashed lines are where |t| of a value against the others reaches the limit of all tests. Marked is what is
    beyond.
    """
    across = min(ACROSS, len(history.series))
    rows = -(-len(history.series) // across)
    panels = [_chart(history, own) for own in history.series]
    return Sketch(3.6 * across, 2.2 * rows + 0.5, panels, across, shared=True, title=title)


def _chart(history: History, own: Series) -> Panel:
    t, beyond = history.times, abs(own.off) > history.limit * own.off_sd
    places, expected, room = (
        np.column_stack([t, own.values]),
        own.values - own.off,
        history.limit * own.off_sd,
    )
    marks: list[Mark] = [
        Segments(error_bars(places, own.values - own.sd, own.values + own.sd), INK, 1.0),
        Markers(places, "o", 3.5),
        *(Line(np.column_stack([t, expected + sign * room]), FAINT, 0.8, "--") for sign in (-1, 1)),
        Level(own.mean, FAINT, 0.8),
    ]
    if own.changes:
        marks.append(Line(np.column_stack([t, own.model]), MARKED, 1.2))
    else:
        marks.append(Markers(places[beyond], "o", 6.0, MARKED, "none"))
    up = spread(own.values - own.sd, own.values + own.sd, expected - room, expected + room)
    return Panel(np.column_stack([spread(t), up]), marks, own.name, "", unit_written(own.unit))


def history_document(history: History) -> dict[str, object]:
    """Return a history as plain values for a JSON document."""
    own = history.series
    changes = [
        [
            members(change, "kind", "size", "sd", t="statistic", log10_p="log10_p")
            | {"occasion": None if change.at is None else history.occasions[change.at]}
            | {"sentence": change.sentence}
            for change in each.changes
        ]
        for each in own
    ]
    more = [of_each(own, name) for name in ("name", "unit", "values", "sd", "model", "off", "off_sd")]
    table = [*more, *series(history), of_each(own, "steps", member="steps_t")]
    return {
        **members(history, "occasions", "times", "tests", "level", "limit"),
        "constancy": members(history.constancy, "variance", "degrees_of_freedom")
        | {"probability": history.constancy.probability_above},
        "series": records([*table, Quantity(changes, member="changes")]),
    }
