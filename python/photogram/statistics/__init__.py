"""Statistics of an adjustment: tests, critical values, reliability, degrees of freedom, error radii."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
