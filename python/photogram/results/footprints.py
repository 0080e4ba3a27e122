"""Footprints of photos on the ground."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import bounds
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.cameras import camera_rows, rays_of_row
from photogram.network.motion import of_pictures, scanners
from photogram.network.rays import LocalAxes, local_axes
from photogram.results.fixed_tests import as_adjusted

if TYPE_CHECKING:
    from photogram import Result

SIDE = 4  # Vertices of an outline on each side of the image
HORIZON = math.radians(80.0)  # Limit of footprints from the vertical


@dataclass(frozen=True, eq=False)
class Footprints:
    # (P, 17, 3) closed outlines in metric axes, counter-clockwise like the image corners from the lower left;
    # NaN for photos at or below the ground, beyond the field of the lens, and for scanners, which have
    # several poses
    outlines: Floats
    # The metric axes of a rectangular block, else east, north and up at the centre of the stations
    axes: LocalAxes
    grounds: Floats  # (P,) heights of the level ground planes in these axes
    # (P,) size of an image unit on the ground along the axis, in the linear unit: the ground sample distance
    # if image coordinates are pixels
    size: Floats
    # (P,) whether an image extends beyond 80 degrees from the vertical, the limit of its outline
    cut: Bools

    def positions(self) -> Floats:
        """Return (P, 17, 3) outlines as positions in the coordinate system of the block."""
        found = self.axes.from_local(self.outlines.reshape(-1, 3))
        return found.reshape(self.outlines.shape)


def footprints(result: Result, sizes: Sequence[tuple[float, float] | None] = ()) -> Footprints:
    """Return footprints of adjusted photos on level planes at the heights of their points.

    `sizes` are widths and heights of the images of each camera; the default is the extent of measurements.
    """
    block = as_adjusted(result, free=True)
    axes = local_axes(block)
    levels = grounds(result, axes.positions(result.point_positions)[:, 2])
    centres, turns = axes.positions(block.photo_positions), axes.cameras()
    heights = centres[:, 2] - levels
    cameras, photo_cameras = block.core_cameras()
    frames = picture_frames(block, sizes)
    rays = np.full((len(cameras), 4 * SIDE + 1, 3), np.nan)
    if result.cameras:
        cameras = camera_rows([each.camera for each in result.cameras])
    steps = np.arange(4 * SIDE + 1) / SIDE
    for row, own in enumerate(cameras):
        left, low, right, high = frames[row]
        corners = (left, right, right, left, left), (low, low, high, high, low)
        rays[row] = rays_of_row(own, np.column_stack([np.interp(steps, np.arange(5), c) for c in corners]))
    directions = np.einsum("pij,pvj->pvi", turns, rays[photo_cameras])
    horizontal = np.hypot(directions[..., 0], directions[..., 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        tangents = np.where(directions[..., 2] < 0, -horizontal / directions[..., 2], np.inf)
        far = tangents > math.tan(HORIZON)
        reach = np.where(far, math.tan(HORIZON), tangents) * np.where(heights > 0, heights, np.nan)[:, None]
        along = directions[..., :2] / np.where(horizontal > 0, horizontal, 1.0)[..., np.newaxis]
        outlines = np.empty(directions.shape)
        outlines[..., :2] = centres[:, np.newaxis, :2] + along * reach[..., np.newaxis]
        outlines[..., 2] = np.where(np.isnan(reach), np.nan, levels[:, np.newaxis])
        slant = heights / turns[:, 2, 2]
    known = np.isfinite(directions[..., 2]) & ~scanners(block)[:, np.newaxis]
    outlines[~known] = np.nan
    size = np.where((slant > 0) & ~scanners(block), slant, np.nan) / block.camera_scales()
    return Footprints(outlines, axes, levels, size, (far & known).any(axis=1))


def grounds(result: Result, heights: Floats) -> Floats:
    """Return (P,) median point heights of photos; of all points without own points."""
    block = result.block
    own = np.flatnonzero(result.used_images)
    order, rank = np.argsort(heights), np.empty(len(heights), dtype=np.int64)
    rank[order] = np.arange(len(heights))
    # Integers by photo, then by height, are sorted faster than pairs.
    keys = np.sort(block.image_photos[own] * len(heights) + rank[block.image_points[own]])
    starts = np.searchsorted(keys, np.arange(len(block.photo_ids) + 1) * len(heights))
    counts = np.diff(starts)
    known = heights[np.isfinite(heights)]
    found = np.full(len(counts), np.median(known) if len(known) else np.nan)
    some = counts > 0
    sorted_heights = heights[order][keys % max(len(heights), 1)]
    low, high = starts[:-1][some] + (counts[some] - 1) // 2, starts[:-1][some] + counts[some] // 2
    found[some] = (sorted_heights[low] + sorted_heights[high]) / 2
    return found


def picture_frames(block: Block, sizes: Sequence[tuple[float, float] | None] = ()) -> Floats:
    """Return (k, 4) minimum x and y, maximum x and y of the camera frames of a block, without scanners.

    Pixels of cameras with y downwards are measured from the corner, all other coordinates from the centre.
    """
    cameras, photo_cameras = block.core_cameras()
    block = of_pictures(block)
    of_images = photo_cameras[block.image_photos]
    found = np.full((len(cameras), 4), np.nan)
    for row in range(len(cameras)):
        size = sizes[row] if row < len(sizes) else None
        if size is not None:
            width, height = size
            corner = bool(block.cameras) and block.cameras[row].image_y == "down" and block.image_unit == "px"
            middle = (0.0, 0.0) if corner else (width / 2, height / 2)
            found[row] = -middle[0], -middle[1], width - middle[0], height - middle[1]
            continue
        own = block.image_xy[of_images == row]
        if len(own):
            found[row] = bounds(own).ravel()
    return found


def metric_covariances(result: Result, *, photos: bool = False) -> Floats:
    """Return (n, 3, 3) covariances of points or stations in the linear unit."""
    found = result.photo_covariances[:, :3, :3] if photos else result.point_covariances
    if result.block.spheroid is None:
        return found
    places = result.photo_positions if photos else result.point_positions
    lengths = geometry.lengths_of_units(places, result.block.spheroid)
    return np.asarray(found * lengths[:, :, np.newaxis] * lengths[:, np.newaxis, :])
