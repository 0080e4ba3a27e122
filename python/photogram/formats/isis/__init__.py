"""Control networks of ISIS, the planetary mapping system of the USGS."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
