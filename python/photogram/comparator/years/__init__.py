"""Calibrations over years: what changed, and the grids that all of them measured."""

from photogram.comparator.years.comparison import Comparison, compare
from photogram.comparator.years.record import RecordedCalibration, RecordedCase

__all__ = ["Comparison", "RecordedCalibration", "RecordedCase", "compare"]
