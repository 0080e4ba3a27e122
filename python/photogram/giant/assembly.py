"""Conversion of the five files to a block, with remarks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import by_key
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.giant.common import Common
from photogram.giant.contents import ATTITUDE_SD, IMAGE_SD, Frame, GroundPoint, ImageFrame
from photogram.giant.limits import Limits, allowed_images, check_bandwidth, check_count
from photogram.giant.records import error_at, message_at
from photogram.messages import Message
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.geometry import Spheroid
from photogram.network.refraction import Refraction, metres_per_unit
from photogram.network.structuring import FEWEST_TIES, structure, ties
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.giant import Project

EARTH_RADIUS = 6.371e6  # Metres
FALSE_ORIGIN = 1e5  # Map projections have a false origin farther away; local systems seldom do
UPRIGHT = 0.97  # Smallest vertical component of the axis of a near-vertical photo


def remarks(block: Block, frames: list[Frame]) -> list[Message]:
    """Return remarks on weak stations, similar names, and map coordinates."""
    messages = []
    for frame, count in zip(frames, ties(block).tolist(), strict=True):
        loose = not (all(frame.position_sd) and all(frame.attitude_sd))
        if count < FEWEST_TIES and loose:
            messages.append(message_at(frame.record, phrase("giant.ties", frame=frame.name, n=count)))
    return messages + _alike(block) + _map_projection(block)


def plain_name(name: str) -> str:
    """Return a name in small letters without blanks."""
    return "".join(name.split()).casefold()


def _alike(block: Block) -> list[Message]:
    """Report photos and points whose names differ only by case or inner blanks.

    The program compared names exactly (2A4), so these are different names. This is rarely intended.
    """
    messages = []
    for what, names in (("photos", block.photo_ids), ("points", block.point_ids)):
        plain = [*map(plain_name, names)]
        if len(set(plain)) == len(names):
            continue
        groups = by_key(zip(plain, names, strict=True))
        pairs = [" and ".join(map(repr, group)) for group in groups.values() if len(group) > 1]
        if pairs:
            messages.append(Message.of(f"giant.similar-{what}", names=pairs))
    return messages


def _map_projection(block: Block) -> list[Message]:
    """Report State Plane or UTM coordinates, which are recognised by their size.

    A level surface drops by d^2/2R at the distance d, unlike a map. From the height H this moves the image of
    a point at the radius r by H r^3 / 2 R c^2.
    """
    if block.geographic:
        return []
    east, north, height = np.median(np.abs(block.photo_positions), axis=0).tolist()
    vertical = np.abs(geometry.rotation_matrix(block.photo_attitudes)[:, 2, 2])
    if max(east, north) < max(FALSE_ORIGIN, 20 * height) or np.median(vertical) < UPRIGHT:
        return []
    known = block.point_positions[:, 2]
    ground = float(np.median(known[np.isfinite(known)])) if np.isfinite(known).any() else 0.0
    distances = block.known_distances("GIANT files")[block.image_photos]
    radii = np.hypot(block.image_xy[:, 0], block.image_xy[:, 1])
    shifts = abs(height - ground) * radii**3 / (2 * EARTH_RADIUS * distances**2)
    shift = float(np.quantile(shifts, 0.95))
    if shift < np.median(block.image_sd):
        return []
    return [Message.of("giant.map-projection", shift=1000 * shift)]


LONGEST_METRES = 1e7  # Largest semi-major axis in metres; in feet all are larger


def assemble(project: Project, limits: Limits | None = None) -> tuple[Block, list[Message]]:
    """Return the block of a project, and remarks on omitted and doubtful data.

    Photos are in the order of FRAMES, points in the order of their first image.
    """
    limits = limits or Limits()
    common, messages = project.common, list[Message]()
    control = sum(1 + point.repeats for point in project.ground)
    check_count("CAMERA STATIONS", len(project.frames), limits.stations, project.frames)
    check_count("GROUND CONTROL", control, limits.control, project.ground)
    # The guide lacks a message for N5; this one follows the others.
    check_count("CAMERA SYSTEMS", len(project.cameras), limits.cameras)
    photos = _photos(project, messages)
    if not photos:
        raise InputError(phrase("giant.no-frames"), file=project.directory)
    frames = [frame for frame, _ in photos]
    images = [image_frame for _, image_frame in photos]

    names = [name for each in images for name in each.points]
    index = {name: number for number, name in enumerate(dict.fromkeys(names))}
    image_points = np.array([index[name] for name in names])
    image_photos = np.repeat(np.arange(len(images)), [len(each.points) for each in images])
    check_count("IMAGE POINTS", len(index), limits.points)
    kept = _first_images(images, image_photos, image_points, messages)
    kept = kept[allowed_images(image_points[kept], list(index), limits, messages)]
    if limits.bandwidth is not None:
        structured = structure(image_photos[kept], image_points[kept])
        check_bandwidth(structured, frames, list(index), limits.bandwidth, common.intersection_only, messages)
    position, sd, check_sd = _control(project, index, messages)
    block = Block(
        photo_ids=[frame.name for frame in frames],
        photo_positions=_longitudes(np.array([frame.position for frame in frames]), common.geographic),
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
        point_check_sd=check_sd,
        spheroid=Spheroid(common.semi_major, common.semi_minor) if common.geographic else None,
        photo_to_ground=common.photo_to_ground,
        title=common.title,
        linear_unit=_linear_unit(common),
        refraction=job_refraction(common),
    )
    messages += remarks(block, frames)
    return block, messages


def job_refraction(common: Common, **changes: Any) -> Refraction | None:
    """Return the refraction of a job as in COMMON, with other fields of a :class:`Refraction`."""
    own = {
        "air": "giant" if common.air_refraction else None,
        "water": "giant" if common.water_refraction else None,
        "water_level": common.water_level / metres_per_unit(_linear_unit(common)),
        **changes,
    }
    if own["air"] is None and own["water"] is None:
        return None
    return Refraction(**own) if own["water"] is not None else Refraction(own["air"])


def _photos(project: Project, messages: list[Message]) -> list[tuple[Frame, ImageFrame]]:
    """Pair FRAMES with IMAGES; other images are skipped silently."""
    listed = {frame.name for frame in project.frames}
    measured: dict[str, ImageFrame] = {}
    for images in project.images:
        first = measured.setdefault(images.name, images)
        if first is not images and images.name in listed:
            raise error_at(images.record, phrase("giant.images-repeated", frame=images.name))
    photos = []
    for frame in project.frames:
        if frame.name in measured and measured[frame.name].points:
            photos.append((frame, measured[frame.name]))
        elif project.common.intersection_only:
            messages.append(message_at(frame.record, phrase("giant.frame-excluded", frame=frame.name)))
        else:
            hint = _lost_header(project.images, frame.name)
            raise error_at(frame.record, phrase("giant.no-images", frame=frame.name, hint=hint))
    return photos


def _lost_header(images: list[ImageFrame], name: str) -> Phrase | str:
    """Return a hint on a missing terminator if a point has a frame's name."""
    for frame in images:
        if name in frame.points:
            record = frame.point_record(frame.points.index(name))
            return phrase("giant.lost-header", frame=frame.name, record=record.number if record else "")
    return ""


