"""The report of a run for the browser; what makes it is loaded when one is asked for."""

from __future__ import annotations

from photogram.perspective_center.batch import Run
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["page"]


@page_of.register(Run)
def page(run: Run) -> Page:
    """Return the page of a run."""
    from photogram.perspective_center.page import run_page

    return run_page(run)
