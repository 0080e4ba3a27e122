"""Images of a point that explain its residuals as well as the one that is taken out.

With two rays, or three of photos in a row, an error of one image leaves the residuals that an error of
another would leave. The test of an image as a group (x and y together) is T = v' R^- v, its residuals in
standard deviations and its block of R = I - A N^-1 A', here with the photos known: A are the partials of the
images of the point with respect to its position. The odds of two images are
exp((T_i - T_j) / 2 - (m_i - m_j)), m the rank of the block (Akaike weights).
"""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.network.directions import without_lenses
from photogram.network.rays import Rays
from photogram.results.result import Result

ODDS = 20.0  # An image that is less likely by this factor is no rival
ALIKE = 0.98  # Nor can tests be told apart that differ by less: photos are not known quite
INVISIBLE = 1e-6  # Eigenvalue of a block of R along which an error leaves no residual


def rival_images(result: Result, row: int, spread: float) -> Indices:
    """Return the rows of other images of a point that may be wrong instead of the image in a row.

    `spread` is the robust standard deviation of the test values.
    """
    block = result.block
    point = int(block.image_points[row])
    rows = np.flatnonzero((block.image_points == point) & result.used_images)
    plain = without_lenses(
        block.replace(photo_positions=result.photo_positions, photo_attitudes=result.photo_attitudes)
    )
    if len(rows) == 2:
        return np.asarray(rows[rows != row])
    if len(plain.image_xy) < len(block.image_xy):
        return rows[:0]
    rays = Rays.of(plain)
    design = rays.partials(rays.axes.positions(result.point_positions[[point]]), rows)
    design = (design / block.image_sd[rows][:, :, np.newaxis]).reshape(-1, 3)
    normal = design.T @ design
    held = np.isfinite(block.point_sd[point]) & (block.point_sd[point] > 0)
    per_unit = np.ones(3) if block.spheroid is None else np.array([block.spheroid.a, block.spheroid.a, 1.0])
    normal[held, held] += 1 / (per_unit * block.point_sd[point])[held] ** 2
    visible = np.eye(len(design)) - design @ np.linalg.pinv(normal, rcond=1e-12) @ design.T
    residuals = (result.residuals[rows] / block.image_sd[rows]).ravel() / spread
    tests = [_test(visible[i : i + 2, i : i + 2], residuals[i : i + 2]) for i in range(0, len(residuals), 2)]
    value, rank = tests[int(np.flatnonzero(rows == row)[0])]
    near = [(value - other) / 2 - (rank - m) < math.log(ODDS) or other > ALIKE * value for other, m in tests]
    return np.asarray(rows[np.array(near) & (rows != row)])


def _test(block: Floats, residuals: Floats) -> tuple[float, int]:
    """Return T and the rank of the block."""
    sizes, axes = np.linalg.eigh(block)
    seen = sizes > INVISIBLE
    return float(((axes.T @ residuals)[seen] ** 2 / sizes[seen]).sum()), int(seen.sum())
