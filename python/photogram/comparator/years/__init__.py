"""Calibrations over years: what changed, and the grids that all of them measured."""

from photogram.comparator.years.comparison import Comparison, compare
from photogram.comparator.years.record import RecordedCalibration, RecordedCase

__all__ = ["Comparison", "RecordedCalibration", "RecordedCase", "compare"]

WAYS = dict.fromkeys(("document_of", "findings_of", "page_of", "report_of"), ("report",))
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""
