"""Target calibration of cameras and rigs from board corners in images."""

from photogram.arguments.annotations import attach_checked

__getattr__, __dir__, __all__ = attach_checked(
    __name__, __file__, given={"Board", "Calibration", "Candidate", "Corners", "WorthOptions"}
)
