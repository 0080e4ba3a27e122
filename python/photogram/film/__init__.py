"""Film and plates: certificates of their cameras, what years make of these, interior orientations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.arguments.annotations import check_arguments
from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.film.certificate import CalibratedMarks, Certificate
    from photogram.film.certificate_check import DistanceDifference, Explanation
    from photogram.film.distances import AdjustedMarks, Crossing, MarkDistance, RightAngle, adjust_distances
    from photogram.film.interior import Interior, interior_orientation
    from photogram.film.lens_table import Curve, LensParameters, RadialTable, Tangential
    from photogram.film.marks import FilmWay, WhichMark, which_mark
    from photogram.film.steps import StepsCompared, compare_steps
    from photogram.film.years import CameraComparison, DatedCamera, compare_cameras
    from photogram.network.film_reduction import Affine

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
    "StepsCompared",
    "Tangential",
    "WhichMark",
    "adjust_distances",
    "compare_cameras",
    "compare_steps",
    "interior_orientation",
    "which_mark",
]

_HOMES = {
    "adjust_distances": "distances",
    "AdjustedMarks": "distances",
    "Affine": "interior",
    "CalibratedMarks": "certificate",
    "CameraComparison": "years",
    "Certificate": "certificate",
    "compare_cameras": "years",
    "compare_steps": "steps",
    "Crossing": "distances",
    "Curve": "lens_table",
    "DatedCamera": "years",
    "DistanceDifference": "certificate_check",
    "Explanation": "certificate_check",
    "FilmWay": "marks",
    "Interior": "interior",
    "interior_orientation": "interior",
    "LensParameters": "lens_table",
    "MarkDistance": "distances",
    "RadialTable": "lens_table",
    "RightAngle": "distances",
    "StepsCompared": "steps",
    "Tangential": "lens_table",
    "which_mark": "marks",
    "WhichMark": "marks",
}
"""The module of each name, loaded when it is first asked for: most blocks are not on film."""

WAYS = {
    "document_of": {"Certificate": ("certificate_report",), "StepsCompared": ("steps",)},
    "findings_of": {"Certificate": ("certificate_findings",)},
    "page_of": {"Certificate": ("certificate_report",), "StepsCompared": ("steps",)},
    "report_of": {"Certificate": ("certificate_report",), "StepsCompared": ("steps",)},
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

_CLASSES = {name for name in __all__ if name[0].isupper()}

__getattr__, __dir__ = on_demand(__name__, _HOMES, check_arguments, unchecked=_CLASSES)
