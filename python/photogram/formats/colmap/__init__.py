"""COLMAP: models as text and binary files, with rigs and frames."""

from __future__ import annotations

from photogram.formats.colmap.reading import TITLE, place_of, read
from photogram.formats.colmap.writing import cannot_hold, covariance_files, write, write_as_text
from photogram.formats.format import Format

__all__ = ["FORMAT", "TEXT"]

HOLDS = frozenset({"names", "points", "lenses", "shared-cameras", "rigs"})

FORMAT = Format(
    name="colmap",
    title=TITLE,
    recognises=lambda path: path.is_dir() and place_of(path) is not None,
    read=read,
    write=write,
    holds=HOLDS,
    cannot_hold=cannot_hold,
    pixels=True,
    results=covariance_files,
    folders=("sparse",),
)
TEXT = Format(
    name="colmap_text",
    title=f"{TITLE} as text",
    recognises=lambda _: False,
    read=read,
    write=write_as_text,
    holds=HOLDS,
    cannot_hold=cannot_hold,
    pixels=True,
)
"""Formats for writing only: text is read and recognised by the other format."""
