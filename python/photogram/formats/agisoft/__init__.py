"""Agisoft Metashape: camera XML with its markers."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.agisoft.reading import TITLE, read
from photogram.formats.agisoft.writing import FILE, cannot_hold, write
from photogram.formats.format import Format
from photogram.formats.xml_stream import root_of

__all__ = ["FORMAT"]


def _recognises(path: Path) -> bool:
    root, attributes = root_of(path) if path.is_file() else ("", {})
    # Scripts and cameras of DBAT have a root of this name, too.
    return root == "document" and not any(name.startswith("dbat") for name in attributes)


FORMAT = Format(
    name="agisoft",
    title=TITLE,
    recognises=_recognises,
    read=read,
    write=write,
    files=(FILE, "*.xml"),
    cannot_hold=cannot_hold,
    pixels=True,
)
