"""Calibration of measuring comparators with a grid plate (Fritz, NOAA TR NOS 57, 1973).

`calibrate(read(["measurements.csv"])[0])` returns a calibration. Its method
`correction.apply(xy_um)` corrects measurements.
"""

from photogram.arguments.annotations import attach_checked

__getattr__, __dir__, __all__ = attach_checked(
    __name__, __file__, given={"Correction", "Frame", "Grid", "Options", "Polynomial"}
)
