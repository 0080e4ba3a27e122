"""Adjustment of blocks and of single photos by least squares."""

import lazy_loader

WAYS = {"findings_of": ("findings",)}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
