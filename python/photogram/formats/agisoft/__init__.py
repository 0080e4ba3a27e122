"""Agisoft Metashape: camera XML with its markers."""

from __future__ import annotations

from photogram.formats.agisoft.reading import TITLE, read
from photogram.formats.format import Format
from photogram.formats.xml_stream import root_of

__all__ = ["FORMAT"]

FORMAT = Format(
    name="agisoft",
    title=TITLE,
    recognises=lambda path: path.is_file() and root_of(path) == "document",
    read=read,
)
