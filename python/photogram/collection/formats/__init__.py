"""File formats of collections: each is a module, listed here, and the format of a file is detected."""

from __future__ import annotations

from importlib import import_module
from itertools import chain
from pathlib import Path
from types import ModuleType

from photogram.arguments.objects import path_of
from photogram.collection.collection import Collection
from photogram.errors import InputError
from photogram.io.packed_numbers import packed, pieces
from photogram.memory import turned
from photogram.words import phrase

CAMERA = "bal"  # Camera model of all formats
FORMATS: dict[str, ModuleType] = {
    name: import_module(f"photogram.collection.formats.{name}")
    for name in (
        "bundler",
        "bal",
    )
}
"""Modules by name: `TITLE` for people, `SUFFIX` of written files, `begins` tests the beginning of unpacked
content, `read` and `to_bytes` convert. The first matching format is used for a file."""


def recognised(path: Path) -> tuple[Collection, ModuleType]:
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
    if collection.camera != CAMERA:
        raise InputError(
            phrase("collection.model", format=chosen.TITLE, model=CAMERA, camera=collection.camera)
        )
    return packed(chosen.to_bytes(collection), suffix)
