"""The document of variance components: what to do, their plot and their table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import replace
from photogram.show.judgement import judged
from photogram.show.page import Document, Drawing, Part, Remarks, Section
from photogram.show.quantity import Quantity, Table, column, of_each
from photogram.show.sketch.marks import Line, Mark, Markers, Panel
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.components import Component
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import VarianceComponents

INCHES_OF_COMPONENT = 0.32
MARGIN = 1.1  # Limits over the extreme values


def components_document(found: VarianceComponents) -> Document:
    verdict = found.verdict
    judgement, sections = judged(verdict), [components_section(found)]
    return Document("Variance components", "", [judgement], verdict.next, [], sections)


def weighed_document(found: VarianceComponents, network: Document) -> Document:
    """Return the document of the network with the given weights, judged by the components."""
    own = components_document(found)
    sections = [*own.sections, *network.sections]
    return replace(network, judgements=own.judgements, advice=own.advice, sections=sections)


def components_section(found: VarianceComponents) -> Section:
    """Return the section: which standard deviations are wrong, factors with their intervals."""
    caption = "Factors of the given standard deviations with their intervals (95 percent)."
    parts: list[Part] = [
        Remarks([*map(str, statement(found))]),
        Drawing("picture-components", "Variance components", caption, found.plot),
        components_table(found),
    ]
    if found.estimate.messages:
        parts.append(Remarks([*map(str, found.estimate.messages)]))
    intro = (
        "Factors of the standard deviations of groups of observations, estimated from the residuals. The"
        " adjustment has the given weights."
    )
    return Section("components", "Variance components", parts, intro)


def components_table(found: VarianceComponents) -> Table:
    rows, reference = found.components, found.estimate.reference
    low, high = np.array([each.interval for each in rows]).reshape(-1, 2).T
    outcomes = [
        "held" if each.held else "to be changed" if each.worth_changing else "stands" for each in rows
    ]
    held = np.array([bool(each.held) for each in rows], dtype=bool)
    columns = [
        of_each(rows, "name", kind="name", name="group", head="Group"),
        of_each(rows, "count", name="observations", head="Number", decimals=0),
        of_each(rows, "redundancy", name="redundancy", head="Redundancy", decimals=2),
        of_each(rows, "squares", name="sum_of_squares", head="Weighted sum of squares", decimals=2),
        of_each(rows, "factor", name="factor", head="Component", decimals=3),
        of_each(rows, "sd", name="sd_factor", head="sd", decimals=3),
        of_each(rows, "least_sd", name="least_sd_factor"),
        column("low", low, "From", decimals=3),
        column("high", high, "To", decimals=3),
        of_each(rows, "factor_of_sd", name="factor_of_sd", head="Factor of sd", decimals=3),
        column("factor_to_images", [each.factor / reference for each in rows], "To images", decimals=3),
        of_each(rows, "test_value", name="test_value"),
        of_each(rows, "probability", name="probability", head="p", figures=2, seen=~held),
        of_each(rows, "significant", name="significant"),
        of_each(rows, "held", kind="name", name="held"),
        Quantity(outcomes, kind="name", head="Outcome"),
    ]
    note = "The interval holds the true component with 95 percent: the factor of the variance."
    return Table("components", "Components", columns, note)


def statement(found: VarianceComponents) -> list[Phrase]:
    """Return the messages on what to do."""
    estimate = found.estimate
    if not estimate.converged:
        return [phrase("variance.not-converged")]
    messages = []
    for each in found.worth_changing:
        factor, ends = each.factor_of_sd, [math.sqrt(end) for end in each.interval]
        if factor < 1:
            factor, ends = 1 / factor, [1 / end for end in reversed(ends)]
        code = f"variance.{'small' if each.factor > 1 else 'large'}"
        messages.append(phrase(code, group=each.name, factor=factor, low=ends[0], high=ends[1]))
    messages = messages or [phrase("variance.unchanged")]
    if estimate.equality is not None:
        ratio, freedom, probability = estimate.equality
        messages.append(phrase("variance.equal", p=probability, ratio=ratio, freedom=freedom))
    return messages


def components_sketch(components: Sequence[Component]) -> Plot:
    marks: list[Mark] = []
    for place, each in enumerate(components):
        at = np.array([[each.factor_of_sd, place]])
        if each.held:
            marks.append(Markers(at, "o", 6.0, FAINT, "none"))
            continue
        colour = MARKED if each.worth_changing else INK
        ends = np.column_stack([np.sqrt(each.interval), [place, place]])
        marks += [Line(ends, colour), Markers(at, "o", 6.0, colour)]
    known = np.concatenate([mark.places[:, 0] for mark in marks if isinstance(mark, Line | Markers)])
    known = np.append(known[np.isfinite(known) & (known > 0)], 1.0)
    up = (len(components) - 0.5, -0.5)
    limits = np.column_stack([(known.min() / MARGIN, known.max() * MARGIN), up])
    given = Line(np.column_stack([[1.0, 1.0], up]), FAINT, 0.8)
    across = "factor of the given standard deviation, 95 percent; circles: held"
    names = [each.name for each in components]
    panel = Panel(limits, [given, *marks], "", across, up_names=names, log_across=True)
    return Plot(6.4, 1.6 + INCHES_OF_COMPONENT * len(components), [panel])
