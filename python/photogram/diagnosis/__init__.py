"""Mistakes in the data of a network: one module for each thing that is looked at."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
