"""Files of numbers and white space, optionally packed, read in pieces."""

from __future__ import annotations

import bz2
import gzip
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.words import Phrase, phrase

COMPRESSED: dict[bytes, Callable[[BinaryIO], BinaryIO]] = {
    b"BZh": lambda file: cast("BinaryIO", bz2.BZ2File(file)),
    b"\x1f\x8b": lambda file: cast("BinaryIO", gzip.GzipFile(fileobj=file)),
}  # Functions that unpack files with these first bytes in pieces
LONGEST = max(map(len, COMPRESSED))
PIECE = 1 << 17  # Characters per read
SHOWN = 120  # Characters of an invalid line in messages


def pieces(path: Path) -> Iterator[bytes]:
    """Yield the unpacked file in pieces that end between numbers."""
    unpack = None
    try:
        with path.open("rb") as file:
            begin = file.peek(LONGEST)[:LONGEST]
            unpack = next((opener for mark, opener in COMPRESSED.items() if begin.startswith(mark)), None)
            if unpack is None:
                yield from _whole_words(path, file)
            else:
                yield from _whole_words(path, unpack(file))
    except InputError:
        raise
    except (OSError, EOFError, ValueError, zlib.error) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        code = "file.unpack" if unpack else "error.read"
        raise InputError(phrase(code, reason=reason), file=path) from None


def _whole_words(path: Path, file: BinaryIO) -> Iterator[bytes]:
    rest = b""
    while piece := file.read(PIECE):
        cut = max(map(piece.rfind, (b" ", b"\n", b"\r", b"\t"))) + 1
        if cut:
            yield rest + piece[:cut]
            rest = b""
        rest += piece[cut:]
        if len(rest) > PIECE:
            raise InputError(phrase("file.long-number", length=len(rest)), file=path)
    yield rest


def packed(content: bytes, suffix: str) -> bytes:
    """Return content packed as its suffix (`.bz2`, `.gz`) requires."""
    if suffix == ".bz2":
        return bz2.compress(content)
    return gzip.compress(content, mtime=0) if suffix == ".gz" else content


def whole(numbers: Floats) -> NDArray[np.bool_]:
    """Return which numbers can be counts or indices."""
    return np.asarray((numbers >= 0) & (numbers == np.floor(numbers)) & (numbers < 2**53))


def at(path: Path, index: int, message: str | Phrase) -> InputError:
    """Return an error at the line that contains the word of the given index."""
    words = lines = 0
    if not path.is_file():
        # A pipe cannot be read again.
        return InputError(message, file=path)
    for piece in pieces(path):
        count = len(piece.split())
        if words + count <= index:
            words += count
            lines += piece.count(b"\n")
            continue
        for record, line in enumerate(piece.split(b"\n"), lines + 1):
            count = len(line.split())
            if words + count > index:
                text = line.decode("latin-1").strip("\r")[:SHOWN]
                if isinstance(message, Phrase):
                    word = phrase("collection.word", word=line.split()[index - words].decode("latin-1"))
                    message = phrase(message.code, **message.fields, word=word)
                return InputError(message, file=path, record=record, text=text)
            words += count
    return InputError(message, file=path)
