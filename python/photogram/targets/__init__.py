"""Calibration with targets: boards, their corners in pictures, and what these say of cameras and rigs."""

from photogram.arguments.on_demand import attach_checked

__getattr__, __dir__, __all__ = attach_checked(
    __name__, __file__, given={"Board", "Calibration", "Candidate", "Corners", "WorthOptions"}
)
