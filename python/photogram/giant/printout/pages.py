"""Pages of the printout: headings, page breaks, page numbers, carriage control."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

__all__ = ["LINES", "WIDTH", "Page", "headed", "paginate", "printout"]

Page = list[str]
"""The lines of a page below its banner."""

WIDTH = 132
"""Columns of a line printer, carriage control not counted."""
LINES = 52
"""Lines of entries on a page: 13 stations, 52 points of one line or 13 of four, 10 control points of five."""

BANNER = "NOAA/NOS GIANT SYSTEM .... (4/85) : "


def headed(title: str, *lines: str) -> Page:
    """Return the heading of a page: a letter-spaced title in the middle, and further lines below it."""
    spaced = "   ".join(" ".join(word) for word in title.split())
    return ["", spaced.center(WIDTH).rstrip(), "", *lines, ""]


def paginate(
    heading: Sequence[str],
    entries: Iterable[Sequence[str]],
    *,
    again: Sequence[str] | None = None,
    closing: Sequence[str] = (),
) -> list[Page]:
    """Fill pages with entries, which are never split.

    Parameters
    ----------
    heading
        Lines at the top of the first page.
    entries
        Entries of one line or more.
    again
        Lines at the top of the other pages; the heading when None. A heading that has more lines than this
        leaves less room for entries.
    closing
        What stands below the last entry, on the same page if there is room for all of it.
    """
    again = heading if again is None else again
    length = len(again) + LINES
    pages, empty = [list(heading)], True
    for entry in [*entries, closing]:
        if not empty and len(pages[-1]) + len(entry) > length:
            pages.append(list(again))
        pages[-1] += entry
        empty = False
    return pages


def printout(title: str, pages: Iterable[Page]) -> str:
    """Return pages as text, numbered from 0, with title and FORTRAN carriage control.

    The first character of a line is the carriage control: `1` begins a page, a blank (or nothing) a line.
    """
    lines: list[str] = []
    for number, page in enumerate(pages):
        lines.append(f"1{BANNER}{title:<80}  PAGE{number:>5}")
        lines += [f" {line}".rstrip() for line in page]
    return "".join(f"{line}\n" for line in lines)
