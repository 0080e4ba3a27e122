"""The reports of calibrations for the browser; what makes them is loaded when one is asked for."""

from __future__ import annotations

from photogram.comparator.calibration import Calibration
from photogram.comparator.years.comparison import Comparison
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["page"]


@page_of.register(Calibration)
def page(calibration: Calibration) -> Page:
    """Return the page of a calibration."""
    from photogram.comparator.page import calibration_page

    return calibration_page(calibration)


@page_of.register(Comparison)
def _comparison(comparison: Comparison) -> Page:
    """Return the page of a comparison."""
    from photogram.comparator.years.page import comparison_page

    return comparison_page(comparison)
