"""Directions of image rays, a block as straight rays, and the intersection of the rays of each point."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.arrays import rows_of_each
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.cameras import rays_of_row
from photogram.network.geometry import Cartesian, local_frames, photo_axes
from photogram.network.motion import focal_images, image_rows, kept_images, on_shared, scanners
from photogram.words import phrase

_SIDE = -0.02  # Maximum u3 of unit directions that are clearly in front of the camera
_SMALL = 1e-6  # Radians off the axis with negligible distortion


def image_directions(block: Block) -> Floats:
    """Return (m, 3) unit directions of the images of a block; NaN if undefined.

    The axes of a moving photo refer to the time of the image: x right, y up, z back. The camera looks along
    -z. Refraction is ignored.
    """
    cameras, photo_cameras = block.core_cameras()
    images = rows_of_each(photo_cameras[block.image_photos], len(cameras))
    directions, places = np.full((len(block.image_photos), 3), np.nan), focal_images(block)
    for row, own in zip(cameras, images, strict=True):
        directions[own] = rays_of_row(row, places[own])
    return directions


def seen_without_lenses(block: Block) -> tuple[Block, Bools]:
    """Convert a block to cameras without distortion; return also (m,) the images that it contains.

    Cameras are in the unit of the images. A block with principal distances is returned unchanged. If most
    directions are undefined (e.g. in another unit), lenses are ignored and cameras are linear. Otherwise
    images without a direction in front of the camera are removed. Scanner images are always removed, because
    they have varying poses. Trajectories are removed as well.
    """
    pictured: Bools = ~scanners(block)[block.image_photos]
    if not block.cameras or block.photo_cameras is None:
        plain = block.replace(timed=()) if block.timed else block
        return kept_images(plain, pictured) if not pictured.all() else plain, pictured
    directions = image_directions(block)
    seen = (directions[:, 2] < _SIDE) & pictured
    if 2 * np.count_nonzero(seen) < np.count_nonzero(pictured):
        # Tangents -u1/u3, -u2/u3 of cameras that have their scale near the axis everywhere.
        tangents, seen = np.empty_like(block.image_xy), pictured
        image_cameras = block.photo_cameras[block.image_photos]
        for row, camera in enumerate(block.cameras):
            middle, right, up = camera.project([[0.0, 0.0, -1.0], [_SMALL, 0.0, -1.0], [0.0, _SMALL, -1.0]])
            linear = np.column_stack([right - middle, up - middle]) / _SMALL
            if not abs(np.linalg.det(linear)) > 0:
                raise InputError(phrase("camera.no-scale", camera=camera.name))
            of_camera = image_cameras == row
            tangents[of_camera] = np.linalg.solve(linear, (block.image_xy[of_camera] - middle).T).T
    else:
        tangents = -directions[:, :2] / directions[:, 2:]
    scales = block.camera_scales()
    plain = block.replace(
        timed=(),
        cameras=(),
        photo_cameras=None,
        principal_distances=-scales,
        **image_rows(block, seen) | {"image_xy": (scales[block.image_photos, np.newaxis] * tangents)[seen]},
    )
    return plain, seen


def direction_deviations(block: Block) -> Floats:
    """Return (m,) standard deviations of directions, radians: image sd / principal distance."""
    deviations = np.sqrt((block.image_sd**2).mean(axis=1)) / block.camera_scales()[block.image_photos]
    return np.asarray(deviations)


PARALLEL = 1e-8  # Determinant of the mean normal matrix of parallel rays


SMALL_FRAME = 0.01  # Minimum radius of the image format, relative to the principal distance


@dataclass(frozen=True, eq=False)
class LocalAxes:
    """Metric axes of a block: its own if rectangular, else east, north, up at its centre."""

    block: Block
    origin: Floats
    frame: Floats

    @property
    def cartesian(self) -> Cartesian:
        return Cartesian(self.block.spheroid)

    def positions(self, positions: Floats) -> Floats:
        """Convert (n, 3) positions of the block to these axes; unknown ones remain NaN."""
        return (self.cartesian.positions(positions) - self.origin) @ self.frame.T

    def from_local(self, local: Floats) -> Floats:
        """Convert (n, 3) positions in these axes to positions of the block."""
        return self.cartesian.from_cartesian(local @ self.frame + self.origin)

    def cameras(self) -> Floats:
        """Return (P, 3, 3) rotations from the axes of the photos to these axes."""
        block = self.block
        turned = photo_axes(block.photo_attitudes, block.photo_to_ground)
        if block.spheroid is None:
            return turned
        vertical = local_frames(block.photo_positions).transpose(0, 2, 1)
        return np.asarray(self.frame @ vertical @ turned)


def local_axes(block: Block) -> LocalAxes:
    stations = _stations(block)
    if block.spheroid is not None and np.ptp(stations[:, 0]) > np.pi:  # Both sides of the antimeridian
        stations = np.column_stack([stations[:, 0] % (2 * np.pi), stations[:, 1:]])
    middle = np.median(stations, axis=0)[np.newaxis] * [1.0, 1.0, 0.0]
    frame = np.eye(3) if block.spheroid is None else local_frames(middle)[0]
    return LocalAxes(block, Cartesian(block.spheroid).positions(middle)[0], frame)


def _stations(block: Block) -> Floats:
    """Return (k, 3) positions for the centre: stations, or known points if photos move."""
    own = ~on_shared(block) if block.timed else np.ones(len(block.photo_ids), dtype=bool)
    known = np.isfinite(block.point_positions).all(axis=1)
    if own.any():
        return block.photo_positions[own]
    return block.point_positions[known] if known.any() else block.photo_positions


def frame_radius(block: Block) -> float:
    """Return the distance of the images from the centre (95 % quantile), millimetres."""
    reach = float(np.quantile(np.hypot(block.image_xy[:, 0], block.image_xy[:, 1]), 0.95))
    return max(reach, SMALL_FRAME * float(np.abs(block.known_distances("checks")).min()))


@dataclass(frozen=True, eq=False)
class Intersection:
    """Intersections of the rays of each point, in front of or behind the cameras.

    Positions (n, 3) are in the metric axes, NaN for fewer than two rays or parallel rays. Residuals (m, 2)
    are observed minus computed, millimetres. `in_front` (m,) is True if the point is in front of the camera.
    """

    positions: Floats
    residuals: Floats
    in_front: Bools

    @property
    def sizes(self) -> Floats:
        """(m,) lengths of the residuals."""
        return np.asarray(np.hypot(self.residuals[:, 0], self.residuals[:, 1]))


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays from the projection centres through the image points that are `used`, (m,).

    Projection centres (P, 3) and rotations from the photos (P, 3, 3) refer to the metric axes. `unit` is the
    unit of image coordinates in reports.
    """

    block: Block
    axes: LocalAxes
    centres: Floats
    cameras: Floats
    used: Bools
    unit: str = "mm"

    @classmethod
    def of(cls, block: Block, used: Bools | None = None, unit: str = "mm") -> Rays:
        """Create the rays of a block from its initial poses."""
        axes = local_axes(block)
        used = np.ones(len(block.image_xy), dtype=bool) if used is None else used
        return cls(block, axes, axes.positions(block.photo_positions), axes.cameras(), used, unit)

    def without(self, images: Bools) -> Rays:
        return replace(self, used=self.used & ~images)

    def directions(self) -> Floats:
        """Return (m, 3) unit vectors towards the ground; photos look along their negative z axis."""
        block = self.block
        distances = block.known_distances("checks")[block.image_photos]
        inner = np.column_stack([block.image_xy, distances]) * -np.sign(distances)[:, np.newaxis]
        outer = np.einsum("mij,mj->mi", self.cameras[block.image_photos], inner)
        return np.asarray(outer / np.linalg.norm(outer, axis=1, keepdims=True))

    def equations(self) -> tuple[Floats, Floats]:
        """Return I - d d^T and (I - d d^T) O of each ray, (m, 3, 3) and (m, 3)."""
        directions, centres = self.directions(), self.centres[self.block.image_photos]
        across = np.eye(3) - directions[:, :, np.newaxis] * directions[:, np.newaxis]
        return across, np.einsum("mij,mj->mi", across, centres)

    def intersect(self) -> Intersection:
        """Intersect the rays of each point by least squares of the distances from the lines."""
        return self.at(meet(*self.totals()))

    def totals(self) -> tuple[Floats, Floats, Floats]:
        """Sum the equations of the rays of each point: (n, 3, 3), (n, 3) and ray counts (n,)."""
        across, right = (each[self.used] for each in self.equations())
        points, count = self.block.image_points[self.used], len(self.block.point_ids)
        return sums_of(points, across, count), sums_of(points, right, count), counts_of(points, count)

    def at(self, positions: Floats) -> Intersection:
        """Return the residuals of all images for given (n, 3) positions in the metric axes."""
        residuals, in_front = self.residuals(positions[self.block.image_points])
        return Intersection(positions, residuals, in_front)

    def residuals(self, positions: Floats, rows: Indices | None = None) -> tuple[Floats, Bools]:
        """Return image residuals, observed minus computed in mm, and whether points are in front.

        `positions` are (k, 3), one per image, in the metric axes.
        """
        block = self.block
        which: Indices | slice = slice(None) if rows is None else rows
        photos = block.image_photos[which]
        inner = np.einsum("mji,mj->mi", self.cameras[photos], positions - self.centres[photos])
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = block.known_distances("checks")[photos] / inner[:, 2]
        return block.image_xy[which] - inner[:, :2] * scale[:, np.newaxis], inner[:, 2] < 0

    def partials(self, positions: Floats, rows: Indices) -> Floats:
        """Return (k, 2, 3) partial derivatives of images with respect to (k, 3) point positions."""
        photos = self.block.image_photos[rows]
        turned = self.cameras[photos].transpose(0, 2, 1)
        inner = np.einsum("kij,kj->ki", turned, positions - self.centres[photos])
        scale = self.block.known_distances("checks")[photos] / inner[:, 2]
        across = np.zeros((len(rows), 2, 3))
        across[:, 0, 0] = across[:, 1, 1] = 1
        across[:, :, 2] = -inner[:, :2] / inner[:, 2:]
        return np.asarray(scale[:, np.newaxis, np.newaxis] * across @ turned)


