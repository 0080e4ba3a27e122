"""Calibration certificates of film and plate cameras, comparison over years, interior orientation."""

from photogram.arguments.annotations import attach_checked

__getattr__, __dir__, __all__ = attach_checked(__name__, __file__)
