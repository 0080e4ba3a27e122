"""Blocks of reduced photo coordinates: millimetres from the principal point, free of distortion, y up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.formats.format import Wishes
from photogram.formats.intersection import complete_positions
from photogram.formats.project import Project, assembled
from photogram.formats.self_check import agreement
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.cameras import Camera

__all__ = ["Reduced", "project_of", "with_fitting_rotations"]

BETTER = 3.0
"""How much better rotations must fit transposed to be taken so."""
LEAST, MOST = 2.0, 3000.0
"""Millimetres between which principal distances of cameras lie."""


@dataclass
class Reduced:
    """What the files of such a block hold.

    Attributes
    ----------
    photos
        Camera of each photo by its name.
    images
        Photo, point, x, y in millimetres.
    poses
        Centre and attitude A of photos, photo to object.
    control
        Position of control points, and which coordinates are held; of check points none.
    cameras
        By name.
    """

    photos: dict[str, str] = field(default_factory=dict)
    images: list[tuple[str, str, float, float]] = field(default_factory=list)
    poses: dict[str, tuple[Floats, Floats]] = field(default_factory=dict)
    control: dict[str, tuple[Floats, Bools]] = field(default_factory=dict)
    cameras: dict[str, Camera] = field(default_factory=dict)

    def principal_distance(self, c: float, place: Place) -> str:
        """Return the name of the camera of a principal distance in millimetres."""
        if not LEAST < abs(c) < MOST:
            raise place.error(f"a principal distance of {abs(c):g} mm: is the unit another one?")
        name = f"c {abs(c):.12g} mm"
        # Coordinates are those of the positive plane: the model has c negative there.
        self.cameras.setdefault(name, Camera("perspective", {"c": -abs(c)}, name=name))
        return name


def project_of(
    found: Reduced, path: Path, title: str, wishes: Wishes, messages: Sequence[Message]
) -> Project:
    """Return the project.

    Raises
    ------
    InputError
        Photos that are there twice, control without standard deviations.
    """
    photos = list(found.photos)
    rows = {name: row for row, name in enumerate(photos)}
    points = list(dict.fromkeys([*(each[1] for each in found.images), *found.control]))
    places = {name: row for row, name in enumerate(points)}
    unknown = np.full((len(photos), 3), np.nan)
    centres, matrices = unknown.copy(), np.full((len(photos), 3, 3), np.nan)
    for name, (centre, matrix) in found.poses.items():
        if name in rows:
            centres[rows[name]], matrices[rows[name]] = centre, matrix
    positions, sd = np.full((len(points), 3), np.nan), np.full((len(points), 3), np.inf)
    lacks = []
    held = [name for name, (_, used) in found.control.items() if used.any()]
    if held and "control" not in wishes.sd:
        lacks.append(
            f"no standard deviations of control: {len(held)} points are only compared (--sd control=..)"
        )
    check_sd = np.full_like(positions, np.nan)
    for name, (position, used) in found.control.items():
        # What is not held of a control point is not known; a check point is known altogether.
        positions[places[name]] = np.where(used | ~used.any(), position, np.nan)
        if used.any() and "control" in wishes.sd:
            sd[places[name]] = np.where(used, wishes.sd["control"], np.inf)
        elif not used.any():
            check_sd[places[name]] = wishes.sd.get("check", wishes.sd.get("control", np.nan))
    cameras = {camera: row for row, camera in enumerate(found.cameras)}
    return assembled(
        path=path,
        title=title,
        cameras=list(found.cameras.values()),
        sizes=[None] * len(cameras),
        photo_ids=photos,
        photo_cameras=[cameras[camera] for camera in found.photos.values()],
        centres=centres,
        matrices=matrices,
        point_ids=points,
        starts=positions.copy(),
        point_positions=positions,
        point_sd=sd,
        point_check_sd=check_sd,
        image_photos=np.array([rows[each[0]] for each in found.images], dtype=np.int64),
        image_points=np.array([places[each[1]] for each in found.images], dtype=np.int64),
        image_xy=np.array([each[2:] for each in found.images], dtype=float).reshape(-1, 2),
        lacks=lacks,
        messages=[
            *messages,
            Message(
                "coordinates are taken as reduced and the object space as cartesian, as such files mean them"
            ),
        ],
    )


def with_fitting_rotations(project: Project) -> Project:
    """Return a project whose rotations are transposed where rays meet far better then.

    Raises
    ------
    InputError
        They meet neither way.
    """
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
        raise InputError(
            f"rays meet neither with the rotations as they stand nor transposed: residuals of"
            f" {as_read:.3g} and"
            f" {transposed:.3g} mm",
            file=project.path,
        )
    if transposed * BETTER < as_read:
        remark = Message("rotations were read transposed: so rays meet, and as they stand they do not")
        return other.replace(messages=(*project.messages, remark))
    return project


def _misfit(project: Project) -> float:
    """Return the median residual with points where rays meet; infinite where they meet behind photos."""
    loose = project.replace(
        block=project.block.replace(point_positions=np.full_like(project.starts, np.nan), point_sd=np.inf),
        starts=np.full_like(project.starts, np.nan),
    )
    found = agreement(loose.replace(starts=complete_positions(loose)))
    return found.median if found.images else 0.0
