"""Contents of PhotoModeler and DBAT files, and their conversion to a project.

Pixels count from the upper-left corner, columns to the right and rows down. Cameras are backward in
millimetres, y up: (column h - px, py - row h) plus the distortion terms is -c u/w. A project counts from the
image centre, in square pixels of the height of a row. An affinity contains the difference along columns.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.types import Floats
from photogram.formats.builder import BlockBuilder
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.io.places import Failing
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.words import Phrase, option_sd, phrase


@dataclass(frozen=True)
class Sensor:
    """A camera, its image size, and the side of its pixels in millimetres."""

    camera: Camera
    size: Size
    pixel: float


def sensor_of(
    name: str,
    size: Size,
    sides: tuple[float, float],
    principal: tuple[float, float, float],
    terms: dict[str, float],
    skew: float = 0.0,
) -> Sensor:
    """Return a camera from parameters of PhotoModeler and DBAT in millimetres.

    `sides` are width and height of a pixel; `principal` is c, and the principal point from the upper-left
    corner, to the right and down; `terms` are K1, K2, K3, P1, P2.
    """
    across, down = sides
    c, px, py = principal
    affinity = across / down - 1
    width, height = size
    parameters = {
        "c": -c,
        "xp": px / (1 + affinity) - width / 2 * down,
        "yp": height / 2 * down - py,
        "b1": affinity,
        "b2": skew,
        **terms,
    }
    return Sensor(Camera("brown", parameters, name=name), size, down)


class DbatBuilder(BlockBuilder):
    """A block of the files; keys of photos and points are numbers."""

    def __init__(self, path: Path, title: str) -> None:
        super().__init__(path, title)
        self.sensors: dict[str, Sensor] = {}
        self.paths: list[str] = []  # Files of photos
        # Standard deviations of columns and rows of each image observation; NaN without
        self.image_sd: list[Floats] = []
        # Photos with fixed poses, and free parameters of cameras
        self.held: set[int] = set()
        self.free: set[str] = set()
        self.options = AdjustOptions()

    def sensor(self, name: str, sensor: Sensor) -> None:
        """Add a camera."""
        self.sensors[name] = sensor
        self.camera(sensor.camera, sensor.size, sensor.pixel, key=name)

    def numbered_photo(self, number: int, path: str, camera: str, place: Failing) -> None:
        """Add a photo with its file."""
        self.photo(number, camera, place)
        self.paths.append(path)

    def check_photo(self, number: int, place: Failing) -> None:
        """Reject a photo that was not added."""
        if number not in self.photo_rows:
            raise place.error(phrase("format.undefined", what="photo", name=str(number)))

    def pixel(self, photo: int, point: int, xy: Floats, sd: Floats) -> None:
        """Add an image observation: column and row from the corner."""
        self.image(photo, point, *xy.tolist())
        self.image_sd.append(sd)

    def dbat_project(self, options: ReadOptions) -> Project:
        """Return the project; user-defined standard deviations are in pixels."""
        if not self.image_keys:
            raise self.place.error(phrase("format.missing", what="image observations"))
        photos, points, pixels = self.image_rows()
        cameras = np.array(self.photo_cameras)[photos]
        side = np.array(self.pixel_mm, dtype=float)[cameras, np.newaxis]
        sd = side * np.broadcast_to(options.sd.get("images", np.array(self.image_sd)), pixels.shape)
        if (missing := np.isnan(sd)).any():
            sd = np.where(missing, side, sd)
            fields = {"number": 1.0, "unit": "pixel", "option": option_sd("images")}
            self.lacks.append(Phrase("read.images", fields))
        # Millimetres from the image centre, y up
        middles = np.array([sensor.size for sensor in self.sensors.values()])[cameras] / 2
        xy = (pixels - middles) * side * [1, -1]
        self.images(photos, points, xy, sd)
        held = [[0.0 if number in self.held else np.inf] * 3 for number in self.photo_rows]
        self.position_sd = self.attitude_sd = held
        if self.free:
            self.cameras = [each.replace(sd=dict.fromkeys(self.free, np.inf)) for each in self.cameras]
        self.photo_ids = self._names()
        return self.project(options=self.options).replace(sd_taken=True)

    def _names(self) -> list[str]:
        """Return unique names of photos: file names, with folders if necessary."""
        whole = [name.replace("\\", "/").strip() for name in self.paths]
        short = [name.rpartition("/")[2] for name in whole]
        for names in (short, whole):
            if all(names) and len(set(names)) == len(names):
                return names
        self.messages.append(Message(phrase("dbat.names", names=sorted(set(short)))))
        return self.photo_ids
