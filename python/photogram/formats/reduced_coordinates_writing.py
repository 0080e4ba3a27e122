"""Photo coordinates as PATB and BINGO have them: millimetres from the principal point, free of distortion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.block_contents import correlated_control, posed
from photogram.formats.plain.writing import attitude_matrices, known_cameras
from photogram.formats.project import Project
from photogram.lazy_dataclasses import dataclass
from photogram.network.directions import image_directions
from photogram.network.observations import Control

__all__ = ["ReducedImages", "by_photo", "given_control", "lost_of_reduced", "reduced_images"]

NOMINAL = 100.0
"""Principal distance in millimetres where nothing says how large pixels are: rays are the same."""
SIDE = -0.02
"""u3 of unit directions beyond which a perspective camera has no picture."""


@dataclass(frozen=True)
class ReducedImages:
    """What such files say of images.

    Attributes
    ----------
    distances
        Principal distance of each camera, millimetres.
    names
        Of the cameras.
    cameras
        (P,) which one each photo has.
    rows
        Images that a perspective camera has.
    xy
        (rows, 2) millimetres from the principal point, y up.
    posed
        (P,) photos with a pose.
    matrices
        (P, 3, 3) attitudes A, photo to object.
    """

    distances: Floats
    names: list[str]
    cameras: Indices
    rows: Indices
    xy: Floats
    posed: Bools
    matrices: Floats


def reduced_images(project: Project, digits: int | None = None) -> ReducedImages:
    """Return the images of a project as a perspective camera without distortion would have seen them.

    Parameters
    ----------
    project
        The project.
    digits
        To which principal distances are rounded: coordinates are those of the rounded ones.
    """
    block = project.block
    cameras, which = known_cameras(block)
    pixels = [*project.pixel_mm, *(None for _ in cameras[len(project.pixel_mm) :])]
    distances = np.array(
        [
            each.scale if each.unit == "mm" else NOMINAL if pixel is None else each.scale * pixel
            for each, pixel in zip(cameras, pixels, strict=True)
        ]
    )
    if digits is not None:
        distances = distances.round(digits)
    directions = image_directions(block)
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero(directions[:, 2] < SIDE)
    of_photos = np.asarray(which, dtype=np.int64)
    own = directions[rows]
    scales = distances[of_photos[block.image_photos[rows]], np.newaxis]
    return ReducedImages(
        distances,
        [each.name for each in cameras],
        of_photos,
        rows,
        scales * own[:, :2] / -own[:, 2:],
        posed(block),
        attitude_matrices(block),
    )


def given_control(project: Project) -> dict[str, tuple[Floats, Bools]]:
    """Return positions of control and check points, and which coordinates are held; none are of checks."""
    block = project.block
    full = correlated_control(block)
    found = {}
    for row, name in enumerate(block.point_ids):
        position, held = block.point_positions[row], np.isfinite(block.point_sd[row])
        if name in full:
            position, held = full[name].observed, np.ones(3, dtype=bool)
        if np.isfinite(position).any():
            found[name] = np.asarray(position), held
    return found


def lost_of_reduced(project: Project, reduced: ReducedImages) -> list[str]:
    """Return what has no place in files of reduced coordinates."""
    block = project.block
    found = [
        "standard deviations of images, poses and control",
        "positions of points that are no control, the frame and its unit",
    ]
    cameras, _ = known_cameras(block)
    if any(each.model != "perspective" for each in cameras):
        found.append(
            "lenses: coordinates are those of cameras without distortion, which is exact for the geometry"
        )
    if any(each.unit == "px" for each in cameras) and None in project.pixel_mm:
        found.append(f"pixels whose size is not known: the principal distance is {NOMINAL:g} mm for them")
    if lost := len(block.image_xy) - len(reduced.rows):
        found.append(f"{lost} images that a perspective camera does not have")
    if not reduced.posed.all():
        found.append(f"that {np.count_nonzero(~reduced.posed)} photos have no pose or only part of one")
    others = [each for each in block.observations if not isinstance(each, Control)]
    if len(others) < len(block.observations):
        found.append("correlations between coordinates of control")
    if others:
        found.append(f"{len(others)} observations beside images and control")
    if block.mounts:
        found.append("rigs: photos have their poses")
    return found


def by_photo(project: Project, reduced: ReducedImages) -> Sequence[list[tuple[str, float, float]]]:
    """Return name and coordinates of the images of each photo."""
    block = project.block
    found: list[list[tuple[str, float, float]]] = [[] for _ in block.photo_ids]
    photos = block.image_photos[reduced.rows].tolist()
    points = block.image_points[reduced.rows].tolist()
    for photo, point, (x, y) in zip(photos, points, reduced.xy.tolist(), strict=True):
        found[photo].append((block.point_ids[point], x, y))
    return found
