"""Calibration with targets: boards, their corners in pictures, and what these say of cameras and rigs."""

from photogram.arguments.annotations import check_arguments
from photogram.targets.board import Board
from photogram.targets.calibrated import Calibrated
from photogram.targets.calibration import Calibration
from photogram.targets.corners import Corners

__all__ = ["Board", "Calibrated", "Calibration", "Corners"]

check_arguments(globals(), __all__)
