"""The pages of networks whose observations were judged: by variance components, by data snooping."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from photogram.results.components import VarianceComponents, statement
from photogram.results.snooping_result import LN10, Snooped, estimated_errors, rivals_of
from photogram.show.judgement import judged
from photogram.show.methods import page_of
from photogram.show.page import Column, Document, Drawing, Fact, Part, Remarks, Section, Table
from photogram.statistics.snooping.log import Removal


@page_of.register(VarianceComponents)
def components_page(found: VarianceComponents) -> Document:
    """Return the page of the adjustment with the given weights, and what is wrong about these."""
    return weighed_page(found, page_of(found.first))


def weighed_page(found: VarianceComponents, page: Document) -> Document:
    """Return the page of the adjustment with the given weights, `page`, judged by the components."""
    return replace(
        page,
        judgements=[judged(found.verdict)],
        advice=found.verdict.next,
        sections=[components_section(found), *page.sections],
    )


def components_section(found: VarianceComponents) -> Section:
    """Return what components say, where a page is judged by more than these."""
    return Section("components", "Variance components", _parts(found), _INTRO)


def reweighed_page(changes: Sequence[str], left: VarianceComponents | None, page: Document) -> Document:
    """Return the page of a network whose gross errors were taken out and weights estimated in turn.

    `changes` were made to the weights, `left` are the components of those that it has now, where they were
    estimated, and `page` is that of the network that is left.
    """
    parts: list[Part] = [Remarks(_sentences(changes)), *(_parts(left) if left is not None else [])]
    section = Section("components", "Weights", parts, _CHANGED)
    return replace(page, sections=[section, *page.sections])


def _parts(found: VarianceComponents) -> list[Part]:
    caption = "Factors of the standard deviations with their intervals (95 percent); 1 is what was given."
    parts: list[Part] = [
        Remarks(_sentences(statement(found))),
        Drawing("picture-components", "Variance components", caption, found.plot),
        _table(found),
    ]
    if found.estimate.messages:
        parts.append(Remarks([*map(str, found.estimate.messages)]))
    return parts


def _sentences(said: Sequence[str]) -> list[str]:
    return [f"{each[:1].upper()}{each[1:]}." for each in said]


_CHANGED = "Weights were estimated from the observations that are left: the rest of this page has these."
_INTRO = (
    "By which factors the standard deviations of groups of observations are wrong, as their residuals say."
    " Everything else on this page has the weights that were given."
)


def _table(found: VarianceComponents) -> Table:
    return Table.of(
        "Components",
        found.components,
        [
            (Column("Group", text=True), lambda each: each.name),
            (Column("Number"), lambda each: each.count),
            (Column("Redundancy", decimals=2), lambda each: each.redundancy),
            (Column("Weighted sum of squares", decimals=2), lambda each: each.squares),
            (Column("Factor of sd", decimals=3), lambda each: each.factor_of_sd),
            (Column("From", decimals=3), lambda each: _of_sd(each.interval[0])),
            (Column("To", decimals=3), lambda each: _of_sd(each.interval[1])),
            (Column("p", figures=2), lambda each: None if each.held else each.probability),
            (
                Column("Outcome", text=True),
                lambda each: "held" if each.held else "to be changed" if each.worth_changing else "stands",
            ),
        ],
        "The interval holds the true factor of the standard deviation with 95 percent.",
    )


def _of_sd(factor: float) -> float:
    """Return the factor of a standard deviation of that of its variance."""
    return math.sqrt(max(factor, 0.0)) if math.isfinite(factor) else factor


@page_of.register(Snooped)
def snooped_page(found: Snooped) -> Document:
    """Return the page of the network without what was taken out."""
    page = page_of(found.result)
    gone = Fact("Taken out", f"{len(found.removed)}", note=f"of {len(found.suspects)} groups of observations")
    return replace(page, highlights=[gone, *page.highlights], sections=[_log(found), *page.sections])


def _log(found: Snooped) -> Section:
    table = Table.of(
        "In order",
        found.log,
        [
            (Column("Round", decimals=0), lambda each: each.round),
            (Column("What", text=True), lambda each: each.name),
            (Column("Estimated error", text=True), estimated_errors),
            (Column("T", decimals=2), lambda each: each.statistic),
            (Column("Dimension", decimals=0), lambda each: each.dimension),
            (Column("log10 p", decimals=1), lambda each: each.log_probability / LN10),
            (Column("Redundancy", decimals=3), lambda each: each.redundancy),
            (Column("Or instead", text=True), lambda each: rivals_of(each.rivals[:3], 2)),
            (Column("Now", text=True), _state),
        ],
    )
    consequences = [f"{each.name}: {line}" for each in found.log for line in each.consequences]
    sentences = [*([] if found.log else ["Nothing was taken out."]), *found.outcome.remarks, *consequences]
    parts: list[Part] = [*([table] if found.log else []), *([Remarks(sentences)] if sentences else [])]
    settings = found.settings
    rate = "false discovery rate" if settings.fdr else "level of all tests together"
    intro = (
        f"Data snooping, {rate} {settings.level:g}, {found.outcome.tests} tests, unit weight"
        f" {'known' if settings.known else 'unknown'}. The error is estimated from the rest of the network."
    )
    return Section("removed", "What was taken out", parts, intro)


def _state(each: Removal) -> str:
    if each.kept:
        return f"kept: {each.kept}"
    return "out" if each.returned is None else f"back in round {each.returned}"
