"""Files of COLMAP models: records as text and little-endian binary."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Indices
from photogram.formats.cards import filled_lines
from photogram.formats.colmap.content import (
    MODELS,
    NO_POINT,
    SENSORS,
    Camera,
    Frame,
    Images,
    Model,
    Points,
    Pose,
    Rig,
)
from photogram.io.files import read_bytes, read_lines
from photogram.io.places import Place
from photogram.words import phrase

Table = NDArray[Any]
Record = list[tuple[str, Any]]

_FEATURE = np.dtype([("xy", "<f8", 2), ("point", "<i8")])
_POINT = np.dtype(
    [("number", "<u8"), ("xyz", "<f8", 3), ("rgb", "u1", 3), ("error", "<f8"), ("track", "<u8")]
)
_EMPTY = 2.0**64  # 2^64 - 1, by which binary files mark features without a point, as a number of a text
_MAX_NAME = 4096
_HIGHEST = {"I": 2**32 - 1, "Q": 2**53, "B": 255, "?": 1}
_MIN_BYTES = {"cameras": 24, "images": 73, "points3D": _POINT.itemsize, "rigs": 8, "frames": 68}
_POSE = ("QW", "QX", "QY", "QZ", "TX", "TY", "TZ")
_HEADS = {
    "cameras": "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]",
    "images": "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)",
    "points3D": "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)",
    "rigs": "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID,"
    " HAS_POSE, [QW, QX, QY, QZ, TX, TY, TZ])",
    "frames": "# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as"
    " (SENSOR_TYPE, SENSOR_ID, DATA_ID)",
}


class _Record(ABC):
    """The fields of a record, read one after the other."""

    place: Place

    @abstractmethod
    def take(self, form: str, *names: str) -> tuple[Any, ...]:
        """Return numbers, each with its character of `struct` and its name."""

    @abstractmethod
    def word(self, name: str, words: Iterable[str]) -> str:
        """Return a word, which binary files have as its number among all words."""

    @abstractmethod
    def title(self) -> str:
        """Return the name of an image."""

    @abstractmethod
    def features(self) -> Table:
        """Return the features of an image."""

    def pose(self) -> Pose:
        values = self.take("7d", *_POSE)
        return Pose(values[:4], values[4:])

    def sensor(self) -> tuple[str, int]:
        return self.word("SENSOR_TYPE", SENSORS), self.take("I", "SENSOR_ID")[0]


class _Line(_Record):
    """A line of words; images have their features in the next line."""

    def __init__(self, place: Place, after: Place | None = None) -> None:
        self.place, self.after, self.at = place, after or Place(), 0
        self.words = (place.text or "").split()

    def take(self, form: str, *names: str) -> tuple[Any, ...]:
        kind = form[-1]
        if kind == "d":
            return tuple(self.place.number(self.word(name), name) for name in names)
        return tuple(self.place.whole(self.word(name), name, _HIGHEST[kind]) for name in names)

    def word(self, name: str, words: Iterable[str] = ()) -> str:
        if self.at >= len(self.words):
            raise self.place.error(phrase("format.end", name=name))
        self.at += 1
        return self.words[self.at - 1]

    def title(self) -> str:
        self.word("NAME")
        # Some programs write names with blanks.
        return (self.place.text or "").split(None, 9)[9].rstrip()

    def features(self) -> Table:
        text, place = self.after.text or "", self.after
        values, good = _photocore.read_numbers(text.encode()) if text.isascii() else (np.zeros(0), False)
        if not good:
            word = text.split()[len(values)]
            raise place.error(phrase("colmap.number", feature=len(values) // 3 + 1, value=word))
        if len(values) % 3:
            raise place.error(phrase("colmap.groups", n=len(values), size=3, names="X, Y, POINT3D_ID"))
        x, y, points = values.reshape(-1, 3).T
        points = np.where(points == _EMPTY, NO_POINT, points)
        bad = (points != np.floor(points)) | (points < NO_POINT) | (points >= 2**53)
        if bad.any():
            row = int(np.argmax(bad))
            raise place.error(phrase("colmap.number", feature=row + 1, value=f"{points[row]:g}"))
        table = np.empty(len(points), _FEATURE)
        table["xy"], table["point"] = np.column_stack([x, y]), points
        return table

    def end(self) -> None:
        """Reject words after the last field."""
        if self.at < len(self.words):
            raise self.place.error(phrase("colmap.beyond", words=" ".join(self.words[self.at :][:4])))


class _Bytes(_Record):
    """The bytes of a file, record by record."""

    def __init__(self, path: Path, least: int) -> None:
        self.path, self.data, self.at, self.record = path, read_bytes(path), 0, 0
        self.records = self.count(least)

    @property
    def place(self) -> Place:  # type: ignore[override]
        return Place(self.path, self.record or None, f"byte {self.at}")

    def skip(self, size: int) -> int:
        """Return the index of the next bytes and move past them."""
        if size > len(self.data) - self.at:
            raise self.place.error(phrase("colmap.bytes", n=size - (len(self.data) - self.at)))
        self.at += size
        return self.at - size

    def take(self, form: str, *names: str) -> tuple[Any, ...]:
        return struct.unpack_from("<" + form, self.data, self.skip(struct.calcsize("<" + form)))

    def word(self, name: str, words: Iterable[str]) -> str:
        number, known = self.take("i")[0], tuple(words)
        return known[number] if 0 <= number < len(known) else str(number)

    def count(self, least: int) -> int:
        """Return the number of records that follow, each with a minimum size in bytes."""
        number: int = self.take("Q")[0]
        if number * least > len(self.data) - self.at:
            left = len(self.data) - self.at
            raise self.place.error(phrase("colmap.count", n=number, least=least, left=left))
        return number

    def title(self) -> str:
        end = self.data.find(b"\0", self.at, self.at + _MAX_NAME)
        if end < 0:
            raise self.place.error(phrase("format.end", name="NAME"))
        name, self.at = self.data[self.at : end].decode("utf-8", "replace"), end + 1
        return name

    def features(self) -> Table:
        count = self.count(_FEATURE.itemsize)
        return np.frombuffer(self.data, _FEATURE, count, self.skip(count * _FEATURE.itemsize))

    def end(self) -> None:
        """Reject bytes after the last record."""
        if self.at < len(self.data):
            raise self.place.error(phrase("colmap.beyond", words=f"{len(self.data) - self.at} bytes"))


def _lines(folder: Path, name: str) -> Iterator[_Line]:
    """Yield the records of a text file; all words of a record must be read."""
    for place in filled_lines(folder / f"{name}.txt"):
        line = _Line(place)
        yield line
        line.end()


def _image_lines(path: Path) -> Iterator[_Line]:
    lines = enumerate(read_lines(path), 1)
    for record, line in lines:
        if line.strip() and not line.lstrip().startswith("#"):
            after, features = next(lines, (record + 1, ""))
            yield _Line(Place(path, record, line), Place(path, after, features))


def _bytes(folder: Path, name: str) -> Iterator[_Bytes]:
    """Yield the file at each record; all its bytes must be read."""
    file = _Bytes(folder / f"{name}.bin", _MIN_BYTES[name])
    for record in range(1, file.records + 1):
        file.record = record
        yield file
    file.end()


def read_model(folder: Path) -> Model:
    """Read a model; binary files if there are both, as the package does."""
    binary = (folder / "cameras.bin").is_file()
    end, records = (".bin", _bytes) if binary else (".txt", _lines)
    images = _bytes(folder, "images") if binary else _image_lines(folder / "images.txt")
    return Model(
        folder,
        [_camera(record) for record in records(folder, "cameras")],
        _images(images),
        _binary_points(folder / "points3D.bin") if binary else _text_points(folder),
        [_rig(record) for record in records(folder, "rigs")] if (folder / f"rigs{end}").is_file() else [],
        [_frame(record) for record in records(folder, "frames")]
        if (folder / f"frames{end}").is_file()
        else [],
    )


def _camera(record: _Record) -> Camera:
    place, [number], model = record.place, record.take("I", "CAMERA_ID"), record.word("MODEL", MODELS)
    if model not in MODELS:
        raise place.error(phrase("colmap.model", camera=number, model=model, names=list(MODELS)))
    width, height = record.take("2Q", "WIDTH", "HEIGHT")
    names = [f"parameter {k + 1} of {MODELS[model]}" for k in range(MODELS[model])]
    return Camera(number, model, width, height, record.take(f"{len(names)}d", *names), place)


def _images(records: Iterable[_Record]) -> Images:
    heads, poses, names, places = [], [], [], []
    features = [np.zeros(0, _FEATURE)]
    for record in records:
        places.append(record.place)
        [number], pose, [camera] = record.take("I", "IMAGE_ID"), record.pose(), record.take("I", "CAMERA_ID")
        heads.append((number, camera))
        poses.append((*pose.quaternion, *pose.translation))
        names.append(record.title())
        features.append(record.features())
    numbers, cameras = np.array(heads, dtype=np.int64).reshape(-1, 2).T
    table, own = np.array(poses, dtype=float).reshape(-1, 7), np.concatenate(features)
    counts = np.array([len(part) for part in features[1:]], dtype=np.int64)
    xy = np.array(own["xy"]).reshape(-1, 2)
    return Images(
        numbers, cameras, table[:, :4], table[:, 4:], names, counts, xy, own["point"].copy(), places
    )


def _text_points(folder: Path) -> Points:
    rows, places = [], []
    for line in _lines(folder, "points3D"):
        [number] = line.take("Q", "POINT3D_ID")
        xyz, rgb = line.take("3d", *"XYZ"), line.take("3B", *"RGB")
        [error], track = line.take("d", "ERROR"), line.words[line.at :]
        if len(track) % 2:
            names = "IMAGE_ID, POINT2D_IDX"
            raise line.place.error(phrase("colmap.groups", n=len(track), size=2, names=names))
        rows.append((number, xyz, rgb, error, len(track) // 2))
        places.append(line.place)
        line.at = len(line.words)
    return _points(np.array(rows, _POINT), places)


def _binary_points(path: Path) -> Points:
    file, size = _Bytes(path, _POINT.itemsize), _POINT.itemsize
    starts = np.empty(file.records, dtype=np.int64)
    unpack, data, last, at = struct.Struct("<Q").unpack_from, file.data, len(file.data), file.at
    for row in range(file.records):
        starts[row] = at
        track = unpack(data, at + size - 8)[0] if at + size <= last else 0
        at += size + 8 * track
        if at > last:
            file.at, file.record = int(starts[row]), row + 1
            raise file.place.error(phrase("colmap.bytes", n=at - last))
    file.at = at
    file.end()
    raw, rows = np.frombuffer(data, np.uint8), np.empty((file.records, size), np.uint8)
    for first in range(0, file.records, 1 << 16):
        part = starts[first : first + (1 << 16), np.newaxis] + np.arange(size)
        rows[first : first + (1 << 16)] = raw[part]
    return _points(rows.reshape(-1).view(_POINT), _Places(path, file.records))


def _points(table: Table, places: Sequence[Place]) -> Points:
    xyz, rgb = np.array(table["xyz"]).reshape(-1, 3), table["rgb"].astype(np.int64).reshape(-1, 3)
    return Points(table["number"].astype(np.int64), xyz, rgb, table["track"].astype(np.int64), places)


class _Places(Sequence[Place]):
    """Locations of records, created on demand."""

    def __init__(self, path: Path, number: int) -> None:
        self.path, self.number = path, number

    def __len__(self) -> int:
        return self.number

    def __getitem__(self, row: int) -> Place:  # type: ignore[override]
        return Place(self.path, row + 1)


def _rig(record: _Record) -> Rig:
    place, [number] = record.place, record.take("I", "RIG_ID")
    [sensors] = record.take("I", "NUM_SENSORS")
    reference = record.sensor() if sensors else None
    others = []
    for _ in range(sensors - 1):
        sensor = record.sensor()
        others.append((*sensor, record.pose() if record.take("?", "HAS_POSE")[0] else None))
    return Rig(number, reference, tuple(others), place)


def _frame(record: _Record) -> Frame:
    place, [number], [rig] = record.place, record.take("I", "FRAME_ID"), record.take("I", "RIG_ID")
    pose, [count] = record.pose(), record.take("I", "NUM_DATA_IDS")
    data = [(*record.sensor(), record.take("Q", "DATA_ID")[0]) for _ in range(count)]
    return Frame(number, rig, pose, tuple(data), place)


def binary_files(model: Model) -> dict[str, bytes]:
    """Return the binary files of a model."""
    numbers = {name: number for names in (MODELS, SENSORS) for number, name in enumerate(names)}

    def packed(form: str, values: Any) -> bytes:
        if form in ("features", "track"):
            return values.tobytes()  # type: ignore[no-any-return]
        if form == "name":
            return f"{values}\0".encode()
        if form == "word":
            return struct.pack("<i", numbers.get(values, -1))
        return struct.pack("<" + form.replace("|", ""), *values)

    return {
        f"{name}.bin": struct.pack("<Q", len(records))
        + b"".join(packed(form, values) for record in records for form, values in record)
        for name, records in _records(model).items()
    }


def text_files(model: Model) -> dict[str, bytes]:
    """Return the text files of a model; underscores replace blanks in names."""

    def words(form: str, values: Any) -> str:
        if form == "word":
            return str(values)
        if form == "name":
            return "_".join(values.split()) + "\n"
        if form == "features":
            rows = zip(values["xy"].tolist(), values["point"].tolist(), strict=True)
            return " ".join(f"{x!r} {y!r} {point}" for (x, y), point in rows)
        shown = values.ravel().tolist() if form == "track" else values[: len(values) - ("|" in form)]
        return " ".join(repr(float(x)) if isinstance(x, float) else str(int(x)) for x in shown)

    def line(record: Record) -> str:
        parts = [words(form, values) for form, values in record]
        return " ".join(part for part in parts if part).replace("\n ", "\n")

    lines = {name: [line(record) for record in records] for name, records in _records(model).items()}
    return {f"{name}.txt": "\n".join([_HEADS[name], *own, ""]).encode() for name, own in lines.items()}


def _records(model: Model) -> dict[str, list[Record]]:
    """Return the records of each file as values with their forms.

    A form is characters of `struct`, with a count that text omits after `|`, or the kind of the value.
    """
    images, points = model.images, model.points
    features = np.empty(len(images.xy), _FEATURE)
    features["xy"], features["point"] = images.xy, images.points
    poses = np.hstack([images.quaternions, images.translations]).tolist()
    parts = np.split(features, np.cumsum(images.counts))
    heads = zip(images.numbers, poses, images.cameras, images.names, parts, strict=False)
    return {
        "cameras": [
            [
                ("I", [camera.number]),
                ("word", camera.model),
                (f"2Q{len(camera.parameters)}d", [camera.width, camera.height, *camera.parameters]),
            ]
            for camera in model.cameras
        ],
        "images": [
            [("I7dI", [number, *pose, camera]), ("name", name), ("|Q", [len(part)]), ("features", part)]
            for number, pose, camera, name, part in heads
        ],
        "points3D": [
            [("Q3d3Bd|Q", [number, *xyz, *rgb, -1, len(track)]), ("track", track)]
            for number, xyz, rgb, track in zip(
                points.numbers.tolist(),
                points.positions.tolist(),
                points.colours.tolist(),
                _tracks(model),
                strict=True,
            )
        ],
        "rigs": [_rig_record(rig) for rig in model.rigs],
        "frames": [
            [
                ("II7dI", [frame.number, frame.rig, *_numbers(frame.pose), len(frame.data)]),
                *(
                    field
                    for kind, sensor, image in frame.data
                    for field in (("word", kind), ("IQ", [sensor, image]))
                ),
            ]
            for frame in model.frames
        ],
    }


def _tracks(model: Model) -> list[Indices]:
    """Return the images of each point, with the index of the feature there."""
    images, points = model.images, model.points
    rows = np.repeat(np.arange(len(images.counts)), images.counts)
    within = np.arange(len(rows)) - np.repeat(np.cumsum(images.counts) - images.counts, images.counts)
    places = {number: row for row, number in enumerate(points.numbers.tolist())}
    owner = np.array([places.get(number, -1) for number in images.points.tolist()], dtype=np.int64)
    order = np.argsort(owner, kind="stable")
    order = order[owner[order] >= 0]
    pairs = np.column_stack([images.numbers[rows[order]], within[order]]).astype("<u4")
    ends = np.searchsorted(owner[order], np.arange(len(points.numbers)), side="right")
    return np.split(pairs, ends)[:-1]


def _numbers(pose: Pose) -> tuple[float, ...]:
    return *pose.quaternion, *pose.translation


def _rig_record(rig: Rig) -> Record:
    if rig.reference is None:
        return [("2I", [rig.number, 0])]
    kind, number = rig.reference
    record: Record = [("2I", [rig.number, 1 + len(rig.sensors)]), ("word", kind), ("I", [number])]
    for kind, number, pose in rig.sensors:
        record += [("word", kind), ("I?", [number, pose is not None])]
        record += [] if pose is None else [("7d", _numbers(pose))]
    return record
