"""Reading text files, and writing files whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from photogram.errors import InputError

__all__ = ["read_bytes", "read_lines", "reading", "whole", "write_whole"]


def write_whole(files: Mapping[Path, bytes]) -> None:
    """Write files so that each is there whole or not at all.

    All are written beside their places first, then moved there.

    Raises
    ------
    OSError
        A file cannot be written; no file has changed unless the very moving of one failed.
    """
    begun: dict[Path, Path] = {}
    try:
        for path, content in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            begun[path] = path.with_name(f".{path.name}.{os.getpid()}.tmp")
            begun[path].write_bytes(content)
        for path, temporary in begun.items():
            temporary.replace(path)
    finally:
        for temporary in begun.values():
            temporary.unlink(missing_ok=True)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Name the file that the system cannot read: an :class:`OSError` becomes an :class:`InputError`."""
    try:
        yield
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None


def read_bytes(path: Path) -> bytes:
    """Read a file.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    with reading(path):
        return path.read_bytes()


def read_lines(path: Path) -> list[str]:
    """Read the lines of a text file (UTF-8, else Latin-1; any line ends), without their ends.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    data = read_bytes(path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").removesuffix("\x1a").split("\n")
    if lines[-1] == "":
        lines.pop()
    return lines


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """Open a file to be written piece by piece that is there whole or not at all.

    It is written beside its place and moved there at the end, unless an exception comes first.

    Raises
    ------
    OSError
        The file cannot be written; what was there has not changed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as file:
            yield file
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
