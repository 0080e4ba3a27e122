"""Control networks of ISIS, the planetary mapping system of the USGS."""

from __future__ import annotations

from pathlib import Path

import lazy_loader

from photogram.formats.format import Format, later
from photogram.io import files

TITLE = "control network (ISIS)"
HEAD = 1 << 16  # Bytes that identify a network


def _recognises(path: Path) -> bool:
    if not path.is_file():
        return False
    from photogram.formats.isis.network import is_network

    with files.reading(path), path.open("rb") as file:
        return is_network(file.read(HEAD))


FORMAT = Format(
    name="isis",
    title=TITLE,
    recognises=_recognises,
    read=later(f"{__name__}.assembling", "read"),
    results=later(f"{__name__}.writing", "results"),
    adjusting=later(f"{__name__}.outcome", "rejecting"),
)

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
