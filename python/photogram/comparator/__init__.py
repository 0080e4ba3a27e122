"""Calibration of measuring comparators with a grid plate (Fritz, NOAA TR NOS 57, 1973).

`calibrate(read(["measurements.csv"])[0])` returns a calibration. Its method
`correction.apply(xy_um)` corrects measurements.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
