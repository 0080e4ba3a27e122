"""Cameras over years: what changed."""

from photogram.film.years.comparison import CameraComparison, DatedCamera, compare_cameras

__all__ = ["CameraComparison", "DatedCamera", "compare_cameras"]
