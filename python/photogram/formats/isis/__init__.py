"""Control networks of ISIS, the planetary mapping system of the U.S. Geological Survey."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.format import Format
from photogram.formats.isis.assembling import TITLE, read
from photogram.formats.isis.reading import is_network
from photogram.formats.isis.rejection import rejecting
from photogram.formats.isis.writing_results import results
from photogram.io.files import reading

__all__ = ["FORMAT"]

HEAD = 1 << 16
"""Bytes that tell a network."""


def _recognises(path: Path) -> bool:
    if not path.is_file():
        return False
    with reading(path), path.open("rb") as file:
        return is_network(file.read(HEAD))


FORMAT = Format(
    name="isis", title=TITLE, recognises=_recognises, read=read, results=results, adjusting=rejecting
)
