"""From the five files to a block: the rules of the GIANT guide that hold between files."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.block import Block
from photogram.errors import InputError
from photogram.geometry import Spheroid
from photogram.giant.frames import ATTITUDE_SD, Frame
from photogram.giant.images import IMAGE_SD, ImageFrame
from photogram.giant.records import Record
from photogram.messages import Message

if TYPE_CHECKING:
    from photogram.giant.common import Common
    from photogram.giant.contents import Contents
    from photogram.giant.ground import GroundPoint

__all__ = ["assemble"]

Floats = NDArray[np.float64]

LONGEST_METRES = 1e7
"""No semi-major axis in metres is longer than this; in feet all are."""

EARTH_RADIUS = 6.37e6
FALSE_ORIGIN = 1e5
"""Coordinates in a map projection are longer than this, in metres; those of local systems rarely are."""
HIGHEST = 2e4
"""No aeroplane is higher, in metres; two geocentric coordinates of three are larger nearly everywhere."""
LEAST_FALL = 0.01
"""A fall of the curved earth worth a remark, in metres."""


def assemble(project: Contents) -> tuple[Block, list[Message]]:
    """Return the block of a project, and the remarks on what was left out or deserves a look.

    Photos stand in the order of FRAMES, points in the order of their first image.

    Raises
    ------
    InputError
        A frame without images, a camera that is not defined, or no frame at all.
    """
    common, messages = project.common, _unsupported(project.common)
    photos = _photos(project, messages)
    if not photos:
        raise InputError("FRAMES lists no frame with images", file=project.directory)
    frames = [frame for frame, _ in photos]
    images = [image_frame for _, image_frame in photos]

    names = [name for each in images for name in each.points]
    index = {name: number for number, name in enumerate(dict.fromkeys(names))}
    image_points = np.array([index[name] for name in names])
    image_photos = np.repeat(np.arange(len(images)), [len(each.points) for each in images])
    kept = _first_images(images, image_photos, image_points, messages)
    position, sd = _control(project, index, messages)
    stations = np.array([frame.position for frame in frames])
    if not common.geographic:
        messages += _flat_earth(stations)
    return (
        Block(
            photo_ids=[frame.name for frame in frames],
            photo_positions=_longitudes(stations, common.geographic),
            photo_attitudes=np.array([frame.attitude for frame in frames]),
            principal_distances=_principal_distances(project, images),
            point_ids=list(index),
            point_positions=_longitudes(position, common.geographic),
            image_photos=image_photos[kept],
            image_points=image_points[kept],
            image_xy=np.concatenate([each.xy for each in images])[kept],
            image_sd=_or_default([each.sd for each in images], IMAGE_SD)[image_photos[kept]],
            photo_position_sd=_or_default([frame.position_sd for frame in frames], common.default_station_sd),
            photo_attitude_sd=_or_default([frame.attitude_sd for frame in frames], ATTITUDE_SD),
            point_sd=sd,
            spheroid=_spheroid(common),
            photo_to_ground=common.photo_to_ground,
            title=common.title,
            linear_unit=_linear_unit(common),
        ),
        messages,
    )


def _error(record: Record | None, text: str) -> InputError:
    return record.error(text) if record else InputError(text)


def _message(record: Record | None, text: str) -> Message:
    return record.message(text) if record else Message(text)


def _unsupported(common: Common) -> list[Message]:
    asked = {"air": common.air_refraction, "water": common.water_refraction}
    return [
        Message(f"COMMON asks for {name} refraction, which is not applied yet")
        for name, on in asked.items()
        if on
    ]


def _photos(project: Contents, messages: list[Message]) -> list[tuple[Frame, ImageFrame]]:
    """Pair FRAMES with IMAGES. Images of frames that FRAMES does not list are left out silently."""
    listed = {frame.name for frame in project.frames}
    measured: dict[str, ImageFrame] = {}
    for images in project.images:
        first = measured.setdefault(images.name, images)
        if first is not images and images.name in listed:
            where = f" (record {first.record.number})" if first.record else ""
            raise _error(images.record, f"the frame {images.name!r} already has images{where}")
    photos = []
    for frame in project.frames:
        if frame.name in measured and measured[frame.name].points:
            photos.append((frame, measured[frame.name]))
        elif project.common.intersection_only:
            messages.append(_message(frame.record, f"the frame {frame.name!r} has no images: left out"))
        else:
            raise _error(
                frame.record,
                f"the frame {frame.name!r} has no images{_lost_header(project.images, frame.name)}",
            )
    return photos


def _lost_header(images: list[ImageFrame], name: str) -> str:
    """Say where the name of a frame stands among points: a terminator is missing before it."""
    for frame in images:
        if name in frame.points:
            record = frame.point_record(frame.points.index(name))
            where = f" (record {record.number} of {record.source.path.name})" if record else ""
            return f", but a point of {frame.name!r} has its name{where}: is a terminator **** missing?"
    return ""


def _principal_distances(project: Contents, images: list[ImageFrame]) -> Floats:
    cameras = {camera.name: camera.principal_distance for camera in project.cameras}
    for each in images:
        if not each.principal_distance and each.camera not in cameras:
            known = ", ".join(repr(name) for name in cameras) or "none"
            raise _error(
                each.record,
                f"the frame {each.name!r} has no principal distance,"
                f" and its camera {each.camera!r} is not in CAMERAS (there: {known})",
            )
    return np.array([each.principal_distance or cameras[each.camera] for each in images])


def _first_images(
    images: list[ImageFrame],
    image_photos: NDArray[np.int64],
    image_points: NDArray[np.int64],
    messages: list[Message],
) -> NDArray[np.int64]:
    """Return the rows of the first image of every point on every photo, in their order."""
    pairs = image_photos * (image_points.max() + 1) + image_points
    order = np.argsort(pairs, kind="stable")
    again = np.sort(order[1:][pairs[order[1:]] == pairs[order[:-1]]])
    starts = np.searchsorted(image_photos, np.arange(len(images)))
    for row in again.tolist():
        frame = images[image_photos[row]]
        at = row - starts[image_photos[row]]
        text = f"the point {frame.points[at]} stands in the frame {frame.name} twice: the first image is kept"
        messages.append(_message(frame.point_record(at), text))
    return np.delete(np.arange(len(pairs)), again)


def _control(project: Contents, index: dict[str, int], messages: list[Message]) -> tuple[Floats, Floats]:
    """Return positions and standard deviations of all points: those of GROUND where it has any."""
    position = np.full((len(index), 3), np.nan)
    sd = np.full((len(index), 3), np.inf)
    control: dict[int, GroundPoint] = {}
    for point in project.ground:
        row = index.get(point.name)
        if row is None:
            messages.append(
                _message(point.record, f"control point {point.name} is not photographed: ignored")
            )
            continue
        control[row] = point
    if control:
        rows = list(control)
        values = np.array([point.position for point in control.values()])
        held = np.array([point.held for point in control.values()])
        # The field of an unheld component may hold nothing: blanks or zero are no value to compare with.
        position[rows] = np.where(held | (values != 0), values, np.nan)
        weights = _or_default([point.sd for point in control.values()], project.common.default_control_sd)
        sd[rows] = np.where(held, weights, np.inf)
    if not np.isfinite(sd).any():
        record = next((point.record for point in project.ground if point.record), None)
        path = record.source.path if record else project.directory
        messages.append(Message("GROUND holds no component of a photographed point", path))
    return position, sd


def _flat_earth(stations: Floats) -> list[Message]:
    """Remark on rectangular coordinates that look like those of a map projection (State Plane, UTM).

    Their false eastings and northings are long, and their third axis is a height. Geocentric and local
    systems are legitimate (GIANT guide, section II.A).
    """
    longest = np.abs(stations).max(axis=0)
    reach = np.hypot(*(stations - stations.mean(axis=0))[:, :2].T).max()
    fall = reach**2 / (2 * EARTH_RADIUS)
    if longest[:2].max() < FALSE_ORIGIN or longest[2] > HIGHEST or fall < LEAST_FALL:
        return []
    text = "the coordinates look like those of a map projection: the curvature of the earth is not modelled,"
    return [Message(f"{text} which falls {fall:.2g} m from the middle of the stations to the outermost")]


def _or_default(values: ArrayLike, default: ArrayLike) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    return np.where(array == 0, np.asarray(default, dtype=np.float64), array)


def _longitudes(positions: Floats, geographic: bool) -> Floats:
    """Bring longitudes written as 0 to 360 degrees to -180 to 180, so that all files agree."""
    if geographic:
        longitude = positions[:, 0]
        positions[:, 0] = np.where(
            np.abs(longitude) > math.pi, longitude - np.copysign(2 * math.pi, longitude), longitude
        )
    return positions


def _linear_unit(common: Common) -> str:
    """Tell feet from metres by the axes of the spheroid, which fix the linear unit of the job."""
    return "ft" if common.geographic and common.semi_major > LONGEST_METRES else "m"


def _spheroid(common: Common) -> Spheroid | None:
    return Spheroid(common.semi_major, common.semi_minor) if common.geographic else None
