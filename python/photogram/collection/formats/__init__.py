"""Formats of collections: each is a file with a `FORMAT`, and a line here."""

from photogram.collection.formats.registry import FORMATS, read, recognised, to_bytes

__all__ = ["FORMATS", "read", "recognised", "to_bytes"]
