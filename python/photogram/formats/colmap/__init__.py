"""COLMAP: models as text and binary files, with rigs and frames."""

from __future__ import annotations

from photogram.formats.colmap.reading import TITLE, place_of, read
from photogram.formats.colmap.writing import cannot_hold, covariance_files, write
from photogram.formats.format import Format

__all__ = ["FORMAT"]


FORMAT = Format(
    name="colmap",
    title=TITLE,
    recognises=lambda path: path.is_dir() and place_of(path) is not None,
    read=read,
    write=write,
    cannot_hold=cannot_hold,
    pixels=True,
    results=covariance_files,
    folders=("sparse",),
)
