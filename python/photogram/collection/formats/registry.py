"""Known formats of collections, and detection of the format of a file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import chain
from pathlib import Path

from photogram.arguments.objects import path_of
from photogram.collection.collection import Collection
from photogram.errors import InputError
from photogram.io.packed_numbers import packed, pieces
from photogram.lazy_dataclasses import dataclass
from photogram.memory import turned
from photogram.words import phrase


@dataclass(frozen=True)
class Format:
    """Format of collections."""

    name: str  # Name as a function argument
    title: str  # Description for people
    suffix: str  # Suffix of written files
    begins: Callable[[bytes], bool]  # Whether unpacked content with this beginning has the format
    # Arguments: path for messages, and unpacked content in pieces that end at word boundaries.
    read: Callable[[Path, Iterator[bytes]], Collection]
    to_bytes: Callable[[Collection], bytes]
    camera: str = "bal"  # Camera model of the format


FORMATS: dict[str, Format] = {
    name: import_module(f"photogram.collection.formats.{name}").FORMAT
    for name in (
        "bundler",
        "bal",
    )
}  # By name; the first matching format is used for a file


def recognised(path: Path) -> tuple[Collection, Format]:
    """Read a collection, optionally packed by bzip2 or gzip, and return its format too.

    All unknowns are free, and the standard deviation of image coordinates is one pixel.
    """
    with turned(f"reading {path}"):
        content = pieces(path)
        begin = next(content, b"")
        found = next(each for each in FORMATS.values() if each.begins(begin))
        return found.read(path, chain([begin], content)), found


def read(path: Path) -> Collection:
    """Read a collection, optionally packed by bzip2 or gzip; see `recognised`."""
    path = path_of("path", path)
    return recognised(path)[0]


def to_bytes(collection: Collection, suffix: str = "", file_format: str = "bal") -> bytes:
    """Convert a collection to bytes of a format, packed by suffix (`.bz2`, `.gz`).

    Raises
    ------
    InputError
        If the format does not exist or does not support the camera model.
    """
    if file_format not in FORMATS:
        raise InputError(phrase("collection.format", names=list(FORMATS), value=file_format))
    chosen = FORMATS[file_format]
    if collection.camera != chosen.camera:
        raise InputError(
            phrase("collection.model", format=chosen.title, model=chosen.camera, camera=collection.camera)
        )
    return packed(chosen.to_bytes(collection), suffix)