def _principal_distances(project: Project, images: list[ImageFrame]) -> Floats:
    cameras = {camera.name: camera.principal_distance for camera in project.cameras}
    for each in images:
        if not each.principal_distance and each.camera not in cameras:
            names = [*map(repr, cameras)] or phrase("part.none")
            fields = {"frame": each.name, "camera": each.camera, "names": names}
            raise error_at(each.record, phrase("giant.unknown-camera", **fields))
    return np.array([each.principal_distance or cameras[each.camera] for each in images])


def _first_images(
    images: list[ImageFrame], image_photos: Indices, image_points: Indices, messages: list[Message]
) -> Indices:
    pairs = image_photos * (image_points.max() + 1) + image_points
    order = np.argsort(pairs, kind="stable")
    again = np.sort(order[1:][pairs[order[1:]] == pairs[order[:-1]]])
    starts = np.searchsorted(image_photos, np.arange(len(images)))
    for row in again.tolist():
        frame = images[image_photos[row]]
        at = row - starts[image_photos[row]]
        text = phrase("giant.image-repeated", point=frame.points[at], frame=frame.name)
        messages.append(message_at(frame.point_record(at), text))
    return np.delete(np.arange(len(pairs)), again)


def _control(
    project: Project, index: dict[str, int], messages: list[Message]
) -> tuple[Floats, Floats, Floats | None]:
    """Return positions and standard deviations of all points, from GROUND if present.

    The second standard deviations are for check points; None without check points.
    """
    position = np.full((len(index), 3), np.nan)
    sd, check_sd = np.full((len(index), 3), np.inf), None
    control: dict[int, GroundPoint] = {}
    placed: set[str] = set()
    is_complete = all(point.name in index for point in project.ground)
    alike = {} if is_complete else {plain_name(name): name for name in index}
    for point in project.ground:
        if point.name in placed:
            messages.append(message_at(point.record, phrase("giant.duplicate", point=point.name)))
            continue
        placed.add(point.name)
        row = index.get(point.name)
        if row is None:
            like = alike.get(plain_name(point.name))
            hint = phrase("giant.similar-name", name=like) if like else ""
            text = phrase("giant.ignored-control", point=point.name, hint=hint)
            messages.append(message_at(point.record, text))
            continue
        control[row] = point
    if control:
        rows = list(control)
        values = np.array([point.position for point in control.values()])
        held = np.array([point.held for point in control.values()])
        # Fields of unheld components may be empty: blanks or zero are not comparison values.
        position[rows] = np.where(held | (values != 0), values, np.nan)
        weights = _or_default([point.sd for point in control.values()], project.common.default_control_sd)
        sd[rows] = np.where(held, weights, np.inf)
        if not held.any(axis=1).all():
            # The default of COMMON applies to control, not to the accuracy of check points.
            own = np.array([point.sd for point in control.values()])
            check_sd = np.full_like(position, np.nan)
            check_sd[rows] = np.where(held.any(axis=1, keepdims=True) | (own <= 0), np.nan, own)
    if not np.isfinite(sd).any():
        record = next((point.record for point in project.ground if point.record), None)
        path = record.source.path if record else project.directory
        messages.append(Message.of("giant.no-control", path))
    return position, sd, check_sd


def _or_default(values: ArrayLike, default: ArrayLike) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    return np.where(array == 0, np.asarray(default, dtype=np.float64), array)


def _longitudes(positions: Floats, geographic: bool) -> Floats:
    """Convert longitudes of 0 to 360 degrees to -180 to 180, so that all files agree."""
    if geographic:
        longitude = positions[:, 0]
        positions[:, 0] = np.where(
            np.abs(longitude) > math.pi, longitude - np.copysign(2 * math.pi, longitude), longitude
        )
    return positions


def _linear_unit(common: Common) -> str:
    """Return the linear unit of a job, from the axes of its spheroid."""
    return "ft" if common.geographic and common.semi_major > LONGEST_METRES else "m"
