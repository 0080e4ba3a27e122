"""Support data of images (CSM ISDs, labels of ISIS cubes) as moving photos."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
