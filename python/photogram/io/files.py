"""Reading text files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from photogram.errors import InputError

__all__ = ["read_bytes", "read_lines", "reading"]


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Name the file that the system cannot read: an :class:`OSError` becomes an :class:`InputError`."""
    if "\0" in str(path):
        raise InputError("a path cannot hold a NUL character", file=path)
    try:
        yield
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=path) from None


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
