"""The report of a calibration for the browser; what makes it is loaded when one is asked for."""

from __future__ import annotations

from photogram.comparator.calibration import Calibration
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["page"]


@page_of.register(Calibration)
def page(calibration: Calibration) -> Page:
    """Return the page of a calibration."""
    from photogram.comparator.page import calibration_page

    return calibration_page(calibration)
