"""Comparison of calibrations over years, and of their common grids."""

from photogram.comparator.years.comparison import Comparison, compare
from photogram.comparator.years.joint import RecordedCalibration, RecordedCase

__all__ = ["Comparison", "RecordedCalibration", "RecordedCase", "compare"]
