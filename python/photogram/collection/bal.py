"""The text format of "Bundle Adjustment in the Large", plain or compressed.

First line: photos, points, images; then for each image `photo point x y`; then nine parameters of each
photo and three coordinates of each point, one number a line. Any white space separates numbers.
"""

from __future__ import annotations

import bz2
import gzip
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.collection.collection import Collection
from photogram.errors import InputError
from photogram.memory import require, turned

__all__ = ["read", "to_bytes"]


COMPRESSED: dict[bytes, Callable[[BinaryIO], BinaryIO]] = {
    b"BZh": lambda file: cast("BinaryIO", bz2.BZ2File(file)),
    b"\x1f\x8b": lambda file: cast("BinaryIO", gzip.GzipFile(fileobj=file)),
}
"""How files that begin like this are unpacked piece by piece."""
LONGEST = max(map(len, COMPRESSED))
PIECE = 1 << 17
"""Characters that are read at a time."""
ROOM = 64
"""Characters that a number and the white space after it take at the most, in the mean over a file."""
HEAD, IMAGE, PHOTO, POINT = 3, 4, 9, 3
"""Numbers of the first line, of an image, of a photo, of a point."""
COUNTS = "the numbers of photos, points and images"
SHOWN = 120
"""Characters of a faulty line that are shown."""


def read(path: Path) -> Collection:
    """Read a collection, packed by bzip2 or gzip or not.

    All unknowns are free, and the standard deviation of image coordinates is one pixel.

    Raises
    ------
    InputError
        The file cannot be read or holds something else; names file, line and what stands there.
    """
    with turned(f"reading {path}"):
        return _collection(path)


def _collection(path: Path) -> Collection:
    counts, numbers = _numbers(path)
    photos, points, images = counts.photos, counts.points, counts.images
    first_photo = HEAD + IMAGE * images
    first_point = first_photo + PHOTO * photos
    rows = numbers[HEAD:first_photo].reshape(images, IMAGE)
    for column, (name, count) in enumerate((("photo", photos), ("point", points))):
        bad = np.flatnonzero(~_whole(rows[:, column]) | (rows[:, column] >= count))
        if len(bad):
            message = f"{rows[bad[0], column]:g} is no {name}: they count from 0 to {count - 1}"
            raise _at(path, HEAD + IMAGE * int(bad[0]), message)
    return Collection(
        photo_parameters=numbers[first_photo:first_point].reshape(photos, PHOTO),
        point_positions=numbers[first_point:].reshape(points, POINT),
        image_photos=rows[:, 0].astype(np.int64),
        image_points=rows[:, 1].astype(np.int64),
        image_xy=rows[:, 2:],
    )


def to_bytes(collection: Collection, suffix: str = "") -> bytes:
    """Return a collection in the format, packed as the suffix (`.bz2`, `.gz`) says.

    Numbers read back to the last bit.
    """
    head = f"{len(collection.photo_parameters)} {len(collection.point_positions)} {len(collection.image_xy)}"
    columns = zip(
        collection.image_photos.tolist(),
        collection.image_points.tolist(),
        *collection.image_xy.T.tolist(),
        strict=True,
    )
    images = [f"{photo} {point} {x!r} {y!r}" for photo, point, x, y in columns]
    values = [
        *map(repr, collection.photo_parameters.ravel().tolist()),
        *map(repr, collection.point_positions.ravel().tolist()),
    ]
    text = "\n".join([head, *images, *values, ""]).encode()
    if suffix == ".bz2":
        return bz2.compress(text)
    return gzip.compress(text, mtime=0) if suffix == ".gz" else text


@dataclass(frozen=True)
class _Counts:
    """How many photos, points and images the first line announces."""

    photos: int
    points: int
    images: int

    @property
    def numbers(self) -> int:
        """Numbers of the whole file."""
        return HEAD + IMAGE * self.images + PHOTO * self.photos + POINT * self.points

    def __str__(self) -> str:
        return (
            f"{self.numbers} numbers of {self.photos} photos, {self.points} points and {self.images} images"
        )


def _numbers(path: Path) -> tuple[_Counts, Floats]:
    """Read as many numbers as the first line announces, and no more text than they can take."""
    counts: _Counts | None = None
    parts: list[Floats] = []
    read = length = 0
    for piece in _pieces(path):
        numbers, whole = _photocore.read_numbers(piece)
        if counts is None and len(numbers) >= HEAD:
            if not _whole(numbers[:HEAD]).all():
                raise _at(path, 0, f"the first line is not {COUNTS}")
            counts = _Counts(*(int(count) for count in numbers[:HEAD]))
        wanted = COUNTS if counts is None else str(counts)
        if counts is not None and read + len(numbers) > counts.numbers:
            raise _at(path, counts.numbers, f"numbers beyond the {wanted}")
        read += len(numbers)
        if not whole:
            raise _at(path, read, f"is not a finite number, where there should be {wanted}")
        parts.append(numbers)
        length += len(piece)
        if length > PIECE + ROOM * (counts.numbers if counts is not None else HEAD):
            raise InputError(f"is far longer than the {wanted} can be", file=path)
        # The parts, and what is made of them.
        require(4 * read * numbers.itemsize, f"{path}: {read} numbers")
    if counts is None or read < counts.numbers:
        raise InputError(f"ends before {COUNTS if counts is None else counts}", file=path)
    return counts, np.concatenate(parts)


def _pieces(path: Path) -> Iterator[bytes]:
    """Yield the file, unpacked, in pieces that end where a number does."""
    doing = "read"
    try:
        with path.open("rb") as file:
            begin = file.peek(LONGEST)[:LONGEST]
            unpack = next((opener for mark, opener in COMPRESSED.items() if begin.startswith(mark)), None)
            if unpack is None:
                yield from _whole_words(path, file)
            else:
                doing = "unpacked"
                yield from _whole_words(path, unpack(file))
    except InputError:
        raise
    except (OSError, EOFError, ValueError, zlib.error) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise InputError(f"cannot be {doing}: {reason}", file=path) from None


def _whole_words(path: Path, file: BinaryIO) -> Iterator[bytes]:
    rest = b""
    while piece := file.read(PIECE):
        cut = max(map(piece.rfind, (b" ", b"\n", b"\r", b"\t"))) + 1
        if cut:
            yield rest + piece[:cut]
            rest = b""
        rest += piece[cut:]
        if len(rest) > PIECE:
            raise InputError(f"has {len(rest)} characters without white space: that is no number", file=path)
    yield rest


def _whole(numbers: Floats) -> NDArray[np.bool_]:
    whole: NDArray[np.bool_] = (numbers >= 0) & (numbers == np.floor(numbers)) & (numbers < 2**53)
    return whole


def _at(path: Path, index: int, message: str) -> InputError:
    """Return an error at the line that holds the word of the given index."""
    words = lines = 0
    if not path.is_file():
        # A pipe cannot be read again.
        return InputError(message, file=path)
    for piece in _pieces(path):
        count = len(piece.split())
        if words + count <= index:
            words += count
            lines += piece.count(b"\n")
            continue
        for record, line in enumerate(piece.split(b"\n"), lines + 1):
            words += len(line.split())
            if words > index:
                text = line.decode("latin-1").strip("\r")[:SHOWN]
                return InputError(message, file=path, record=record, text=text)
    return InputError(message, file=path)
