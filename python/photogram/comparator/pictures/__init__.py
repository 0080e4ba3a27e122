"""Plots of a calibration, and its report as PDF."""

from photogram.comparator.pictures.book import sketches

__all__ = ["sketches"]
