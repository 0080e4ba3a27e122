"""Records of a COLMAP model.

The fields of a record are declared in the order of the files. Text and binary files, reading and writing use
the same declarations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Indices
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, field, fields

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
    """An image of a sensor."""

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

    `points` is a table of `POINT`, and `point_places` the locations of its rows in files.
    """

    path: Path
    cameras: list[Camera]
    images: list[Image]
    points: Table
    rigs: list[Rig] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    point_places: Sequence[Place] = ()

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
