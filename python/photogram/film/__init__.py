"""Film and plates: certificates of their cameras, what years make of these, interior orientations."""

from photogram.arguments.annotations import check_arguments
from photogram.film.certificate import CalibratedMarks, Certificate
from photogram.film.certificate_check import DistanceDifference, Explanation
from photogram.film.decentring import Tangential
from photogram.film.distances import AdjustedMarks, Crossing, MarkDistance, RightAngle, adjust_distances
from photogram.film.interior import Affine, Interior, interior_orientation
from photogram.film.lens_table import Curve, LensParameters, RadialTable
from photogram.film.steps import compare_steps
from photogram.film.which import FilmWay, WhichMark, which_mark
from photogram.film.years import CameraComparison, DatedCamera, compare_cameras

__all__ = [
    "AdjustedMarks",
    "Affine",
    "CalibratedMarks",
    "CameraComparison",
    "Certificate",
    "Crossing",
    "Curve",
    "DatedCamera",
    "DistanceDifference",
    "Explanation",
    "FilmWay",
    "Interior",
    "LensParameters",
    "MarkDistance",
    "RadialTable",
    "RightAngle",
    "Tangential",
    "WhichMark",
    "adjust_distances",
    "compare_cameras",
    "compare_steps",
    "interior_orientation",
    "which_mark",
]

check_arguments(
    globals(), ["adjust_distances", "compare_cameras", "compare_steps", "interior_orientation", "which_mark"]
)

WAYS = {
    "document_of": ("certificate_document",),
    "findings_of": ("certificate_findings",),
    "page_of": ("certificate_page",),
    "report_of": ("certificate_report",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.ways`."""
