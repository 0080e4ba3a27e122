"""Contents of PhotoModeler and DBAT files, and their conversion to a project.

Pixels count from the upper-left corner, columns to the right and rows down. Cameras are backward in
millimetres, y up: (column h - px, py - row h) plus the distortion terms is -c u/w. A project counts from the
image centre, in square pixels of the height of a row. An affinity contains the difference along columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.format import Wishes
from photogram.formats.images import by_camera
from photogram.formats.project import PointTable, Project, Size, assembled
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.words import Phrase, option_sd, phrase


@dataclass(frozen=True)
class Sensor:
    """A camera, its image size, and the side of its pixels in millimetres."""

    camera: Camera
    size: Size
    pixel: float

    def images(self, pixels: Floats) -> Floats:
        """Convert columns and rows to (m, 2) millimetres from the image centre, y up."""
        width, height = self.size
        found: Floats = (pixels - [width / 2, height / 2]) * [self.pixel, -self.pixel]
        return found


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


def sensors_of_table(
    cameras: Sequence[Camera], sizes: Sequence[Size | None], pixels: Sequence[float | None], path: Path
) -> dict[str, Sensor]:
    """Return the cameras of a table of the plain project, by their names."""
    found = {}
    for camera, size, pixel in zip(cameras, sizes, pixels, strict=True):
        if size is None or pixel is None or camera.image_y != "up":
            raise InputError(phrase("dbat.camera", camera=camera.title), file=path)
        found[camera.name] = Sensor(camera, size, pixel)
    return found


@dataclass
class Content:
    """The contents of the files; photos and points have numbers."""

    path: Path
    title: str
    sensors: dict[str, Sensor] = field(default_factory=dict)  # The cameras by name
    # Name and camera of each photo; its centre, and omega, phi, kappa in radians
    photos: dict[int, str] = field(default_factory=dict)
    cameras: dict[int, str] = field(default_factory=dict)
    poses: dict[int, tuple[Floats, Floats]] = field(default_factory=dict)
    # Position and standard deviations of control points, of check points, and computed positions of others
    control: dict[int, tuple[Floats, Floats]] = field(default_factory=dict)
    checks: dict[int, Floats] = field(default_factory=dict)
    check_sd: dict[int, Floats] = field(default_factory=dict)
    starts: dict[int, Floats] = field(default_factory=dict)
    image_photos: list[int] = field(default_factory=list)
    image_points: list[int] = field(default_factory=list)
    # (m, 2) columns and rows from the corner, and their standard deviations; NaN without
    pixels: Floats = field(default_factory=lambda: np.empty((0, 2)))
    image_sd: Floats = field(default_factory=lambda: np.empty((0, 2)))
    # Photos with fixed poses, and free parameters of cameras
    held: set[int] = field(default_factory=set)
    free: set[str] = field(default_factory=set)
    options: AdjustOptions = field(default_factory=AdjustOptions)
    lacks: list[Phrase] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)


def project_of(content: Content, wishes: Wishes) -> Project:
    """Return the project; user-defined standard deviations are in pixels."""
    if not content.image_photos:
        raise InputError(phrase("format.missing", what="image observations"), file=content.path)
    order = {number: row for row, number in enumerate(content.photos)}
    centres, matrices = np.full((len(order), 3), np.nan), np.full((len(order), 3, 3), np.nan)
    posed = [number for number in order if number in content.poses]
    if posed:
        rows = [order[number] for number in posed]
        centres[rows] = [content.poses[number][0] for number in posed]
        angles = np.array([content.poses[number][1] for number in posed])
        matrices[rows] = Attitudes.of("omega_phi_kappa", angles).matrices
    points = list(dict.fromkeys([*content.image_points, *content.control, *content.checks]))
    places = {number: row for row, number in enumerate(points)}
    table = PointTable([str(number) for number in points])
    for number, position in content.starts.items():
        if number in places:
            table.starts[places[number]] = position
    for number, position in content.checks.items():
        table.starts[places[number]] = table.positions[places[number]] = position
        table.check_sd[places[number]] = content.check_sd.get(number, np.nan)
    for number, (position, deviations) in content.control.items():
        table.starts[places[number]] = table.positions[places[number]] = position
        table.sd[places[number]] = deviations
    sensors = list(content.sensors.values())
    sensor_rows = {name: row for row, name in enumerate(content.sensors)}
    photo_cameras = np.array([sensor_rows[content.cameras[number]] for number in order])
    image_photos = np.array([order[number] for number in content.image_photos], dtype=np.int64)
    of_images = photo_cameras[image_photos]
    pixel = np.array([sensor.pixel for sensor in sensors])[of_images, np.newaxis]
    given = wishes.sd.get("images", content.image_sd)
    image_sd = pixel * np.broadcast_to(given, content.image_sd.shape)
    lacks = list(content.lacks)
    if (missing := np.isnan(image_sd)).any():
        image_sd = np.where(missing, pixel, image_sd)
        lacks.append(Phrase("read.images", {"number": 1.0, "unit": "pixel", "option": option_sd("images")}))
    held = np.where([number in content.held for number in order], 0.0, np.inf)[:, np.newaxis] * np.ones(3)
    free = dict.fromkeys(content.free, np.inf)
    return assembled(
        path=content.path,
        title=content.title,
        cameras=[each.camera.replace(sd=free) if free else each.camera for each in sensors],
        sizes=[each.size for each in sensors],
        pixel_mm=[each.pixel for each in sensors],
        photo_ids=_names(content),
        photo_cameras=photo_cameras,
        centres=centres,
        matrices=matrices,
        photo_position_sd=held,
        photo_attitude_sd=held,
        **table.arguments(),
        image_photos=image_photos,
        image_points=np.array([places[number] for number in content.image_points], dtype=np.int64),
        image_xy=by_camera(content.pixels, of_images, lambda row, own: sensors[row].images(own)),
        image_sd=image_sd,
        options=content.options,
        lacks=lacks,
        messages=content.messages,
    ).replace(sd_taken=True)


def _names(content: Content) -> list[str]:
    """Return unique names of photos: file names, with folders if necessary."""
    whole = [name.replace("\\", "/").strip() for name in content.photos.values()]
    short = [name.rpartition("/")[2] for name in whole]
    if all(short) and len(set(short)) == len(short):
        return short
    if all(whole) and len(set(whole)) == len(whole):
        return whole
    content.messages.append(Message(phrase("dbat.names", names=sorted(set(short)))))
    return [str(number) for number in content.photos]
