"""The text format of "Bundle Adjustment in the Large".

The first line contains the numbers of photos, points and images. Each image is `photo point x y`. Nine
parameters of each photo and three coordinates of each point follow, one number per line. Any white space
separates numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.collection.collection import Collection
from photogram.errors import InputError
from photogram.io.packed_numbers import PIECE, at, whole
from photogram.memory import require
from photogram.words import phrase

NAME, TITLE, SUFFIX = "bal", 'problem of "Bundle Adjustment in the Large"', ".txt"
ROOM = 64  # Maximum mean number of characters of a number and the white space after it
HEAD, IMAGE, PHOTO, POINT = 3, 4, 9, 3  # Counts of numbers in the first line, an image, a photo, a point


def begins(_: bytes) -> bool:
    """Return True: any text may be intended as this format; the reader reports errors."""
    return True


def read(path: Path, pieces: Iterator[bytes]) -> Collection:
    """Read a collection."""
    (photos, points, images), numbers = _numbers(path, pieces)
    first_photo = HEAD + IMAGE * images
    first_point = first_photo + PHOTO * photos
    rows = numbers[HEAD:first_photo].reshape(images, IMAGE)
    for column, (name, count) in enumerate((("photo", photos), ("point", points))):
        bad = np.flatnonzero(~whole(rows[:, column]) | (rows[:, column] >= count))
        if len(bad):
            value = float(rows[bad[0], column])
            message = phrase("collection.number", kind=name, last=count - 1, value=value)
            raise at(path, HEAD + IMAGE * int(bad[0]), message)
    return Collection(
        photo_parameters=numbers[first_photo:first_point].reshape(photos, PHOTO),
        point_positions=numbers[first_point:].reshape(points, POINT),
        image_photos=rows[:, 0].astype(np.int64),
        image_points=rows[:, 1].astype(np.int64),
        image_xy=rows[:, 2:],
    )


def to_bytes(collection: Collection) -> bytes:
    """Return a collection in the format; numbers read back to the last bit."""
    head = f"{len(collection.photo_parameters)} {len(collection.point_positions)} {len(collection.image_xy)}"
    columns = (collection.image_photos, collection.image_points, *collection.image_xy.T)
    rows = zip(*(each.tolist() for each in columns), strict=True)
    images = (f"{photo} {point} {x!r} {y!r}" for photo, point, x, y in rows)
    values = (*collection.photo_parameters.ravel().tolist(), *collection.point_positions.ravel().tolist())
    return "\n".join([head, *images, *map(repr, values), ""]).encode()


def _numbers(path: Path, pieces: Iterator[bytes]) -> tuple[tuple[int, int, int], Floats]:
    """Read the numbers announced in the first line, and no more text than they may need."""
    counts: tuple[int, int, int] | None = None
    most, wanted = HEAD, phrase("collection.head")
    parts: list[Floats] = []
    read = length = 0
    for piece in pieces:
        numbers, good = _photocore.read_numbers(piece)
        if counts is None and len(numbers) >= HEAD:
            if not whole(numbers[:HEAD]).all():
                raise at(path, 0, phrase("collection.first-line"))
            photos, points, images = map(int, numbers[:HEAD].tolist())
            counts = photos, points, images
            most = HEAD + IMAGE * images + PHOTO * photos + POINT * points
            sizes = {"photos": photos, "points": points, "images": images}
            wanted = phrase("collection.counts", numbers=most, **sizes)
        if counts is not None and read + len(numbers) > most:
            raise at(path, most, phrase("collection.beyond", content=wanted))
        read += len(numbers)
        if not good:
            raise at(path, read, phrase("collection.not-finite", content=wanted))
        parts.append(numbers)
        length += len(piece)
        if length > PIECE + ROOM * most:
            raise InputError(phrase("collection.too-long", content=wanted), file=path)
        # Memory of the parts and of the arrays made from them.
        require(4 * read * numbers.itemsize, f"{path}: {read} numbers")
    if counts is None or read < most:
        raise InputError(phrase("collection.ends", content=wanted), file=path)
    return counts, np.concatenate(parts)
