"""The report of an orientation for the browser; what makes it is loaded when one is asked for."""

from __future__ import annotations

from photogram.absolute_orientation.orientation import Orientation
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["page"]


@page_of.register(Orientation)
def page(result: Orientation) -> Page:
    """Return the page of an orientation."""
    from photogram.absolute_orientation.page import orientation_page

    return orientation_page(result)
