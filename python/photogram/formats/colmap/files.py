"""Files of COLMAP models, as text and little-endian binary.

The fields of a record are declared in the order of the files. Text and binary files, reading and writing use
the same declarations.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Indices
from photogram.formats.cards import filled_lines
from photogram.io.files import read_bytes, read_lines
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.words import phrase

_NAMES = (
    "SIMPLE_PINHOLE PINHOLE SIMPLE_RADIAL RADIAL OPENCV OPENCV_FISHEYE FULL_OPENCV FOV SIMPLE_RADIAL_FISHEYE"
    " RADIAL_FISHEYE THIN_PRISM_FISHEYE RAD_TAN_THIN_PRISM_FISHEYE SIMPLE_DIVISION DIVISION SIMPLE_FISHEYE"
    " FISHEYE EUCM EQUIRECTANGULAR"
)
_KNOWN = dict(_photocore.camera_models())
MODELS = {name: [own for own, _ in _KNOWN[name.lower()][1]] for name in _NAMES.split()}
"""Names in the order of their numbers, with their parameters; camera models have small letters."""
NO_POINT = -1
CAMERA = "CAMERA"
SENSORS = (CAMERA, "IMU")  # Types of sensors in the order of their numbers


WORDS: dict[str, Sequence[str]] = {"model": tuple(MODELS), "sensor": SENSORS}
"""Words of text files by form; binary files have their index."""
FEATURE = np.dtype([("xy", "<f8", 2), ("point", "<i8")])
POINT = np.dtype([("number", "<u8"), ("xyz", "<f8", 3), ("rgb", "u1", 3), ("error", "<f8"), ("track", "<u8")])
"""Features of images, and points up to their tracks, in binary files."""


Table = NDArray[Any]


class Form(NamedTuple):
    """Form of a field: a character of `struct`, a key of `WORDS`, `name`, `features`, or a record.

    `number` is the number of values, of groups with these names, or of records: a function of the previous
    fields. None: one value for each name.
    """

    kind: str | type
    names: tuple[str, ...]
    number: Callable[[dict[str, Any]], int] | None


def _form(kind: str | type, names: str = "", number: Callable[[dict[str, Any]], int] | None = None) -> Any:
    return field(metadata={"form": Form(kind, tuple(names.split()), number)})


@cache
def layout(kind: type) -> dict[str, Form]:
    """Return the stored fields of a record with their forms."""
    return {each.name: each.metadata["form"] for each in fields(kind) if each.metadata}


_POSE = "QW QX QY QZ TX TY TZ"
"""R and t of a rigid motion: w, x, y, z of its quaternion, and its translation."""


@dataclass(frozen=True)
class Camera:
    """A record of cameras."""

    number: int = _form("I", "CAMERA_ID")
    model: str = _form("model", "MODEL")
    width: int = _form("Q", "WIDTH")
    height: int = _form("Q", "HEIGHT")
    parameters: tuple[float, ...] = _form("d", "parameter", lambda own: len(MODELS.get(own["model"], ())))
    place: Place = Place()


@dataclass(frozen=True)
class Image:
    """A record of images; its pose is camera from world."""

    number: int = _form("I", "IMAGE_ID")
    pose: tuple[float, ...] = _form("d", _POSE)
    camera: int = _form("I", "CAMERA_ID")
    name: str = _form("name", "NAME")
    features: Table = _form("features", "POINTS2D")
    place: Place = Place()


@dataclass(frozen=True)
class Sensor:
    """A sensor of a rig."""

    kind: str = _form("sensor", "SENSOR_TYPE")
    number: int = _form("I", "SENSOR_ID")


@dataclass(frozen=True)
class MountedSensor(Sensor):
    """A sensor with its pose, sensor from rig, if it is known."""

    has_pose: bool = _form("?", "HAS_POSE")
    pose: tuple[float, ...] = _form("d", _POSE, lambda own: own["has_pose"])


@dataclass(frozen=True)
class Rig:
    """A rig: number of sensors, its reference sensor, if any, and others."""

    number: int = _form("I", "RIG_ID")
    count: int = _form("I", "NUM_SENSORS")
    reference: tuple[Sensor, ...] = _form(Sensor, number=lambda own: min(own["count"], 1))
    sensors: tuple[MountedSensor, ...] = _form(MountedSensor, number=lambda own: own["count"] - 1)
    place: Place = Place()


@dataclass(frozen=True)
class SensorImage(Sensor):
    image: int = _form("Q", "DATA_ID")


@dataclass(frozen=True)
class Frame:
    """A frame: the pose of its rig, rig from world, and the images of its sensors."""

    number: int = _form("I", "FRAME_ID")
    rig: int = _form("I", "RIG_ID")
    pose: tuple[float, ...] = _form("d", _POSE)
    count: int = _form("I", "NUM_DATA_IDS")
    data: tuple[SensorImage, ...] = _form(SensorImage, number=lambda own: own["count"])
    place: Place = Place()


@dataclass(frozen=True)
class Model:
    """A model; without rigs and frames each camera is a rig.

    `points` is a table of `POINT`, and `point_place` returns the location of a row in files.
    """

    path: Path
    cameras: list[Camera]
    images: list[Image]
    points: Table
    rigs: list[Rig] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    point_place: Callable[[int], Place] = lambda _: Place()

    @cached_property
    def numbers(self) -> Indices:
        """(n,) numbers of the images."""
        return np.array([each.number for each in self.images], dtype=np.int64)

    @cached_property
    def counts(self) -> Indices:
        """(n,) features of each image."""
        return np.array([len(each.features) for each in self.images], dtype=np.int64)

    @cached_property
    def features(self) -> Table:
        """The features of all images, one image after the other."""
        return np.frombuffer(b"".join(each.features.data for each in self.images), FEATURE)


_Kind = TypeVar("_Kind")

_EMPTY = 2.0**64  # 2^64 - 1, by which binary files mark features without a point, as a number of a text
_MAX_NAME = 4096
_HIGHEST = {"I": 2**32 - 1, "Q": 2**53, "B": 255, "?": 1}
_MIN_BYTES = {"cameras": 24, "images": 73, "points3D": POINT.itemsize, "rigs": 8, "frames": 68}
_HEADS = {
    "cameras": "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]",
    "images": "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)",
    "points3D": "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)",
    "rigs": "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID,"
    " HAS_POSE, [QW, QX, QY, QZ, TX, TY, TZ])",
    "frames": "# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as"
    " (SENSOR_TYPE, SENSOR_ID, DATA_ID)",
}


def _read(source: _Line | _Bytes, kind: type[_Kind]) -> _Kind:
    values: dict[str, Any] = {"place": source.place} if hasattr(kind, "place") else {}
    for name, form in layout(kind).items():  # type: ignore[arg-type]
        if form.number is None:
            found = source.take(str(form.kind), form.names)
            values[name] = found[0] if len(form.names) == 1 else found
            continue
        number = form.number(values)
        if isinstance(form.kind, str):
            names = [f"{form.names[0]} {k + 1} of {number}" for k in range(number)]
            values[name] = source.take(form.kind, names if len(form.names) == 1 else form.names * number)
        else:
            values[name] = tuple(_read(source, form.kind) for _ in range(number))
    return kind(**values)


class _Line:
    """A line of words; images have their features in the next line."""

    def __init__(self, place: Place, after: Place | None = None) -> None:
        self.place, self.after, self.at = place, after or Place(), 0
        self.words = (place.text or "").split()

    def take(self, kind: str, names: Sequence[str]) -> Sequence[Any]:
        if kind == "features":
            return [self._features()]
        words = self.words[self.at : self.at + len(names)]
        values: Sequence[Any] = words
        if kind == "d":
            values = tuple(self.place.number(*each) for each in zip(words, names, strict=False))
        elif kind in _HIGHEST:
            highest = _HIGHEST[kind]
            values = tuple(self.place.whole(*each, highest) for each in zip(words, names, strict=False))
        if len(words) < len(names):
            raise self.place.error(phrase("format.end", name=names[len(words)]))
        self.at += len(words)
        if kind == "name":
            # Some programs write names with blanks.
            self.at = len(self.words)
            return [(self.place.text or "").split(None, 9)[9].rstrip()]
        return values

    def _features(self) -> Table:
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
        table = np.empty(len(points), FEATURE)
        table["xy"], table["point"] = np.column_stack([x, y]), points
        return table

    def end(self) -> None:
        """Reject words after the last field."""
        if self.at < len(self.words):
            raise self.place.error(phrase("colmap.beyond", words=" ".join(self.words[self.at :][:4])))


class _Bytes:
    def __init__(self, path: Path, least: int) -> None:
        self.path, self.data, self.at, self.record = path, read_bytes(path), 0, 0
        self.records = self.count(least)

    @property
    def place(self) -> Place:
        return Place(self.path, self.record or None, f"byte {self.at}")

    def skip(self, size: int) -> int:
        """Return the index of the next bytes and move past them."""
        if size > len(self.data) - self.at:
            raise self.place.error(phrase("colmap.bytes", n=size - (len(self.data) - self.at)))
        self.at += size
        return self.at - size

    def take(self, kind: str, names: Sequence[str]) -> Sequence[Any]:
        if kind == "features":
            count = self.count(FEATURE.itemsize)
            return [np.frombuffer(self.data, FEATURE, count, self.skip(count * FEATURE.itemsize))]
        if kind == "name":
            end = self.data.find(b"\0", self.at, self.at + _MAX_NAME)
            if end < 0:
                raise self.place.error(phrase("format.end", name=names[0]))
            name, self.at = self.data[self.at : end].decode("utf-8", "replace"), end + 1
            return [name]
        form = f"<{len(names)}{'i' if kind in WORDS else kind}"
        found = struct.unpack_from(form, self.data, self.skip(struct.calcsize(form)))
        if kind not in WORDS:
            return found
        known = WORDS[kind]
        return [known[number] if 0 <= number < len(known) else str(number) for number in found]

    def count(self, least: int) -> int:
        """Return the number of records that follow, each with a minimum size in bytes."""
        number: int = self.take("Q", [""])[0]
        if number * least > len(self.data) - self.at:
            left = len(self.data) - self.at
            raise self.place.error(phrase("colmap.count", n=number, least=least, left=left))
        return number

    def end(self) -> None:
        """Reject bytes after the last record."""
        if self.at < len(self.data):
            raise self.place.error(phrase("colmap.beyond", words=f"{len(self.data) - self.at} bytes"))


def _sources(folder: Path, name: str, binary: bool) -> Iterator[_Line | _Bytes]:
    """Yield a file, or its lines, at each record; all bytes or words of it must be read."""
    if binary:
        file = _Bytes(folder / f"{name}.bin", _MIN_BYTES[name])
        for record in range(1, file.records + 1):
            file.record = record
            yield file
        file.end()
        return
    path = folder / f"{name}.txt"
    if name == "images":
        lines = enumerate(read_lines(path), 1)
        for record, line in lines:
            if line.strip() and not line.lstrip().startswith("#"):
                after, features = next(lines, (record + 1, ""))
                yield _Line(Place(path, record, line), Place(path, after, features))
        return
    for place in filled_lines(path):
        own = _Line(place)
        yield own
        own.end()


def read_model(folder: Path) -> Model:
    """Read a model; binary files if there are both, as the package does."""
    binary = (folder / "cameras.bin").is_file()
    cameras = []
    for record in _sources(folder, "cameras", binary):
        camera = _read(record, Camera)
        if camera.model not in MODELS:
            fields = {"camera": camera.number, "model": camera.model, "names": list(MODELS)}
            raise camera.place.error(phrase("colmap.model", **fields))
        cameras.append(camera)

    def further(name: str, kind: type[_Kind]) -> list[_Kind]:
        if not (folder / f"{name}{'.bin' if binary else '.txt'}").is_file():
            return []
        return [_read(record, kind) for record in _sources(folder, name, binary)]

    images = [_read(record, Image) for record in _sources(folder, "images", binary)]
    points, places = _binary_points(folder / "points3D.bin") if binary else _text_points(folder)
    model = Model(folder, cameras, images, points, further("rigs", Rig), further("frames", Frame), places)
    # The images share the table of all features, so that the bytes of the file are released.
    for image, part in zip(images, np.split(model.features, np.cumsum(model.counts)[:-1]), strict=False):
        object.__setattr__(image, "features", part)
    return model


def _text_points(folder: Path) -> tuple[Table, Callable[[int], Place]]:
    rows, places = [], []
    for place in filled_lines(folder / "points3D.txt"):
        line = _Line(place)
        [number], xyz = line.take("Q", ["POINT3D_ID"]), line.take("d", "XYZ")
        rgb, [error], track = line.take("B", "RGB"), line.take("d", ["ERROR"]), line.words[line.at :]
        if len(track) % 2:
            names = "IMAGE_ID, POINT2D_IDX"
            raise place.error(phrase("colmap.groups", n=len(track), size=2, names=names))
        rows.append((number, xyz, rgb, error, len(track) // 2))
        places.append(place)
    return np.array(rows, POINT), places.__getitem__


def _binary_points(path: Path) -> tuple[Table, Callable[[int], Place]]:
    file, size = _Bytes(path, POINT.itemsize), POINT.itemsize
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
    return rows.reshape(-1).view(POINT), lambda row: Place(path, row + 1)


def _values(record: Any) -> Iterator[tuple[str, tuple[Any, ...]]]:
    for name, form in layout(type(record)).items():  # type: ignore[arg-type]
        value = getattr(record, name)
        if isinstance(form.kind, str):
            yield form.kind, value if isinstance(value, tuple) else (value,)
        else:
            for each in value:
                yield from _values(each)


def binary_files(model: Model) -> dict[str, bytes]:
    def packed(kind: str, values: tuple[Any, ...]) -> bytes:
        if kind == "features":
            return struct.pack("<Q", len(values[0])) + bytes(values[0])
        if kind == "name":
            return f"{values[0]}\0".encode()
        if kind in WORDS:
            known = WORDS[kind]
            return struct.pack("<i", known.index(values[0]) if values[0] in known else -1)
        return struct.pack(f"<{len(values)}{kind}", *values)

    files = {
        f"{name}.bin": struct.pack("<Q", len(records))
        + b"".join(packed(*each) for record in records for each in _values(record))
        for name, records in _records(model).items()
    }
    table, tracks = model.points.copy(), _tracks(model)
    table["track"] = [len(track) for track in tracks]
    heads = table.view(f"V{POINT.itemsize}")
    points = (head.tobytes() + bytes(track) for head, track in zip(heads, tracks, strict=True))
    return files | {"points3D.bin": struct.pack("<Q", len(table)) + b"".join(points)}


def text_files(model: Model) -> dict[str, bytes]:
    """Return the text files of a model; underscores replace blanks in names."""

    def words(kind: str, values: tuple[Any, ...]) -> str:
        if kind == "features":
            rows = zip(values[0]["xy"].tolist(), values[0]["point"].tolist(), strict=True)
            return "\n" + " ".join(f"{x!r} {y!r} {point}" for (x, y), point in rows)
        if kind == "name":
            return "_".join(values[0].split())
        return " ".join(
            repr(float(x)) if kind == "d" else str(x if kind in WORDS else int(x)) for x in values
        )

    lines = {
        name: [" ".join(words(*each) for each in _values(record)) for record in records]
        for name, records in _records(model).items()
    }
    columns = (model.points[name].tolist() for name in ("number", "xyz", "rgb"))
    lines["points3D"] = [
        " ".join(map(repr, [number, *xyz, *rgb, -1, *track.ravel().tolist()]))
        for number, xyz, rgb, track in zip(*columns, _tracks(model), strict=True)
    ]
    return {
        f"{name}.txt": "\n".join([_HEADS[name], *own, ""]).replace(" \n", "\n").encode()
        for name, own in lines.items()
    }


def _records(model: Model) -> dict[str, Sequence[Any]]:
    return {name: getattr(model, name) for name in ("cameras", "images", "rigs", "frames")}


def _tracks(model: Model) -> list[Indices]:
    """Return the tracks of points: images with the index of the feature there."""
    counts = model.counts
    within = np.concatenate([np.zeros(0, dtype=np.int64), *map(np.arange, counts.tolist())])
    places = {number: row for row, number in enumerate(model.points["number"].tolist())}
    owner = np.array([places.get(number, -1) for number in model.features["point"].tolist()], dtype=np.int64)
    order = np.argsort(owner, kind="stable")
    order = order[owner[order] >= 0]
    pairs = np.column_stack([np.repeat(model.numbers, counts)[order], within[order]]).astype("<u4")
    ends = np.searchsorted(owner[order], np.arange(len(model.points)), side="right")
    return np.split(pairs, ends)[:-1]
