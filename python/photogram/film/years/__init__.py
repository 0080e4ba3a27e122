"""Comparison of camera calibrations over years."""

from photogram.film.years.comparison import CameraComparison, DatedCamera, compare_cameras

__all__ = ["CameraComparison", "DatedCamera", "compare_cameras"]
