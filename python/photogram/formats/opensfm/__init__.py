"""OpenSfM and OpenDroneMap: `reconstruction.json` with `tracks.csv`."""

from __future__ import annotations

from photogram.formats.format import Format
from photogram.formats.opensfm.reading import MODEL, TITLE, place_of, read
from photogram.formats.opensfm.writing import cannot_hold, write

__all__ = ["FORMAT"]

FORMAT = Format(
    name="opensfm",
    title=TITLE,
    recognises=lambda path: place_of(path) is not None,
    read=read,
    write=write,
    files=(MODEL,),
    cannot_hold=cannot_hold,
    pixels=True,
)
