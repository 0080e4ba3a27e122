"""Reduced photo coordinates: mm from the principal point, y up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.models import attitude_matrices, complete_positions, known_cameras, known_points
from photogram.formats.project import Project
from photogram.formats.self_check import agreement
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.directions import image_directions
from photogram.words import Phrase, option_sd, phrase

BETTER = 3.0  # Smallest ratio of misfits for which rotations are transposed
LEAST, MOST = 2.0, 3000.0  # Smallest and largest principal distance of cameras, millimetres
NOMINAL = 100.0
"""Principal distance in millimetres for an unknown pixel size; it does not affect the rays."""
HOLDS = frozenset({"names", "shared-cameras", "control"})
SIDE = -0.02  # Largest u3 of unit directions that a perspective camera can image


class ReducedBuilder(BlockBuilder):
    """A block of such files; `sd` are standard deviations of the user."""

    def __init__(self, path: Path, title: str, sd: Mapping[str, tuple[float, ...]]) -> None:
        super().__init__(path, title)
        self.sd = sd

    def principal_distance(self, c: float, place: Place) -> str:
        """Return the name of the camera of a principal distance in millimetres."""
        if not LEAST < abs(c) < MOST:
            raise place.error(phrase("reduced.distance", value=abs(c), low=LEAST, high=MOST))
        name = f"c {abs(c):.12g} mm"
        if name not in self.camera_rows:
            # Coordinates are in the positive plane, for which c of the model is negative.
            self.camera(Camera("perspective", {"c": -abs(c)}, name=name))
        return name

    def known_point(self, name: str, xyz: Floats, used: Bools, place: Place) -> None:
        """Add a control point with the coordinates in use, or a check point without such."""
        control = self.sd.get("control", (np.inf,))
        if used.any():
            self.control(name, np.where(used, xyz, np.nan), np.where(used, control, np.inf), place)
        else:
            sd = self.sd.get("check", control)
            self.check(name, xyz, np.where(np.isfinite(sd), sd, np.nan), place)

    def reduced_project(self, unit: str) -> Project:
        """Return the project; `unit` is the unit of the image file, for remarks."""
        if not self.image_keys:
            raise self.place.error(phrase("format.missing", what="image observations"))
        (photo, point), (x, y) = self.image_keys[0], self.image_xy[0]
        first = phrase("format.first-record", unit=unit, point=point, photo=photo, x=x, y=y)
        self.messages += [Message(first, self.path), Message(phrase("reduced.assumed"))]
        if self.controls and "control" not in self.sd:
            fields = {"number": self.controls, "option": option_sd("control")}
            self.lacks.append(Phrase("read.control", fields))
        return with_fitting_rotations(self.project())


def with_fitting_rotations(project: Project) -> Project:
    """Return a project with rotations transposed if rays then fit better."""
    block = project.block
    if not np.isfinite(block.photo_attitudes).all():
        return project
    as_read = _misfit(project)
    from photogram.network.attitudes import Attitudes

    matrices = Attitudes.of("omega_phi_kappa", block.photo_attitudes).matrices
    turned = Attitudes(matrices.transpose(0, 2, 1)).values("omega_phi_kappa")
    other = project.replace(block=block.replace(photo_attitudes=turned))
    transposed = _misfit(other)
    limit = 0.1 * float(np.median(block.camera_scales()))
    if min(as_read, transposed) > limit:
        raise InputError(phrase("reduced.rays", as_read=as_read, transposed=transposed), file=project.path)
    if transposed * BETTER < as_read:
        remark = Message(phrase("reduced.transposed"))
        return other.replace(messages=(*project.messages, remark))
    return project


def _misfit(project: Project) -> float:
    """Return the median residual of intersections; infinite behind photos."""
    loose = project.replace(
        block=project.block.replace(point_positions=np.full_like(project.starts, np.nan), point_sd=np.inf),
        starts=np.full_like(project.starts, np.nan),
    )
    found = agreement(loose.replace(starts=complete_positions(loose)))
    return found.median if found.images else 0.0


@dataclass(frozen=True)
class ReducedImages:
    """Contents of such files: cameras, image observations and poses."""

    distances: Floats  # Principal distance of each camera, millimetres
    names: list[str]  # Names of the cameras
    cameras: Indices  # (P,) camera of each photo
    rows: Indices  # Observations that a perspective camera can have
    xy: Floats  # (rows, 2) millimetres from the principal point, y up
    posed: Bools  # (P,) photos with a pose
    matrices: Floats  # (P, 3, 3) attitudes A, photo to object


def reduced_images(project: Project, digits: int | None = None) -> ReducedImages:
    """Return the images reduced to a camera without distortion."""
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
        known_poses(block),
        attitude_matrices(block),
    )


def given_control(project: Project) -> dict[str, tuple[Floats, Bools]]:
    """Return control and check points, and their fixed or weighted coordinates."""
    known = known_points(project)
    held = np.isfinite(known.sd) & ~known.checks[:, np.newaxis]
    names = [project.block.point_ids[row] for row in known.rows]
    return dict(zip(names, zip(known.positions, held, strict=True), strict=True))


def lost_of_reduced(project: Project, reduced: ReducedImages) -> list[Phrase]:
    """Return images and principal distances that files of reduced coordinates cannot contain."""
    found = []
    if any(camera.unit == "px" for camera in known_cameras(project.block)[0]) and None in project.pixel_mm:
        found.append(phrase("lost.nominal-distance", distance=NOMINAL))
    if lost := len(project.block.image_xy) - len(reduced.rows):
        found.append(phrase("lost.images", n=lost))
    return found


def by_photo(project: Project, reduced: ReducedImages) -> Sequence[list[tuple[str, float, float]]]:
    """Return names and coordinates of the observations of each photo."""
    block = project.block
    found: list[list[tuple[str, float, float]]] = [[] for _ in block.photo_ids]
    photos = block.image_photos[reduced.rows].tolist()
    points = block.image_points[reduced.rows].tolist()
    for photo, point, (x, y) in zip(photos, points, reduced.xy.tolist(), strict=True):
        found[photo].append((block.point_ids[point], x, y))
    return found
