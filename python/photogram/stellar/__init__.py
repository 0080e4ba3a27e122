"""Stellar camera calibration with plates (NOAA Technical Report NOS 55, 1972) or digital exposures."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
