"""File formats of collections: each is a module with a `FORMAT`, listed here."""

from photogram.collection.formats.registry import FORMATS, read, recognised, to_bytes

__all__ = ["FORMATS", "read", "recognised", "to_bytes"]
