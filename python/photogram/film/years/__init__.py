"""Cameras over years: what changed."""

from photogram.film.years.comparison import CameraComparison, compare_cameras
from photogram.film.years.dated import DatedCamera

__all__ = ["CameraComparison", "DatedCamera", "compare_cameras"]

WAYS = {
    "document_of": ("document",),
    "findings_of": ("findings",),
    "page_of": ("page",),
    "report_of": ("document",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""
