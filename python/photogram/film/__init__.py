"""Calibration certificates of film and plate cameras, comparison over years, interior orientation."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
