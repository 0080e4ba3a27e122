"""Film and plates: certificates of their cameras, what years make of these."""

from photogram.arguments.annotations import check_arguments
from photogram.film.certificate import CalibratedMarks, Certificate
from photogram.film.certificate_check import DistanceDifference, Explanation
from photogram.film.decentring import Tangential
from photogram.film.distances import AdjustedMarks, Crossing, MarkDistance, RightAngle, adjust_distances
from photogram.film.lens_table import Curve, LensParameters, RadialTable
from photogram.film.years import CameraComparison, DatedCamera, compare_cameras

__all__ = [
    "AdjustedMarks",
    "CalibratedMarks",
    "CameraComparison",
    "Certificate",
    "Crossing",
    "Curve",
    "DatedCamera",
    "DistanceDifference",
    "Explanation",
    "LensParameters",
    "MarkDistance",
    "RadialTable",
    "RightAngle",
    "Tangential",
    "adjust_distances",
    "compare_cameras",
]

check_arguments(globals(), ["adjust_distances", "compare_cameras"])

WAYS = {
    "document_of": ("certificate_document",),
    "findings_of": ("certificate_findings",),
    "page_of": ("certificate_page",),
    "report_of": ("certificate_report",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.ways`."""
