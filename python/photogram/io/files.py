"""Reader of text files; errors name the file."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from photogram.errors import InputError
from photogram.io.sheets import sheet_text
from photogram.words import phrase

HEAD = 4096  # Bytes in which two-byte encodings without byte order mark are detected

paths_read = ContextVar[set[Path]]("paths_read")
"""Set that receives the paths of files that are read."""


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Convert an :class:`OSError` to an :class:`InputError` that names the file."""
    if "\0" in str(path):
        raise InputError(phrase("file.nul"), file=path)
    paths_read.get(set()).add(path)
    try:
        yield
    except OSError as error:
        raise InputError(phrase("error.read", reason=error.strerror or str(error)), file=path) from None


def read_bytes(path: Path) -> bytes:
    """Read a file."""
    with reading(path):
        return path.read_bytes()


def read_beginning(path: Path, size: int = HEAD) -> str:
    """Read the start of a text file, for format detection, as :func:`read_text` does."""
    with reading(path), path.open("rb") as file:
        text = decoded(file.read(size), whole=False)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_text(path: Path) -> str:
    """Read a text file: UTF-8, UTF-16 or Windows, with any line ends.

    The first sheet of an Excel workbook is text, too: one line per row, with tabs between cells.
    """
    if path.suffix.lower() == ".xlsx":
        with reading(path):
            return sheet_text(path)
    data = read_bytes(path)
    text = decoded(data)
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def decoded(data: bytes, *, whole: bool = True) -> str:
    """Decode the bytes of a file, or of its start: two-byte encodings have a mark or zero bytes."""
    first, head = "utf-8-sig", data[:HEAD]
    even, odd = head[::2].count(0), head[1::2].count(0)
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        first = "utf-16"
    elif not (even and odd) and 4 * max(even, odd) > len(head):
        first = "utf-16-le" if odd else "utf-16-be"
    for encoding in (first, "cp1252"):
        try:
            return codecs.getincrementaldecoder(encoding)().decode(data, whole)
        except UnicodeDecodeError:
            continue
    return data.decode("latin-1")


def utf8_text(data: bytes, path: Path) -> str:
    """Decode a file that must be in UTF-8; a byte order mark is omitted."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        record = data.count(b"\n", 0, error.start) + 1
        raise InputError(phrase("error.encoding", byte=error.start), file=path, record=record) from None


def read_lines(path: Path) -> list[str]:
    """Read the lines of a text file as :func:`read_text` does, without line ends."""
    lines = read_text(path).removesuffix("\x1a").split("\n")
    if lines[-1] == "":
        lines.pop()
    return lines
