"""Support data of images (ISDs of the Community Sensor Model, labels of ISIS cubes) as moving photos."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
