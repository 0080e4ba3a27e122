"""Calibrations over years: what changed, and the grids that all of them measured."""

from photogram.comparator.years.comparison import Comparison, compare
from photogram.comparator.years.record import RecordedCalibration, RecordedCase

__all__ = ["Comparison", "RecordedCalibration", "RecordedCase", "compare"]

WAYS = {
    "document_of": ("document",),
    "findings_of": ("findings",),
    "page_of": ("page",),
    "report_of": ("document",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""
