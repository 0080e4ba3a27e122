"""Calibration with targets: boards, their corners in pictures, and what these say of cameras and rigs."""

from photogram.arguments.annotations import check_arguments
from photogram.targets.board import Board
from photogram.targets.calibrated import Calibrated
from photogram.targets.calibration import Calibration
from photogram.targets.corners import Corners
from photogram.targets.first import FirstCalibration, first_values
from photogram.targets.reading import read

__all__ = ["Board", "Calibrated", "Calibration", "Corners", "FirstCalibration", "first_values", "read"]

check_arguments(globals(), set(__all__) - {"Calibrated", "FirstCalibration"})

WAYS = {
    "document_of": ("document",),
    "findings_of": ("findings",),
    "page_of": ("page",),
    "report_of": ("report",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.ways`."""
