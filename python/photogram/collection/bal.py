"""The text format of "Bundle Adjustment in the Large", plain or compressed.

First line: photos, points, images; then for each image `photo point x y`; then nine parameters of each
photo and three coordinates of each point, one number a line. Any white space separates numbers.
"""

from __future__ import annotations

import bz2
import gzip
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.collection.collection import Collection
from photogram.errors import InputError

__all__ = ["read", "to_bytes"]

Floats = NDArray[np.float64]

COMPRESSED: dict[bytes, Callable[[bytes], bytes]] = {b"BZh": bz2.decompress, b"\x1f\x8b": gzip.decompress}
"""How files that begin like this are unpacked."""
HEAD, IMAGE, PHOTO, POINT = 3, 4, 9, 3
"""Numbers of the first line, of an image, of a photo, of a point."""
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
    text = _unpacked(path)
    numbers = _photocore.read_numbers(text)
    if len(numbers) < HEAD:
        raise _fault(path, text, len(numbers), len(numbers), "the numbers of photos, points and images")
    if not _whole(numbers[:HEAD]).all():
        raise _at(path, text, 0, "the first line is not the numbers of photos, points and images")
    photos, points, images = (int(count) for count in numbers[:HEAD])
    first_photo = HEAD + IMAGE * images
    first_point = first_photo + PHOTO * photos
    expected = first_point + POINT * points
    if len(numbers) != expected:
        wanted = f"{expected} numbers of {photos} photos, {points} points and {images} images"
        raise _fault(path, text, len(numbers), expected, wanted)
    rows = numbers[HEAD:first_photo].reshape(images, IMAGE)
    for column, (name, count) in enumerate((("photo", photos), ("point", points))):
        bad = np.flatnonzero(~_whole(rows[:, column]) | (rows[:, column] >= count))
        if len(bad):
            message = f"{rows[bad[0], column]:g} is no {name}: they count from 0 to {count - 1}"
            raise _at(path, text, HEAD + IMAGE * int(bad[0]), message)
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


def _unpacked(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None
    for mark, unpack in COMPRESSED.items():
        if data.startswith(mark):
            try:
                return unpack(data)
            except (OSError, EOFError, ValueError, zlib.error) as error:
                raise InputError(f"cannot be unpacked: {error}", file=path) from None
    return data


def _whole(numbers: Floats) -> NDArray[np.bool_]:
    whole: NDArray[np.bool_] = (numbers >= 0) & (numbers == np.floor(numbers)) & (numbers < 2**53)
    return whole


def _fault(path: Path, text: bytes, read: int, expected: int, wanted: str) -> InputError:
    """Return what is wrong after `read` good numbers: a bad word, the end, or too many."""
    if read > expected:
        return _at(path, text, expected, f"numbers beyond the {wanted}")
    if len(text.split(maxsplit=read)) > read:
        return _at(path, text, read, f"is not a finite number, where there should be {wanted}")
    return InputError(f"ends before {wanted}", file=path)


def _at(path: Path, text: bytes, index: int, message: str) -> InputError:
    """Return an error at the line that holds the word of the given index."""
    words = 0
    for record, line in enumerate(text.splitlines(), 1):
        words += len(line.split())
        if words > index:
            return InputError(message, file=path, record=record, text=line.decode("latin-1")[:SHOWN])
    return InputError(message, file=path)
