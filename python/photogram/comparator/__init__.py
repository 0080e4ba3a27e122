"""Calibration of measuring comparators with a grid plate (Fritz, NOAA TR NOS 57, 1973).

session = comparator.read(["measurements.csv"])[0]
calibration = comparator.calibrate(session)
calibration.correction.apply(xy_um)
"""

from photogram.arguments.annotations import attach_checked

__getattr__, __dir__, __all__ = attach_checked(
    __name__, __file__, given={"Correction", "Frame", "Grid", "Options", "Polynomial"}
)
