"""Records of a COLMAP model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from photogram.arguments.types import Floats, Indices
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, field

MODELS: dict[str, int] = {
    "SIMPLE_PINHOLE": 3,
    "PINHOLE": 4,
    "SIMPLE_RADIAL": 4,
    "RADIAL": 5,
    "OPENCV": 8,
    "OPENCV_FISHEYE": 8,
    "FULL_OPENCV": 12,
    "FOV": 5,
    "SIMPLE_RADIAL_FISHEYE": 4,
    "RADIAL_FISHEYE": 5,
    "THIN_PRISM_FISHEYE": 12,
    "RAD_TAN_THIN_PRISM_FISHEYE": 16,
    "SIMPLE_DIVISION": 4,
    "DIVISION": 5,
    "SIMPLE_FISHEYE": 3,
    "FISHEYE": 4,
    "EUCM": 6,
    "EQUIRECTANGULAR": 2,
}
"""Names in the order of their numbers, and their number of parameters; camera models have small letters."""
NO_POINT = -1
CAMERA = "CAMERA"
SENSORS = (CAMERA, "IMU")  # Types of sensors in the order of their numbers


@dataclass(frozen=True)
class Pose:
    """R and t of a rigid motion: w, x, y, z of its quaternion, and its translation."""

    quaternion: tuple[float, ...]
    translation: tuple[float, ...]


@dataclass(frozen=True)
class Camera:
    """A record of cameras."""

    number: int
    model: str
    width: int
    height: int
    parameters: tuple[float, ...]
    place: Place = Place()


@dataclass(frozen=True)
class Images:
    """The n images, with all f features one after the other."""

    numbers: Indices
    cameras: Indices
    quaternions: Floats  # (n, 4) w, x, y, z, world to camera
    translations: Floats
    names: list[str]
    counts: Indices  # (n,) features of each image
    xy: Floats  # (f, 2) columns and rows from the corner
    points: Indices  # (f,) ids of points, NO_POINT without
    places: Sequence[Place] = ()


@dataclass(frozen=True)
class Points:
    """The n points."""

    numbers: Indices
    positions: Floats
    colours: Indices  # (n, 3)
    tracks: Indices  # (n,) images in the track of each point
    places: Sequence[Place] = ()


@dataclass(frozen=True)
class Rig:
    """A rig: its reference sensor, and others with poses sensor from rig."""

    number: int
    reference: tuple[str, int] | None
    sensors: tuple[tuple[str, int, Pose | None], ...]
    place: Place = Place()


@dataclass(frozen=True)
class Frame:
    """A frame: the pose of its rig, rig from world, and the images of its sensors."""

    number: int
    rig: int
    pose: Pose
    data: tuple[tuple[str, int, int], ...]
    place: Place = Place()


@dataclass(frozen=True)
class Model:
    """A model; without rigs and frames each camera is a rig."""

    path: Path
    cameras: list[Camera]
    images: Images
    points: Points
    rigs: list[Rig] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
