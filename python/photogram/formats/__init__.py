"""Projects in the files that people have: read, write, convert (docs/formats.md)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
