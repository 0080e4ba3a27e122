"""The formats that are known, and which of them a file has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import chain
from pathlib import Path

from photogram.collection.collection import Collection
from photogram.errors import InputError
from photogram.io.packed_numbers import packed, pieces
from photogram.lazy_dataclasses import dataclass
from photogram.memory import turned
from photogram.words import phrase


@dataclass(frozen=True)
class Format:
    """A format of collections."""

    name: str  # As functions take it
    title: str  # As people are told what a file is
    suffix: str  # Of files that are written
    begins: Callable[[bytes], bool]  # Whether a file that begins with this, after unpacking, is meant for one
    # Takes the path, for messages, and the content, unpacked, in pieces that end at the end of a word
    read: Callable[[Path, Iterator[bytes]], Collection]
    to_bytes: Callable[[Collection], bytes]
    camera: str = "bal"  # The model of cameras that the format can hold


FORMATS: dict[str, Format] = {
    name: import_module(f"photogram.collection.formats.{name}").FORMAT
    for name in (
        "bundler",
        "bal",
    )
}  # By name; a file has the first format that it begins like


def recognised(path: Path) -> tuple[Collection, Format]:
    """Read a collection, packed by bzip2 or gzip or not, and say what format it has.

    All unknowns are free, and the standard deviation of image coordinates is one pixel.
    """
    with turned(f"reading {path}"):
        content = pieces(path)
        begin = next(content, b"")
        found = next(each for each in FORMATS.values() if each.begins(begin))
        return found.read(path, chain([begin], content)), found


def read(path: Path) -> Collection:
    """Read a collection, packed by bzip2 or gzip or not; see `recognised`."""
    return recognised(path)[0]


def to_bytes(collection: Collection, suffix: str = "", file_format: str = "bal") -> bytes:
    """Return a collection in the named format, packed as the suffix (`.bz2`, `.gz`) says.

    Raises
    ------
    InputError
        There is no such format, or it cannot hold the cameras.
    """
    if file_format not in FORMATS:
        raise InputError(phrase("collection.format", names=list(FORMATS), value=file_format))
    chosen = FORMATS[file_format]
    if collection.camera != chosen.camera:
        raise InputError(
            phrase("collection.model", format=chosen.title, model=chosen.camera, camera=collection.camera)
        )
    return packed(chosen.to_bytes(collection), suffix)
