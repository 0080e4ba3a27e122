"""Cameras over years: what changed."""

from photogram.film.years.comparison import CameraComparison, DatedCamera, compare_cameras

__all__ = ["CameraComparison", "DatedCamera", "compare_cameras"]

WAYS = dict.fromkeys(("document_of", "findings_of", "page_of", "report_of"), ("report",))
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""
