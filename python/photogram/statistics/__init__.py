"""Statistics of an adjustment: tests, reliability, degrees of freedom, radii."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
