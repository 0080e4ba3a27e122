"""The text format of Bundler, version 0.3 (Snavely, Seitz and Szeliski 2006): `bundle.out`.

The line `# Bundle file v0.3` is followed by the numbers of cameras and points. Each camera has f, k1, k2 and
the rows of R and t. Each point has X, Y, Z, a colour, and its views: their number, then camera, key, x and y.
P = R X + t; the camera looks along -z. Image coordinates are pixels from the centre, x to the right, y up.
Unregistered cameras contain zeros only. Colours and keys are discarded.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.collection.collection import Collection
from photogram.errors import InputError
from photogram.io.packed_numbers import at, whole
from photogram.memory import require
from photogram.words import Phrase, phrase

NAME, TITLE, SUFFIX = "bundler", "Bundle file (Bundler, version 0.3)", ".out"
HEADER = re.compile(rb"#[ \t]*Bundle file v(\S+)[^\n]*\n?")
VERSION = b"0.3"
COUNTS, CAMERA, POINT, VIEW = 2, 15, 7, 4  # Counts in the second line, a camera, a point and a view
ORTHONORMAL = 1e-6  # Tolerance of R R^T - I


class _Numbers:
    """Sequential reader of the numbers of a file after its first line."""

    def __init__(self, path: Path, pieces: Iterator[bytes]) -> None:
        first = next(pieces)
        header = HEADER.match(first)
        if header is None or header[1] != VERSION:
            line = first.split(b"\n", 1)[0].decode("latin-1").strip()
            raise InputError(phrase("bundler.version"), file=path, record=1, text=line)
        self.path = path
        self.words = len(header[0].split())  # Words of the first line
        self.taken = 0
        parts: list[Floats] = []
        read = 0
        for piece in chain([first[header.end() :]], pieces):
            numbers, good = _photocore.read_numbers(piece)
            read += len(numbers)
            if not good:
                raise self.fault(read, phrase("bundler.number"))
            parts.append(numbers)
            # Memory of the parts and of the arrays made from them.
            require(4 * read * numbers.itemsize, f"{self.path}: {read} numbers")
        self.values = np.concatenate(parts)

    def take(self, count: int, what: str) -> Floats:
        values = self.values[self.taken : self.taken + count]
        if len(values) < count:
            raise InputError(phrase("bundler.ends", n=count, subject=what), file=self.path)
        self.taken += count
        return values

    def fault(self, index: int, message: Phrase) -> InputError:
        return at(self.path, self.words + index, message)


def begins(content: bytes) -> bool:
    return HEADER.match(content) is not None


def read(path: Path, pieces: Iterator[bytes]) -> Collection:
    """Read a collection; camera numbers are unchanged, unregistered cameras have zero images."""
    numbers = _Numbers(path, pieces)
    counts = numbers.take(COUNTS, "the second line")
    if not whole(counts).all():
        raise numbers.fault(0, phrase("bundler.second-line"))
    cameras, points = (int(count) for count in counts)
    parameters = _parameters(numbers, cameras)
    positions, views, starts = _points(numbers, points)
    if numbers.taken < len(numbers.values):
        raise numbers.fault(numbers.taken, phrase("bundler.beyond", points=points))
    rows = numbers.values[starts[:, np.newaxis] + np.arange(VIEW)]
    bad = np.flatnonzero(~whole(rows[:, 0]) | (rows[:, 0] >= cameras))
    if len(bad):
        message = phrase("collection.number", kind="camera", last=cameras - 1, value=float(rows[bad[0], 0]))
        raise numbers.fault(int(starts[bad[0]]), message)
    photos = rows[:, 0].astype(np.int64)
    bad = np.flatnonzero(parameters[photos, 6] == 0)
    if len(bad):
        message = phrase("bundler.not-registered", camera=int(photos[bad[0]]))
        raise numbers.fault(int(starts[bad[0]]), message)
    return Collection(
        photo_parameters=parameters,
        point_positions=positions,
        image_photos=photos,
        image_points=views,
        image_xy=rows[:, 2:],
    )


def _parameters(numbers: _Numbers, cameras: int) -> Floats:
    """Return (cameras, 9) rotation vectors, t, f, k1, k2."""
    first = numbers.taken
    rows = numbers.take(CAMERA * cameras, f"{cameras} cameras").reshape(cameras, CAMERA)
    registered = rows[:, 0] != 0
    matrices = np.where(registered[:, np.newaxis, np.newaxis], rows[:, 3:12].reshape(-1, 3, 3), np.eye(3))
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        bad = np.flatnonzero(~(apart < ORTHONORMAL) | ~(np.linalg.det(matrices) > 0))
    if len(bad):
        mirrored = apart[bad[0]] < ORTHONORMAL
        code = "bundler.mirrored" if mirrored else "bundler.rotation"
        message = phrase(code, camera=int(bad[0]), limit=ORTHONORMAL, excess=float(apart[bad[0]]))
        raise numbers.fault(first + CAMERA * int(bad[0]) + 3, message)
    return np.hstack([_photocore.rotation_vectors(matrices), rows[:, 12:], rows[:, :3]])


def _points(numbers: _Numbers, points: int) -> tuple[Floats, Indices, Indices]:
    """Return (points, 3) positions, and for each view its point and the index of its first number."""
    if points * POINT > len(numbers.values):
        raise InputError(
            phrase("bundler.ends", n=POINT * points, subject=f"{points} points"), file=numbers.path
        )
    positions = np.empty((points, 3))
    firsts, counts = np.empty(points, np.int64), np.empty(points, np.int64)
    for point in range(points):
        own = numbers.take(POINT, f"point {point}")
        if not whole(own[-1:])[0]:
            message = phrase("bundler.views", point=point, value=float(own[-1]))
            raise numbers.fault(numbers.taken - 1, message)
        positions[point], firsts[point], counts[point] = own[:3], numbers.taken, own[-1]
        numbers.take(VIEW * int(own[-1]), f"the views of point {point}")
    views = np.repeat(np.arange(points), counts)
    within = np.arange(len(views)) - np.repeat(np.cumsum(counts) - counts, counts)
    return positions, views, np.repeat(firsts, counts) + VIEW * within


def to_bytes(collection: Collection) -> bytes:
    """Write a collection to bytes; points are black, keys count the views of a photo."""
    lines = ["# Bundle file v0.3", f"{len(collection.photo_parameters)} {len(collection.point_positions)}"]
    matrices = _photocore.vector_rotations(collection.photo_parameters[:, :3])
    matrices[collection.photo_parameters[:, 6] == 0] = 0.0
    for parameters, matrix in zip(collection.photo_parameters, matrices, strict=True):
        lines += [_line(row) for row in (parameters[6:], *matrix, parameters[3:6])]
    views: list[list[str]] = [[] for _ in collection.point_positions]
    keys = [0] * len(collection.photo_parameters)
    columns = collection.image_points, collection.image_photos, collection.image_xy
    for point, photo, (x, y) in zip(*(column.tolist() for column in columns), strict=True):
        views[point].append(f"{photo} {keys[photo]} {x!r} {y!r}")
        keys[photo] += 1
    for position, own in zip(collection.point_positions, views, strict=True):
        lines += [_line(position), "0 0 0", " ".join([str(len(own)), *own])]
    return "\n".join([*lines, ""]).encode()


def _line(numbers: Floats) -> str:
    return " ".join(map(repr, numbers.tolist()))
