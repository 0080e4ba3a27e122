"""The page of a network after data snooping: that of its result, and what was taken out."""

from __future__ import annotations

from dataclasses import replace

from photogram.results.snooping_result import LN10, Snooped, estimated_errors, rivals_of
from photogram.show.methods import page_of
from photogram.show.page import Column, Fact, Page, Part, Remarks, Section, Table
from photogram.statistics.snooping.log import Removal


@page_of.register(Snooped)
def snooped_page(found: Snooped) -> Page:
    """Return the page of the network without what was taken out."""
    page = page_of(found.judged)
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
