"""Reading text files; one that cannot be read is an :class:`~photogram.errors.InputError` that names it."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from photogram.errors import InputError
from photogram.io.sheets import sheet_text
from photogram.words import phrase

HEAD = 4096  # Bytes in which text of two bytes a character is told, where it has no mark


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Name the file that the system cannot read: an :class:`OSError` becomes an :class:`InputError`."""
    if "\0" in str(path):
        raise InputError(phrase("file.nul"), file=path)
    try:
        yield
    except OSError as error:
        raise InputError(phrase("error.read", reason=error.strerror or str(error)), file=path) from None


def read_bytes(path: Path) -> bytes:
    """Read a file."""
    with reading(path):
        return path.read_bytes()


def read_beginning(path: Path, size: int = HEAD) -> str:
    """Read what a text file begins with, by which formats are told, as :func:`read_text` does."""
    with reading(path), path.open("rb") as file:
        text = _decoded(file.read(size), whole=False)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_text(path: Path) -> str:
    """Read a text file: UTF-8, UTF-16, else that of Windows; any line ends become line feeds.

    The first sheet of an Excel workbook is text, too: a line a row, tabs between its cells.
    """
    if path.suffix.lower() == ".xlsx":
        return sheet_text(path)
    data = read_bytes(path)
    text = _decoded(data)
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def _decoded(data: bytes, *, whole: bool = True) -> str:
    """Decode the bytes of a file; where they are not the whole of it, its last character may be cut."""
    for encoding in (_wide(data) or "utf-8-sig", "cp1252"):
        try:
            return codecs.getincrementaldecoder(encoding)().decode(data, whole)
        except UnicodeDecodeError:
            continue
    return data.decode("latin-1")


def _wide(data: bytes) -> str | None:
    """Return the encoding of two bytes a character: by its mark, else by zeros in alternate places."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    head = data[:HEAD]
    even, odd = head[::2].count(0), head[1::2].count(0)
    if (even and odd) or 4 * max(even, odd) <= len(head):
        return None
    return "utf-16-le" if odd else "utf-16-be"


def read_lines(path: Path) -> list[str]:
    """Read the lines of a text file as :func:`read_text` does, without their ends."""
    lines = read_text(path).removesuffix("\x1a").split("\n")
    if lines[-1] == "":
        lines.pop()
    return lines
