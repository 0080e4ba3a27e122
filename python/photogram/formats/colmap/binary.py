"""The binary files of COLMAP: little endian, no padding, no header."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from photogram.arguments.types import Indices
from photogram.formats.colmap import content
from photogram.io.files import read_bytes
from photogram.io.places import Place

_Made = TypeVar("_Made")
_SENSORS = {0: content.CAMERA, 1: content.IMU}
_NUMBERS = {name: number for number, name in _SENSORS.items()}
_FEATURE = np.dtype([("xy", "<f8", 2), ("point", "<u8")])
_POINT = np.dtype(
    [("number", "<u8"), ("xyz", "<f8", 3), ("rgb", "u1", 3), ("error", "<f8"), ("track", "<u8")]
)
_MOST_NAME = 4096


class _Reader:
    """Bytes of a file, taken one after the other; errors name the record and what is missing."""

    def __init__(self, path: Path) -> None:
        self.path, self.data, self.at = path, read_bytes(path), 0
        self.what, self.record = "count", 0

    @property
    def place(self) -> Place:
        """Where the record begins that is read."""
        return Place(self.path, self.record or None, f"byte {self.at}")

    def need(self, size: int) -> int:
        """Return where the next bytes begin; they are taken."""
        left = len(self.data) - self.at
        if size > left:
            raise self.place.error(f"ends within the {self.what}: {size - left} bytes are missing")
        start = self.at
        self.at += size
        return start

    def take(self, form: str) -> tuple[float | int, ...]:
        """Return numbers of a form of `struct`."""
        return struct.unpack_from("<" + form, self.data, self.need(struct.calcsize("<" + form)))

    def count(self, least: int, what: str) -> int:
        """Return a count that the rest of the file can hold."""
        number = int(self.take("Q")[0])
        left = len(self.data) - self.at
        if number * least > left:
            raise self.place.error(f"announces {number} {what} of {least} bytes at least; {left} are left")
        return number

    def pose(self) -> content.Pose:
        """Return a quaternion and a translation."""
        values = self.take("7d")
        return content.Pose(values[:4], values[4:])

    def sensor(self) -> tuple[str, int]:
        """Return the type and the number of a sensor."""
        kind, number = self.take("iI")
        return _SENSORS.get(int(kind), "INVALID"), int(number)

    def records(self, least: int, what: str, make: Callable[[_Reader], _Made]) -> list[_Made]:
        """Return all records of the file, which ends with them."""
        found = []
        for record in range(1, self.count(least, what) + 1):
            self.record, self.what = record, f"record {record}"
            found.append(make(self))
        self.end()
        return found

    def end(self) -> None:
        """Refuse bytes beyond the last record."""
        if self.at < len(self.data):
            raise self.place.error(f"has {len(self.data) - self.at} bytes beyond the last record")


def read_binary(folder: Path) -> content.Model:
    """Read a model."""
    paths = {name: folder / f"{name}.bin" for name in ("cameras", "images", "points3D", "rigs", "frames")}
    cameras = _Reader(paths["cameras"]).records(24, "cameras", _camera)
    images = _images(_Reader(paths["images"]))
    points = _points(_Reader(paths["points3D"]))
    rigs = _Reader(paths["rigs"]).records(8, "rigs", _rig) if paths["rigs"].is_file() else []
    frames = _Reader(paths["frames"]).records(68, "frames", _frame) if paths["frames"].is_file() else []
    return content.Model(folder, cameras, images, points, rigs, frames)


def _camera(reader: _Reader) -> content.Camera:
    place = reader.place
    number, model, width, height = (int(each) for each in reader.take("IiQQ"))
    if not 0 <= model < len(content.MODELS):
        raise place.error(
            f"camera {number} has a model of the number {model}, which is not known: what follows cannot be"
            " read"
        )
    name, count = content.MODELS[model]
    return content.Camera(number, name, width, height, reader.take(f"{count}d"), place)


def _images(reader: _Reader) -> content.Images:
    heads: list[tuple[float | int, ...]] = []
    names, features, places = [], [], []
    for record in range(1, reader.count(73, "images") + 1):
        reader.record, reader.what = record, f"image {record}"
        places.append(reader.place)
        heads.append(reader.take("I7dI"))
        end = reader.data.find(b"\0", reader.at, reader.at + _MOST_NAME)
        if end < 0:
            raise reader.place.error(f"the name of image {heads[-1][0]} does not end")
        names.append(reader.data[reader.at : end].decode("utf-8", "replace"))
        reader.at = end + 1
        count = reader.count(_FEATURE.itemsize, "features")
        start = reader.need(count * _FEATURE.itemsize)
        features.append(np.frombuffer(reader.data, _FEATURE, count, start))
    reader.end()
    table = np.array([each[1:8] for each in heads], dtype=float).reshape(len(heads), 7)
    whole = np.concatenate(features) if features else np.zeros(0, _FEATURE)
    return content.Images(
        np.array([each[0] for each in heads], dtype=np.int64),
        np.array([each[8] for each in heads], dtype=np.int64),
        table[:, :4],
        table[:, 4:],
        names,
        np.array([len(each) for each in features], dtype=np.int64),
        np.array(whole["xy"]).reshape(-1, 2),
        whole["point"].astype(np.int64),  # 2^64 - 1, which is none, becomes NO_POINT
        places,
    )


def _points(reader: _Reader) -> content.Points:
    size = _POINT.itemsize
    count = reader.count(size, "points")
    starts = np.empty(count, dtype=np.int64)
    unpack, data, last = struct.Struct("<Q").unpack_from, reader.data, len(reader.data)
    at = reader.at
    for row in range(count):
        starts[row] = at
        track = unpack(data, at + size - 8)[0] if at + size <= last else 0
        at += size + 8 * track
        if at > last:
            reader.at, reader.record = int(starts[row]), row + 1
            raise reader.place.error(f"ends within point {row + 1}: {at - last} bytes are missing")
    reader.at = at
    reader.end()
    raw = np.frombuffer(data, np.uint8)
    rows = np.empty((count, size), np.uint8)
    for first in range(0, count, 1 << 16):
        part = starts[first : first + (1 << 16), np.newaxis] + np.arange(size)
        rows[first : first + (1 << 16)] = raw[part]
    table = rows.reshape(-1).view(_POINT)
    return content.Points(
        table["number"].astype(np.int64),
        np.array(table["xyz"]).reshape(-1, 3),
        table["rgb"].astype(np.int64).reshape(-1, 3),
        table["track"].astype(np.int64),
        _Places(reader.path, count),
    )


class _Places(Sequence[Place]):
    """Places of records that are only made when one is asked for."""

    def __init__(self, path: Path, number: int) -> None:
        self.path, self.number = path, number

    def __len__(self) -> int:
        return self.number

    def __getitem__(self, row: int) -> Place:  # type: ignore[override]
        return Place(self.path, row + 1)


def _rig(reader: _Reader) -> content.Rig:
    place = reader.place
    number, sensors = (int(each) for each in reader.take("II"))
    if not sensors:
        return content.Rig(number, None, (), place)
    reference = reader.sensor()
    others = []
    for _ in range(sensors - 1):
        kind, own = reader.sensor()
        has_pose = reader.take("B")[0]
        others.append((kind, own, reader.pose() if has_pose else None))
    return content.Rig(number, reference, tuple(others), place)


def _frame(reader: _Reader) -> content.Frame:
    place = reader.place
    number, rig = (int(each) for each in reader.take("II"))
    pose = reader.pose()
    data = []
    for _ in range(int(reader.take("I")[0])):
        kind, sensor = reader.sensor()
        data.append((kind, sensor, int(reader.take("Q")[0])))
    return content.Frame(number, rig, pose, tuple(data), place)


def binary_files(model: content.Model) -> dict[str, bytes]:
    """Return the files of a model."""
    names = {name: number for number, (name, _) in enumerate(content.MODELS)}
    cameras = [
        struct.pack("<IiQQ", c.number, names[c.model], c.width, c.height)
        + struct.pack(f"<{len(c.parameters)}d", *c.parameters)
        for c in model.cameras
    ]
    return {
        "cameras.bin": _file(cameras),
        "images.bin": _file(_packed_images(model.images)),
        "points3D.bin": _file(_packed_points(model)),
        "rigs.bin": _file([_packed_rig(each) for each in model.rigs]),
        "frames.bin": _file([_packed_frame(each) for each in model.frames]),
    }


def _file(records: list[bytes]) -> bytes:
    return struct.pack("<Q", len(records)) + b"".join(records)


def _packed_images(images: content.Images) -> list[bytes]:
    features = np.empty(len(images.xy), _FEATURE)
    features["xy"], features["point"] = images.xy, images.points.astype(np.uint64)
    ends = np.cumsum(images.counts)
    found = []
    for row, name in enumerate(images.names):
        own = features[ends[row] - images.counts[row] : ends[row]]
        head = struct.pack(
            "<I7dI",
            int(images.numbers[row]),
            *images.quaternions[row],
            *images.translations[row],
            int(images.cameras[row]),
        )
        found.append(head + name.encode() + b"\0" + struct.pack("<Q", len(own)) + own.tobytes())
    return found


def tracks_of(model: content.Model) -> list[Indices]:
    """Return of each point the images that show it with the index of the feature there."""
    images, points = model.images, model.points
    rows = np.repeat(np.arange(len(images.counts)), images.counts)
    within = np.arange(len(rows)) - np.repeat(np.cumsum(images.counts) - images.counts, images.counts)
    places = {number: row for row, number in enumerate(points.numbers.tolist())}
    owner = np.array([places.get(number, -1) for number in images.points.tolist()], dtype=np.int64)
    order = np.argsort(owner, kind="stable")
    order = order[owner[order] >= 0]
    pairs = np.column_stack([images.numbers[rows[order]], within[order]])
    ends = np.searchsorted(owner[order], np.arange(len(points.numbers)), side="right")
    return np.split(pairs, ends[:-1]) if len(points.numbers) else []


def _packed_points(model: content.Model) -> list[bytes]:
    points = model.points
    return [
        struct.pack("<Q3d3BdQ", number, *position, *colour, -1.0, len(track)) + track.astype("<u4").tobytes()
        for number, position, colour, track in zip(
            points.numbers.tolist(),
            points.positions.tolist(),
            points.colours.tolist(),
            tracks_of(model),
            strict=True,
        )
    ]


def _packed_pose(pose: content.Pose) -> bytes:
    return struct.pack("<7d", *pose.quaternion, *pose.translation)


def _packed_rig(rig: content.Rig) -> bytes:
    if rig.reference is None:
        return struct.pack("<II", rig.number, 0)
    kind, number = rig.reference
    found = struct.pack("<IIiI", rig.number, 1 + len(rig.sensors), _NUMBERS.get(kind, -1), number)
    for kind, number, pose in rig.sensors:
        found += struct.pack("<iIB", _NUMBERS.get(kind, -1), number, pose is not None)
        found += b"" if pose is None else _packed_pose(pose)
    return found


def _packed_frame(frame: content.Frame) -> bytes:
    found = struct.pack("<II", frame.number, frame.rig) + _packed_pose(frame.pose)
    found += struct.pack("<I", len(frame.data))
    return found + b"".join(
        struct.pack("<iIQ", _NUMBERS.get(kind, -1), sensor, image) for kind, sensor, image in frame.data
    )
