"""Check of positions and observations against reader conventions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.images import Y_DOWN
from photogram.formats.models import attitude_matrices, known_cameras
from photogram.formats.project import Project
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.cameras import Camera, images_of
from photogram.network.film_reduction import camera_images, camera_unit
from photogram.network.motion import given_poses, on_shared, timed_images
from photogram.network.moving_photos import Timed
from photogram.network.trajectories import Trajectory
from photogram.words import phrase

MOST = 20_000  # Largest number of observations used
GROSS, PART = 50.0, 0.1  # Pixels, and part of the width: median residuals that exceed both are doubtful
BETTER = 10.0  # Smallest improvement of the residual for which another convention is reported
NEARLY_ALL = 0.9


@dataclass(frozen=True)
class Agreement:
    """Agreement of observations with positions of a file."""

    median: float  # Median length of residuals, in the unit of the images; NaN without any
    behind: float  # Fraction of points behind their photos
    images: int  # Number of observations used


@dataclass(frozen=True)
class _Sample:
    cameras: list[Camera]
    which: Indices
    vectors: Floats
    matrices: Floats
    xy: Floats

    def residuals(self) -> Floats:
        directions = np.einsum("nij,nj->ni", self.matrices, self.vectors)
        with np.errstate(all="ignore"):
            images = images_of(self.cameras, self.which, directions)
        lengths = np.linalg.norm(images - self.xy, axis=1)
        found: Floats = np.where(np.isfinite(lengths) & (directions[:, 2] < 0), lengths, np.inf)
        return found

    def median(self) -> float:
        return float(np.median(self.residuals())) if len(self.xy) else np.nan


def _sample(project: Project) -> _Sample:
    block = project.block
    points, matrices = project.positions(), attitude_matrices(block)
    poses = np.column_stack([matrices.reshape(-1, 9), block.photo_positions])
    # The pose of a photo on a trajectory is only approximate.
    posed: Bools = np.asarray(np.isfinite(poses).all(axis=1)) | on_shared(block)
    placed: Bools = np.asarray(np.isfinite(points).all(axis=1))
    good = posed[block.image_photos] & placed[block.image_points]
    if block.geographic:
        good = np.zeros_like(good)
    rows = np.flatnonzero(good)
    rows = rows[:: max(1, len(rows) // MOST)]
    photos = block.image_photos[rows]
    cameras, photo_cameras = known_cameras(block)
    sampled = np.full(len(block.image_xy), -1)
    sampled[rows] = np.arange(len(rows))
    places, axes, xy = block.photo_positions[photos], matrices[photos], camera_images(block)[rows]
    for own, trajectory, _, images in timed_images(block):
        of_photo = sampled[images][sampled[images] >= 0]
        if len(of_photo):
            places[of_photo], axes[of_photo], xy[of_photo] = _moving(own, trajectory, xy[of_photo])
    return _Sample(
        cameras,
        np.asarray(photo_cameras, dtype=np.int64)[photos],
        points[block.image_points[rows]] - places,
        axes.transpose(0, 2, 1),
        xy,
    )


def _moving(own: Timed, trajectory: Trajectory, xy: Floats) -> tuple[Floats, Floats, Floats]:
    """Return poses of a photo at image times, and focal coordinates."""
    time, since, there = own.images(xy)
    scale = 1.0 if own.readout is None else float(own.readout.position[0])
    offset = 0.0 if own.offset is None else float(own.offset.position[0])
    places, axes = given_poses(trajectory, np.clip(time + offset + scale * since, *trajectory.reach))
    if own.sensor is not None:
        places, axes = places + axes @ own.sensor.position, axes @ own.sensor.attitude
    return places, axes, there


def agreement(project: Project) -> Agreement:
    """Return the agreement of observations with positions of a file."""
    sample = _sample(project)
    if not len(sample.xy):
        return Agreement(np.nan, 0.0, 0)
    depths = np.einsum("nij,nj->ni", sample.matrices, sample.vectors)[:, 2]
    return Agreement(sample.median(), float(np.mean(depths > 0)), len(sample.xy))


def doubts(project: Project) -> list[Message]:
    """Return messages on disagreement, with a convention that fits.

    The project is not changed.
    """
    found = agreement(project)
    if not found.images:
        return []
    messages = []
    if found.behind > NEARLY_ALL:
        messages.append(Message(phrase("agreement.mirrored", percent=100 * found.behind)))
    elif found.behind > 0:
        messages.append(Message(phrase("agreement.behind", percent=100 * found.behind)))
    widths = [size[0] for size in project.sizes if size is not None]
    scale = float(np.median(project.block.camera_scales()))
    limit = max(GROSS, PART * min(widths)) if widths and camera_unit(project.block) == "px" else PART * scale
    if found.median > limit:
        sample = _sample(project)
        helps = [name for name, change in _OTHERS.items() if change(sample).median() * BETTER < found.median]
        code = "agreement.convention" if helps else "agreement.residuals"
        fields = {"median": found.median, "unit": camera_unit(project.block), "names": helps}
        messages.append(Message.of(code, **fields, factor=BETTER))
    return messages


def _mirrored(axis: int) -> Callable[[_Sample], _Sample]:
    """Return a change: image coordinates reversed about the principal point."""

    def change(sample: _Sample) -> _Sample:
        middle = images_of(sample.cameras, sample.which, np.tile([0.0, 0.0, -1.0], (len(sample.xy), 1)))
        xy = sample.xy.copy()
        xy[:, axis] = 2 * middle[:, axis] - xy[:, axis]
        return replace(sample, xy=xy)

    return change


_OTHERS: dict[str, Callable[[_Sample], _Sample]] = {
    "y (rows) in the opposite direction": _mirrored(1),
    "x (columns) in the opposite direction": _mirrored(0),
    "transposed rotations": lambda sample: replace(sample, matrices=sample.matrices.transpose(0, 2, 1)),
    "photos in the opposite direction": lambda sample: replace(sample, matrices=Y_DOWN @ sample.matrices),
}
