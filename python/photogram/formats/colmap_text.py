"""COLMAP models, written as text; they are read and recognised by `colmap`."""

from __future__ import annotations

from photogram.formats.colmap.reading import TITLE, read
from photogram.formats.colmap.writing import cannot_hold, write_as_text
from photogram.formats.format import Format

FORMAT = Format(
    name="colmap_text",
    title=f"{TITLE} as text",
    recognises=lambda _: False,
    read=read,
    write=write_as_text,
    cannot_hold=cannot_hold,
    pixels=True,
)
