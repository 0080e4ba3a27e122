"""Conversion of projects to coordinates of a format: pixels, topocentric."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.models import attitude_matrices, intersected, known_cameras
from photogram.formats.project import Frame, Project, Size
from photogram.network.attitudes import angles_form, known_angles
from photogram.network.block import Block, refuse_passages, refuse_trajectories
from photogram.network.cameras import Camera
from photogram.network.geometry import (
    Spheroid,
    geocentric_to_geographic,
    geographic_to_geocentric,
    lengths_of_units,
    local_frames,
)
from photogram.network.motion import scanners
from photogram.words import Phrase, phrase

NOMINAL_MM = 0.01  # Side of a pixel (mm) of unknown size; it does not affect the rays
ROUND = 100  # Pixels: rounding of unknown widths and heights
ROUND_ORIGIN = 1e-4  # Degrees to which the origin is rounded; its height is 0


def in_pixels(project: Project) -> Project:
    """Return a project with the same rays and image coordinates in pixels.

    Millimetres are divided by the size of a pixel, or a nominal one. Negative planes are rotated by 180
    degrees into positive ones. Cameras without image size get one that contains all observations, if
    coordinates do not count from corners. Rolling shutters are omitted, as their rows count in the old
    coordinates.
    """
    block = project.block
    if (strips := np.flatnonzero(scanners(block))).size:
        raise InputError(phrase("format.scanner", photo=block.photo_ids[int(strips[0])]))
    given = block.image_unit == "px"
    if given and not _unsized(project):
        return project
    cameras, which = known_cameras(block)
    of_images = np.asarray(which, dtype=np.int64)[block.image_photos]
    none = (None,) * len(cameras)
    pixels = [each or (None if given else NOMINAL_MM) for each in project.pixel_mm or none]
    xy, sd = block.image_xy.copy(), block.image_sd.copy()
    made, sizes = [], []
    for row, (camera, pixel, size) in enumerate(zip(cameras, pixels, project.sizes or none, strict=True)):
        own = of_images == row
        scale = 1.0 if given or pixel is None else 1.0 / pixel
        negative = camera.model == "perspective" and camera.parameters["c"] > 0
        xy[own] *= -scale if negative else scale
        sd[own] *= scale
        made.append(_camera(camera, scale, negative))
        sizes.append(_size(camera, xy[own]) if size is None and _is_free(camera) else size)
    return project.replace(
        block=block.replace(
            cameras=made,
            photo_cameras=which,
            principal_distances=None,
            image_xy=xy,
            image_sd=sd,
            timed=(),
        ),
        sizes=tuple(sizes),
        pixel_mm=tuple(pixels),
    )


def nominal_pixels(project: Project) -> list[Phrase]:
    """Return remarks on nominal sizes of pixels and images."""
    nominal = project.block.image_unit == "mm" and None in (project.pixel_mm or (None,))
    found = [phrase("lost.nominal-pixels", size=NOMINAL_MM)] if nominal else []
    return found + ([phrase("lost.image-size")] if _unsized(project) else [])


def _unsized(project: Project) -> bool:
    """Return whether a camera without image size does not need one."""
    cameras, _ = known_cameras(project.block)
    sizes = project.sizes or (None,) * len(cameras)
    return any(size is None and _is_free(each) for each, size in zip(cameras, sizes, strict=True))


def _is_free(camera: Camera) -> bool:
    """Return whether coordinates do not depend on the image size."""
    return camera.image_y == "up" or camera.unit == "mm"


def _camera(camera: Camera, scale: float, negative: bool) -> Camera:
    powers = camera.powers
    factors = {name: (-1.0 if negative else 1.0) * scale ** powers[name] for name in camera.names}
    covariance = None
    if camera.covariance is not None:
        names, matrix = camera.covariance
        own = np.array([factors[name] for name in names])
        covariance = (names, np.asarray(matrix) * np.outer(own, own))
    deviations = zip(camera.names, camera.deviations.tolist(), strict=True)
    return camera.replace(
        parameters={name: value * factors[name] for name, value in camera.parameters.items()},
        sd={name: own * abs(factors[name]) for name, own in deviations},
        covariance=covariance,
        unit="px",
    )


def _size(camera: Camera, xy: Floats) -> Size:
    """Return an image size that contains all observations."""
    reach = np.abs(xy).max(axis=0, initial=1.0) * (2 if camera.image_y == "up" else 1)
    width, height = (ROUND * math.ceil(each / ROUND) for each in reach.tolist())
    return width, height


def in_topocentric(project: Project) -> Project:
    """Return a geographic project in a topocentric frame at its median photo.

    The rays are the same. Standard deviations refer to local axes, which differ from the axes of the frame by
    the angle between the verticals. The unknown components of partly known points are intersected from their
    rays. Other observations than image observations are omitted.
    """
    block = project.block
    if block.spheroid is None:
        return project
    refuse_trajectories(block, "a topocentric frame")
    refuse_passages(block, "a topocentric frame")
    origin, spheroid = _origin(block), block.spheroid
    axes = local_frames(origin)[0]
    middle = geographic_to_geocentric(origin, spheroid)[0]

    def carried(positions: Floats) -> Floats:
        found: Floats = (geographic_to_geocentric(positions, spheroid) - middle) @ axes.T
        return found

    def turned(positions: Floats, attitudes: Floats) -> Floats:
        local = axes @ local_frames(positions).transpose(0, 2, 1)
        matrices = local @ attitude_matrices(block.replace(photo_attitudes=attitudes))
        return known_angles(angles_form(block.photo_to_ground), matrices)

    photos = block.photo_positions
    observed, angles = block.photo_positions_observed, block.photo_attitudes_observed
    made = block.replace(
        spheroid=None,
        observations=(),
        photo_positions=carried(photos),
        photo_attitudes=turned(photos, block.photo_attitudes),
        photo_positions_observed=None if observed is None else carried(observed),
        photo_attitudes_observed=None if angles is None else turned(photos, angles),
        photo_position_sd=block.photo_position_sd * lengths_of_units(photos, spheroid),
        point_positions=np.full_like(block.point_positions, np.nan),
        point_sd=np.full_like(block.point_sd, np.inf),
    )
    degrees = (float(np.degrees(origin[0, 1])), float(np.degrees(origin[0, 0])), 0.0)
    known = spheroid == Spheroid.wgs84() and block.linear_unit == "m"
    frame = Frame("topocentric", origin=degrees) if known else Frame()
    rectangular = project.replace(block=made.replace(frame=frame), frame=frame)
    given = np.isfinite(block.point_positions)
    some = np.flatnonzero(given.any(axis=1))
    whole = block.point_positions[some]
    partly = np.flatnonzero(~given[some].all(axis=1))
    if len(partly):
        meet = intersected(rectangular, some[partly]) @ axes + middle
        near = geocentric_to_geographic(np.where(np.isfinite(meet), meet, middle), spheroid)
        whole[partly] = np.where(given[some[partly]], whole[partly], near)
    positions, sd = made.point_positions.copy(), made.point_sd.copy()
    positions[some] = np.where(given[some], carried(whole), np.nan)
    sd[some] = block.point_sd[some] * lengths_of_units(whole, spheroid)
    starts = np.array(project.starts)
    there = np.isfinite(starts).all(axis=1)
    starts[there] = carried(starts[there])
    starts[~there] = np.nan
    block_made = rectangular.block.replace(point_positions=positions, point_sd=sd)
    return rectangular.replace(block=block_made, starts=starts)


def topocentric_remarks(project: Project) -> list[Phrase | str]:
    """Return remarks on a geographic project in rectangular coordinates."""
    block = project.block
    if block.spheroid is None:
        return []
    origin = _origin(block)
    up = local_frames(np.vstack([origin, block.photo_positions]))[:, 2]
    angle = math.degrees(float(np.arccos(np.clip(up[1:] @ up[0], -1, 1)).max())) * 60
    longitude, latitude = np.degrees(origin[0, :2])
    place = {"latitude": float(latitude), "longitude": float(longitude)}
    ellipsoid = {"a": block.spheroid.a, "b": block.spheroid.b}
    found: list[Phrase | str] = [
        phrase("lost.geographic", unit=block.linear_unit, **place, **ellipsoid, angle=angle)
    ]
    if n := len(block.observations):
        found.append(phrase("lost.observations", n=n, names=["images"]))
    return found


def _origin(block: Block) -> Floats:
    """Return (1, 3) the median position of the photos, on the ellipsoid."""
    middle = np.degrees(np.median(block.photo_positions[:, :2], axis=0))
    return np.array([[*np.radians(np.round(middle / ROUND_ORIGIN) * ROUND_ORIGIN), 0.0]])
