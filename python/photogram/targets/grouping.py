"""Corners in groups: residual statistics, and validity of the corner precision.

Let a group have ~v = v / sd and redundancy numbers r. In each coordinate, its mean residual vector has the
test value t = sum ~v / (sigma0 sqrt(sum r)). The unknowns absorb part of a common shift, so the variance of
the sum is at most sum r. The test is conservative.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from photogram.adjustment.components import variance_components
from photogram.arguments.arrays import one_of
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.results.components import VarianceComponents
from photogram.results.grouping import GroupsArgument
from photogram.show.quantity import Axis, Quantity, chosen
from photogram.targets.options import CornerBasis
from photogram.targets.regularisation import weighted_block
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated

Groups = Literal["camera", "level", "point", "cell", "radius"]

CELLS_OF_PICTURE = (12, 8)  # across and down
RINGS_OF_PICTURE = 10
CRITICAL_TEST_VALUE = 3.3  # p = 0.001


def residual_groups(calibrated: Calibrated, by: Groups, camera: int = 0) -> list[Quantity]:
    """Return residuals by group: corners, rms, redundancy, sigma, mean and test.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    by
        `camera`; `level`, the standard deviation relative to level 0; `point` of the board. `cell`, 12 x 8
        cells of a camera image; `radius`, ten rings about its centre.
    camera
        Camera for `cell` and `radius`.
    """
    one_of("by", by, get_args(Groups))
    names, group = _grouped(calibrated, by, camera)
    result, count = calibrated.result, len(names)
    own = group >= 0
    used = np.bincount(group[own], minlength=count)
    weighted = (result.residuals / result.image_given_sd) ** 2
    mean, tests = mean_residuals(calibrated, group, count)
    with np.errstate(invalid="ignore", divide="ignore"):
        rms = np.sqrt(_sums(group[own], result.residuals[own] ** 2, count).sum(axis=1) / (2 * used))
        redundancy = _sums(group[own], result.redundancy[own], count).sum(axis=1)
        sigma = np.sqrt(_sums(group[own], weighted[own], count).sum(axis=1) / redundancy)
    kept, marked = used > 0, np.abs(np.nan_to_num(tests)) > CRITICAL_TEST_VALUE
    pixels = (Axis.of("px", "px"),)
    axes = (Axis.of("x", "px"), Axis.of("y", "px"))
    columns = [
        Quantity(np.array(names, dtype=object), (), "name", by, by, head=_HEADS[by]),
        Quantity(used, name="corners", member="corners", head="Corners"),
        Quantity(rms, pixels, "value", "rms", "rms_px", head="rms", figures=3),
        Quantity(redundancy, name="redundancy", member="redundancy", head="Redundancy"),
        Quantity(sigma, name="sigma", member="sigma", head="Sigma", figures=3),
        Quantity(mean, axes, "value", "mean_", "mean_px", head="Mean {}", figures=2),
        Quantity(tests, axes, "number", "t_", "t", head="t {}", figures=2, marked=marked),
    ]
    return chosen(columns, np.flatnonzero(kept))


def mean_residuals(calibrated: Calibrated, group: Indices, count: int) -> tuple[Floats, Floats]:
    """Return (count, 2) mean group residuals (px) and test values, ignoring group -1."""
    result = calibrated.result
    own = group >= 0
    weighted = result.residuals / result.image_given_sd
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (
            _sums(group[own], result.residuals[own], count)
            / np.bincount(group[own], minlength=count)[:, None]
        )
        spread = np.sqrt(_sums(group[own], np.nan_to_num(result.redundancy[own]), count))
        tests = _sums(group[own], np.nan_to_num(weighted[own]), count) / spread
    return mean, tests / np.sqrt(result.covariance_scale)


def _grouped(calibrated: Calibrated, by: Groups, camera: int) -> tuple[list[str], Indices]:
    """Return group names, and (m,) the group of each image, or -1."""
    corners, block = calibrated.calibration.corners, calibrated.result.block
    use = corners.use
    cameras = corners.cameras[corners.picture[use]]
    if by == "camera":
        return list(corners.camera_names), cameras
    if by == "level":
        values, group = np.unique(corners.sd[use], return_inverse=True)
        return [f"{each:g}" for each in values], group.reshape(-1)
    if by == "point":
        return list(calibrated.calibration.board.names), corners.point[use]
    size = np.array(corners.sizes[camera] or block.image_xy[cameras == camera].max(axis=0) + 1)
    if by == "cell":
        place = np.clip(
            (block.image_xy + 0.5) / size * CELLS_OF_PICTURE, 0, np.array(CELLS_OF_PICTURE) - 1
        ).astype(np.int64)
        names = [
            f"{column} {row}" for row in range(CELLS_OF_PICTURE[1]) for column in range(CELLS_OF_PICTURE[0])
        ]
        return names, np.where(cameras == camera, place[:, 1] * CELLS_OF_PICTURE[0] + place[:, 0], -1)
    radius = np.hypot(*(block.image_xy - (size - 1) / 2).T)
    edges = np.linspace(0.0, float(np.hypot(*size)) / 2, RINGS_OF_PICTURE + 1)
    ring = np.clip(np.digitize(radius, edges) - 1, 0, RINGS_OF_PICTURE - 1)
    names = [f"{low:.0f} to {high:.0f}" for low, high in pairwise(edges.tolist())]
    return names, np.where(cameras == camera, ring, -1)


_HEADS = {
    "camera": "Camera",
    "level": "sd over that of level 0",
    "point": "Point of the board",
    "cell": "Cell, column and row",
    "radius": "Radius, px",
}


def _sums(group: Indices, values: Floats, count: int) -> Floats:
    return np.stack([np.bincount(group, weights=column, minlength=count) for column in values.T], axis=1)


def corner_components(
    result: Calibrated,
    by: Sequence[CornerBasis] = ("camera",),
    *,
    threads: int | None = None,
    progress: Callable[[int, Floats], None] | None = None,
) -> VarianceComponents:
    """Estimate variance components of groups of corners (docs/weights.md).

    Parameters
    ----------
    result
        Adjusted calibration. Weak camera priors are ignored, except for knots.
    by
        Grouping: `camera`, `level` of the detector, both, or a basis of
        :func:`photogram.variance_components`. Weighted board points are a group.
    threads, progress
        As in :func:`photogram.variance_components`.

    Raises
    ------
    InputError
        If the grouping is unknown, or combines levels with a basis other than cameras.
    RankError, AdjustmentError, OutOfMemoryError, KeyboardInterrupt
        As in :func:`photogram.variance_components`.
    """
    for basis in by:
        one_of("by", basis, get_args(CornerBasis))
    start = result.restarted()
    if not any(each.knot_unknowns for each in start.cameras):
        start = start.replace(regularise=None)
    block = weighted_block(start)
    groups: GroupsArgument = list(by)
    if "level" in by:
        if others := [each for each in by if each not in ("level", "camera")]:
            raise InputError(phrase("targets.levels", others=others))
        levels = np.log2(block.image_sd[:, 0] / block.image_sd.min()).round().astype(int).tolist()
        names = [f"level {level}" for level in levels]
        if "camera" in by:
            assert block.photo_cameras is not None
            own = block.photo_cameras[block.image_photos].tolist()
            names = [f"{block.camera_names[k]}, {name}" for k, name in zip(own, names, strict=True)]
        groups = {"images": names}
    return variance_components(block, groups, threads=threads, progress=progress)
