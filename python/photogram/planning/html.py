"""The report of a plan for the browser; what makes it is loaded when one is asked for."""

from __future__ import annotations

from photogram.planning.networks import Plan
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["page"]


@page_of.register(Plan)
def page(made: Plan) -> Page:
    """Return the page of a plan."""
    from photogram.planning.page import plan_page

    return plan_page(made.patterns)
