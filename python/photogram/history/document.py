"""Findings and document of values on several occasions: tables and control charts, for any quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.history.changes import Change, History, Series
from photogram.show import quantity
from photogram.show.forms import record, unit_written
from photogram.show.judgement import judged, verdict_table
from photogram.show.page import Document, Drawing, Section, layered
from photogram.show.page import about as explanation
from photogram.show.quantity import Axis, Quantity, Table, component, members_of_each, of_each
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, error_bars, horizontal_line, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.findings import Findings
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.statistics.verdict import Verdict

ACROSS = 3  # Number of charts in a row


def series(history: History, about: str = "") -> Table:
    """Return one row per quantity: mean, drift, largest step test, changes."""
    own = history.series
    axes = tuple(Axis.of(each.name, each.unit) for each in own)
    of, found = np.arange(len(own)), [", ".join(change.kind for change in each.changes) for each in own]
    changes = [[_change(history, change) for change in each.changes] for each in own]
    marked = np.array([bool(text) for text in found])
    steps = [max((t for t in each.steps.tolist() if t == t), key=abs, default=np.nan) for each in own]
    p = [each.test.probability_above if each.test else None for each in own]
    columns = [
        *members_of_each(own, "name", "unit", "values", "sd", "model", "off", "off_sd", steps_t="steps"),
        component(axes, of)[0],
        of_each(own, "mean", axes, "value", of=of, head="Mean"),
        of_each(own, "mean_sd", axes, "deviation", of=of, head="sd", figures=2),
        of_each(own, "drift", axes, "deviation", of=of, head="Drift a unit of time"),
        of_each(own, "drift_sd", axes, "deviation", of=of, head="sd", figures=2),
        Quantity(np.array(steps), head="Largest t of a step", decimals=2),
        Quantity(p, head="p of constancy", member="probability", figures=2),
        Quantity([text or "constant" for text in found], kind="name", head="Found", marked=marked),
        Quantity(changes, member="changes"),
    ]
    note = explanation("series", **quantity.members(history, "tests", "level", "limit"))
    return Table("series", "What changed", columns, note, about, _deviations(history))


def _change(history: History, change: Change) -> dict[str, object]:
    members = quantity.members(change, "kind", "size", "sd", "log10_p", "sentence", t="statistic")
    return members | {"occasion": None if change.at is None else history.occasions[change.at]}


def values(history: History) -> Table:
    """Return all values, one row per occasion, with the difference from the others."""
    own, occasions = history.series, history.occasions
    axes = tuple(Axis.of(each.name, each.unit) for each in own)
    of = np.repeat(np.arange(len(own)), len(occasions))
    names = ("values", "sd", "off", "off_sd")
    values, sd, off, off_sd = (np.concatenate([getattr(each, name) for each in own]) for name in names)
    t = off / off_sd
    columns = [
        component(axes, of)[0],
        Quantity([*occasions] * len(own), kind="name", head="Occasion"),
        Quantity(values, axes, "value", head="Value", of=of),
        Quantity(sd, axes, "deviation", head="sd", figures=2, of=of),
        Quantity(off, axes, "deviation", head="Less the others", of=of),
        Quantity(t, head="t", decimals=2, marked=np.abs(t) > history.limit),
    ]
    return Table("values", "All values", columns, deviations=_deviations(history))


def _deviations(history: History) -> Floats:
    return np.array([each.sd for each in history.series]).T


def history_findings(
    histories: Mapping[str, History], *, remarks: Sequence[Phrase] = (), **fields: Any
) -> Findings:
    """Return the findings of histories by name; `fields` are further fields."""
    changed: list[Phrase | str] = []
    unchanged = []
    for whose, own in histories.items():
        changed += [f"{whose}: {text}" for text in own.sentences]
        failed = None if own.sentences else own.constancy.problem()
        if failed:
            changed.append(Phrase("part.unexplained-change", {"whose": whose, "failed": failed}))
        if not own.has_changed:
            ends = {"whose": whose, "first": own.occasions[0], "last": own.occasions[-1]}
            counts = {"n": len(own.occasions), "quantities": len(own.series)}
            unchanged.append(Phrase("line.unchanged", ends | counts))
    return Findings(
        status="converged",
        changed=changed,
        systematic=[own.systematic(whose) for whose, own in histories.items()],
        remarks=[*unchanged, *remarks],
        **fields,
    )


def history_document(
    what: str,
    calibrations: Table,
    histories: Mapping[str, History],
    verdict: Verdict,
    kind: str,
    parts: Mapping[str, Mapping[str, object]],
    *,
    about: str = "",
    more: Sequence[Section] = (),
    members: Mapping[str, object],
    **fields: Any,
) -> Document:
    """Return the document of dated calibrations, with changes and `more`.

    The JSON member `kind` contains the histories, each with its further members in `parts`. `about` explains
    the changes; `fields` are further fields.
    """
    days = next(column.values for column in calibrations.columns if column.member == "day")
    documents, names = [], ("variance", "degrees_of_freedom")
    for whose, own in histories.items():
        constancy = quantity.members(own.constancy, *names, probability="probability_above")
        own_members = quantity.members(own, "occasions", "times", "tests", "level", "limit")
        tables = [Section.of(series(own, about)), Section.of(values(own))]
        whole = {**parts[whose], **own_members, "constancy": constancy}
        documents.append(Document("", whose, sections=tables, members=whole))
    changes = layered("", "", documents).sections
    charts = [
        Drawing(f"charts-{k}", name, "", partial(control_charts, own, name[:1].upper() + name[1:]))
        for k, (name, own) in enumerate(histories.items())
    ]
    return Document(
        what=what,
        title=f"{len(days)} calibrations, {days[0]} to {days[-1]}",
        judgements=[judged(verdict)],
        advice=verdict.next,
        sections=[
            Section("charts", "Control charts", charts, explanation("charts")),
            *changes[:1],
            Section.of(calibrations),
            *more,
            *changes[1:],
            Section.of(verdict_table(verdict)),
        ],
        members={
            "verdict": verdict.document(),
            kind: {part.title: record(part) for part in documents},
            **members,
        },
        **fields,
    )


def control_charts(history: History, title: str) -> Plot:
    """Return quantities over time: values with sd, mean, limits, changes.

    Dashed lines show values whose |t| against the others equals the critical value of all tests. Values
    beyond are marked.
    """
    across = min(ACROSS, len(history.series))
    rows = -(-len(history.series) // across)
    panels = [_chart(history, own) for own in history.series]
    return Plot(3.6 * across, 2.2 * rows + 0.5, panels, across, shared=True, title=title)


def _chart(history: History, own: Series) -> Panel:
    t, beyond = history.times, abs(own.off) > history.limit * own.off_sd
    places = np.column_stack([t, own.values])
    expected, room = own.values - own.off, history.limit * own.off_sd
    marks: list[Mark] = [
        Line(error_bars(places, own.values - own.sd, own.values + own.sd), INK, 1.0),
        Markers(places, "o", 3.5),
        *(Line(np.column_stack([t, expected + sign * room]), FAINT, 0.8, "--") for sign in (-1, 1)),
        horizontal_line(own.mean, FAINT, 0.8),
    ]
    changed = Line(np.column_stack([t, own.model]), MARKED, 1.2)
    marks.append(changed if own.changes else Markers(places[beyond], "o", 6.0, MARKED, "none"))
    up = spread(own.values - own.sd, own.values + own.sd, expected - room, expected + room)
    return Panel(np.column_stack([spread(t), up]), marks, own.name, "", unit_written(own.unit))
