"""Conversion of blocks to GIANT files, and adjusted records."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import natural_order, rows_of_each
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.giant.common import Common
from photogram.giant.contents import (
    CHECK_POINT,
    Camera,
    Frame,
    GroundPoint,
    ImageFrame,
    frame_records,
    ground_records,
)
from photogram.giant.fields import printed_order
from photogram.giant.files import written
from photogram.messages import Message
from photogram.network.block import Block, checked, of_images_alone
from photogram.network.refraction import Refraction, metres_per_unit
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result
    from photogram.giant import Project

Triple = tuple[float, float, float]


def block_files(
    block: Block, common: Common | None
) -> tuple[Common, list[Camera], list[Frame], list[ImageFrame], list[GroundPoint], list[Message]]:
    """Return the five files of a block; see :meth:`Project.from_block`."""
    of_images_alone(checked(block), "GIANT files")
    common = dataclasses.replace(
        common or Common(error_propagation=True),
        title=block.title[:80],
        geographic=block.geographic,
        photo_to_ground=block.photo_to_ground,
        strip="",
    )
    messages = _write_refraction(common, block)
    stations, moved = _stations(block)
    messages += moved
    if block.spheroid is not None:
        common.semi_major, common.semi_minor = round(block.spheroid.a, 2), round(block.spheroid.b, 2)
        if (common.semi_major, common.semi_minor) != (block.spheroid.a, block.spheroid.b):
            messages.append(Message.of("giant.rounded-axes"))
    of_photos = block.known_distances("GIANT files").tolist()
    distances = dict.fromkeys(of_photos)
    names = {distance: f"CAMERA{number}" for number, distance in enumerate(distances, 1)}
    cameras = [Camera(name, distance) for distance, name in names.items()]
    position_sd = _weights("the position of photo", block.photo_ids, block.photo_position_sd)
    attitude_sd = _weights("the attitude of photo", block.photo_ids, block.photo_attitude_sd)
    columns = map(_triples, (stations[0], _turns(stations[1]), position_sd, attitude_sd))
    frames = [*map(Frame, block.photo_ids, *columns)]
    images = _images(block, [names[distance] for distance in of_photos])
    return common, cameras, frames, images, _ground(block), messages


def _write_refraction(common: Common, block: Block) -> list[Message]:
    """Write the refraction of a block to COMMON; report unsupported parts."""
    refraction = block.refraction or Refraction()
    common.air_refraction, common.water_refraction = refraction.air is not None, refraction.water is not None
    if refraction.water:
        common.water_level = metres_per_unit(block.linear_unit) * refraction.water_level
    said = Refraction(
        "giant" if refraction.air else None, "giant" if refraction.water else None, refraction.water_level
    )
    messages = []
    unit = block.linear_unit
    if refraction.phrase(unit) != said.phrase(unit):
        messages.append(
            Message.of("giant.refraction", given=refraction.phrase(unit), written=said.phrase(unit))
        )
    if block.refraction and not block.geographic and block.linear_unit != "m":
        messages.append(Message.of("giant.refraction-unit", unit=block.linear_unit))
    return messages


def _stations(block: Block) -> tuple[tuple[Floats, Floats], list[Message]]:
    """Return positions and attitudes for FRAMES, observed if weighted."""
    stations, left = [], False
    for initial, observed, sd in (
        (block.photo_positions, block.photo_positions_observed, block.photo_position_sd),
        (block.photo_attitudes, block.photo_attitudes_observed, block.photo_attitude_sd),
    ):
        weighted = np.isfinite(sd)
        values = initial if observed is None else np.where(weighted, observed, initial)
        left |= bool((values != initial).any())
        stations.append(values)
    return (stations[0], stations[1]), [Message.of("giant.one-set")] if left else []


def _images(block: Block, cameras: list[str]) -> list[ImageFrame]:
    frames = []
    images = rows_of_each(block.image_photos, len(block.photo_ids))
    for name, camera, rows in zip(block.photo_ids, cameras, images, strict=True):
        sd = block.image_sd[rows]
        if (sd != sd[:1]).any():
            raise InputError(phrase("giant.image-sd", photo=name))
        points = [block.point_ids[point] for point in block.image_points[rows].tolist()]
        x_sd, y_sd = sd[0].tolist() if len(sd) else (0.0, 0.0)
        frames.append(ImageFrame(name, points, block.image_xy[rows], sd=(x_sd, y_sd), camera=camera))
    return frames


def _ground(block: Block) -> list[GroundPoint]:
    held = np.isfinite(block.point_sd)
    sd = np.where(held, _weights("point", block.point_ids, block.point_sd), 0.0)
    codes = (~held) @ np.array([1, 2, 4])
    rows = np.flatnonzero(np.isfinite(block.point_positions).any(axis=1))
    names = [block.point_ids[row] for row in rows.tolist()]
    columns = _triples(block.point_positions[rows]), _triples(sd[rows]), codes[rows].tolist()
    return [*map(GroundPoint, names, *columns)]


def _weights(what: str, names: list[str], sd: Floats) -> Floats:
    """Return standard deviations, 0 for infinite ones; reject fixed values."""
    fixed = (sd == 0).any(axis=1)
    if fixed.any():
        name = names[int(fixed.argmax())]
        raise InputError(phrase("giant.fixed", subject=what, name=name))
    return np.where(np.isinf(sd), 0.0, sd)


def _turns(attitudes: Floats) -> Floats:
    """Convert angles to -180 to 180 degrees, kappa to 0 to 360."""
    omega_phi = np.remainder(attitudes[:, :2] + math.pi, 2 * math.pi) - math.pi
    return np.column_stack([omega_phi, np.remainder(attitudes[:, 2], 2 * math.pi)])


def _triples(values: Floats) -> list[Triple]:
    return [*zip(*values.T.tolist(), strict=True)]


def adjusted_frames(project: Project, block: Block, positions: Floats, attitudes: Floats) -> list[Frame]:
    """Return stations for units 8 and 20: adjusted values (P, 3), input sd."""
    stations = zip(_triples(positions), _triples(_turns(attitudes)), strict=True)
    adjusted = dict(zip(block.photo_ids, stations, strict=True))
    own = {frame.name: (frame.position, frame.attitude) for frame in project.frames} | adjusted
    return [
        dataclasses.replace(frame, position=own[frame.name][0], attitude=own[frame.name][1])
        for frame in project.frames
    ]


def adjusted_ground(
    project: Project, block: Block, positions: Floats, *, as_published: bool = False
) -> list[GroundPoint]:
    """Return the points for unit 9: all on two or more photographs.

    Control has its standard deviations and type code. Pass points get the type code 7, so that the file can
    be read as GROUND without turning them into control. Points are sorted, P9 before P10, unless COMMON
    (column 13) forbids it. `as_published` sorts right-justified names as the 1987 program did.
    """
    control = {point.name: point for point in project.ground}
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    rows = np.flatnonzero((rays >= 2) & np.isfinite(positions).all(axis=1)).tolist()
    if project.common.sort_points:
        key: Callable[[str], tuple[int, str] | list[tuple[int, str]]]
        key = printed_order if as_published else natural_order
        rows.sort(key=lambda row: key(block.point_ids[row]))
    names = [block.point_ids[row] for row in rows]
    origin = (0.0, 0.0, 0.0)
    points = [control.get(name) or GroundPoint(name, origin, type_code=CHECK_POINT) for name in names]
    places = zip(points, _triples(positions[rows]), strict=True)
    return [dataclasses.replace(point, position=position) for point, position in places]


def adjusted_records(
    project: Project, block: Block, result: Result, *, as_published: bool = False
) -> dict[str, list[str]]:
    """Return the records of the output files by name (GIANT guide, section II.A).

    RESTART (unit 20) is omitted only if stations diverged beyond its columns. FRAMES (unit 8) and GROUND
    (unit 9) are the result of a converged adjustment, unless COMMON forbids saving.
    """
    geographic = project.common.geographic
    frames = adjusted_frames(project, block, result.photo_positions, result.photo_attitudes)
    records = {}
    try:
        records["RESTART"] = written("RESTART", lambda: frame_records(frames, geographic))
    except InputError:
        if result.converged:
            raise
    if result.converged and project.common.save_stations:
        records["FRAMES"] = records["RESTART"]
    if result.converged and project.common.save_points:
        ground = adjusted_ground(project, block, result.point_positions, as_published=as_published)
        records["GROUND"] = written("GROUND", lambda: ground_records(ground, geographic))
    return records
