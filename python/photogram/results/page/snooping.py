"""The page of a network after data snooping: that of its result, and what was taken out."""

from __future__ import annotations

from dataclasses import replace

from photogram.results.snooping_result import Snooped
from photogram.show.methods import page_of
from photogram.show.page import Cell, Column, Fact, Page, Part, Remarks, Section, Table
from photogram.statistics.snooping.log import Removal

__all__ = ["snooped_page"]


@page_of.register(Snooped)
def snooped_page(found: Snooped) -> Page:
    """Return the page of the network without what was taken out."""
    page = page_of(found.judged)
    gone = Fact("Taken out", f"{len(found.removed)}", note=f"of {len(found.suspects)} groups of observations")
    return replace(
        page,
        highlights=[gone, *page.highlights],
        sections=[_log(found), *page.sections],
    )


def _log(found: Snooped) -> Section:
    columns = (
        Column("Round", decimals=0),
        Column("What", text=True),
        Column("Estimated error", text=True),
        Column("T", decimals=2),
        Column("Dimension", decimals=0),
        Column("log10 p", decimals=1),
        Column("Redundancy", decimals=3),
        Column("Or instead", text=True),
        Column("Now", text=True),
    )
    rows = [_row(each) for each in found.log]
    parts: list[Part] = [Table("In order", columns, rows)] if rows else []
    consequences = [f"{each.name}: {line}" for each in found.log for line in each.consequences]
    told = (
        [*found.outcome.remarks, *consequences]
        if rows
        else ["Nothing was taken out.", *found.outcome.remarks]
    )
    if told:
        parts.append(Remarks(told))
    settings = found.settings
    rate = "false discovery rate" if settings.fdr else "level of all tests together"
    intro = (
        f"Data snooping, {rate} {settings.level:g}, {found.outcome.tests} tests, unit weight"
        f" {'known' if settings.known else 'unknown'}. The error is estimated from the rest of the network."
    )
    return Section("removed", "What was taken out", parts, intro)


def _row(each: Removal) -> list[Cell | str | float | None]:
    errors = ", ".join(
        f"{component} {error:.4g} {unit} (sd {sd:.2g})".replace("  ", " ")
        for component, error, unit, sd in zip(
            each.components, each.error, each.units, each.error_sd, strict=True
        )
    )
    state = (
        f"kept: {each.kept}"
        if each.kept
        else "out"
        if each.returned is None
        else f"back in round {each.returned}"
    )
    return [
        each.round,
        each.name,
        errors,
        each.statistic,
        each.dimension,
        each.log_probability / 2.302585092994046,
        each.redundancy,
        "; ".join(f"{rival.name} ({rival.odds:.2g} : 1)" for rival in each.rivals[:3]),
        state,
    ]
