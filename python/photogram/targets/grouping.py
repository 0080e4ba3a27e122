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
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.components import VarianceComponents
from photogram.results.grouping import GroupsArgument
from photogram.show.quantity import Axis, Quantity, chosen, column
from photogram.targets.options import CornerBasis
from photogram.targets.regularisation import weighted_block
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.results.result import Result
    from photogram.targets import Calibrated

Groups = Literal["camera", "level", "point", "cell", "radius"]

CELLS_OF_PICTURE = (12, 8)  # across and down
RINGS_OF_PICTURE = 10
CRITICAL_TEST_VALUE = 3.3  # p = 0.001


@dataclass(frozen=True, eq=False)
class GroupStatistics:
    """Residuals of the used corners in G groups; NaN for empty groups."""

    corners: Indices  # (G,) number of corners
    rms: Floats  # (G,) root mean square of the residuals, pixels
    redundancy: Floats  # (G,)
    chi2: Floats  # (G,) sum of squares of the weighted residuals
    mean: Floats  # (G, 2) mean residual, pixels, and its test value
    tests: Floats


def group_statistics(result: Result, group: Indices, count: int) -> GroupStatistics:
    """Return statistics of `count` groups; `group` is (m,) of each image, -1: none."""
    own = group >= 0
    corners = np.bincount(group[own], minlength=count)

    def sums(values: Floats) -> Floats:
        parts = [np.bincount(group[own], weights=column[own], minlength=count) for column in values.T]
        return np.stack(parts, axis=1)

    weighted = result.residuals / result.image_given_sd
    with np.errstate(invalid="ignore", divide="ignore"):
        spread = np.sqrt(sums(np.nan_to_num(result.redundancy)) * result.covariance_scale)
        return GroupStatistics(
            corners=corners,
            rms=np.sqrt(sums(result.residuals**2).sum(axis=1) / (2 * corners)),
            redundancy=sums(result.redundancy).sum(axis=1),
            chi2=sums(weighted**2).sum(axis=1),
            mean=sums(result.residuals) / corners[:, np.newaxis],
            tests=sums(np.nan_to_num(weighted)) / spread,
        )


_PIXELS = (Axis.of("px", "px"),)


def views(calibrated: Calibrated) -> list[Quantity]:
    """Return the views with images, corners, rms, redundancy, chi2, largest residual."""
    corners, result = calibrated.calibration.corners, calibrated
    count, of_picture, use = corners.view_count, corners.views, corners.use
    view = of_picture[corners.picture[use]]
    found = group_statistics(result, view, count)
    largest = np.zeros(count)
    np.maximum.at(largest, view, np.nan_to_num(np.abs(result.standardized)).max(axis=1, initial=0.0))
    marked = np.bincount(view[outlying_images(calibrated)], minlength=count) > 0
    left_out = np.bincount(of_picture[corners.picture[~use]], minlength=count)
    names = np.array(corners.view_names(), dtype=object)
    return [
        replace(column("view", names, "View", kind="name"), member="name", about="first picture of the view"),
        column("pictures", np.bincount(of_picture, minlength=count), "Pictures"),
        column("corners", found.corners, "Corners"),
        column("left_out", left_out, "Left out"),
        column("rms_px", found.rms, "rms", axes=_PIXELS, kind="value"),
        column("redundancy", found.redundancy, "Redundancy"),
        column("chi2", found.chi2, "chi²", figures=4),
        column("largest_standardized", largest, "Largest standardized", marked=marked),
    ]


def outlying_images(calibrated: Calibrated) -> Bools:
    """Return (m,) the images that are outliers of the verdict."""
    outliers = np.zeros(len(calibrated.residuals), dtype=bool)
    for kind, places in calibrated.verdict.outlying.items():
        if isinstance(kind, Phrase) and kind.code in ("test.images", "test.image_coordinates"):
            outliers[[place[0] for place in places]] = True
    return outliers


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
    found = group_statistics(calibrated, group, len(names))
    with np.errstate(invalid="ignore", divide="ignore"):
        sigma = np.sqrt(found.chi2 / found.redundancy)
    marked = np.abs(np.nan_to_num(found.tests)) > CRITICAL_TEST_VALUE
    axes = (Axis.of("x", "px"), Axis.of("y", "px"))
    columns = [
        column(by, np.array(names, dtype=object), _HEADS[by], kind="name"),
        column("corners", found.corners, "Corners"),
        Quantity(found.rms, _PIXELS, "value", "rms", "rms_px", head="rms", figures=3),
        column("redundancy", found.redundancy, "Redundancy"),
        column("sigma", sigma, "Sigma", figures=3),
        Quantity(found.mean, axes, "value", "mean_", "mean_px", head="Mean {}", figures=2),
        Quantity(found.tests, axes, "number", "t_", "t", head="t {}", figures=2, marked=marked),
    ]
    return chosen(columns, np.flatnonzero(found.corners))


def _grouped(calibrated: Calibrated, by: Groups, camera: int) -> tuple[list[str], Indices]:
    """Return group names, and (m,) the group of each image, or -1."""
    corners, block = calibrated.calibration.corners, calibrated.block
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
    start = result.restarted_calibration()
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
