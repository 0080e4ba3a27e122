"""Reports of calibrations by stars for the browser; what makes them is loaded when one is asked for."""

from __future__ import annotations

from photogram.show.page import Page
from photogram.show.ways import page_of
from photogram.stellar.nights import CalibratedNight
from photogram.stellar.result import Result

__all__ = ["night", "plate"]


@page_of.register(Result)
def plate(result: Result) -> Page:
    """Return the page of a plate with stars."""
    from photogram.stellar.page import plate_page

    return plate_page(result)


@page_of.register(CalibratedNight)
def night(result: CalibratedNight) -> Page:
    """Return the page of exposures of the sky."""
    from photogram.stellar.night_page import night_page

    return night_page(result)