def meet_rays(points: Indices, count: int, centres: Floats, directions: Floats) -> Floats:
    """Return (count, 3) intersections of the rays of points; NaN if they determine no position.

    `points`, `centres` and unit `directions` have a row for each ray.
    """
    across = np.eye(3) - directions[:, :, np.newaxis] * directions[:, np.newaxis]
    # Subtract a nearby position, because geocentric coordinates are large.
    origin = np.median(centres, axis=0) if len(centres) else np.zeros(3)
    constant = sums_of(points, np.einsum("mij,mj->mi", across, centres - origin), count)
    return meet(sums_of(points, across, count), constant, counts_of(points, count)) + origin


def sums_of(rows: Indices, values: Floats, count: int) -> Floats:
    """Return the sums (count, ...) of the values (m, ...) with the same row number."""
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    columns = [np.bincount(rows, column, count) for column in flat.T]
    return np.stack(columns, axis=1).reshape(count, *values.shape[1:]).astype(np.float64, copy=False)


def counts_of(rows: Indices, count: int) -> Floats:
    """Return how often each row number occurs, (count,)."""
    return np.bincount(rows, minlength=count).astype(np.float64)


def meet(normal: Floats, constant: Floats, rays: Floats) -> Floats:
    """Solve (k, 3, 3) normal equations of `rays` rays each; NaN if a position is undetermined."""
    determined = rays >= 1.5
    determined &= np.linalg.det(normal) > PARALLEL * np.maximum(rays, 1) ** 3
    positions = np.full(constant.shape, np.nan)
    positions[determined] = np.linalg.solve(normal[determined], constant[determined, :, np.newaxis])[..., 0]
    return positions
