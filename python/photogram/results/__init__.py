"""What an adjustment gives, as arrays, tables, text and JSON."""

import lazy_loader

WAYS = {
    "pictured": ("picture_data",),
    "determined": ("block_terms",),
    "terms_of": ("block_terms",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
