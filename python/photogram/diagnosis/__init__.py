"""Mistakes in the data of a network: one module for each thing that is looked at."""

import lazy_loader

WAYS = {"page_of": ("page",)}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
