"""The report of a check for the browser; what makes it is loaded when one is asked for."""

from __future__ import annotations

from photogram.checks.findings import Check
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["page"]


@page_of.register(Check)
def page(found: Check) -> Page:
    """Return the page of a check."""
    from photogram.checks.page import check_page

    return check_page(found)
