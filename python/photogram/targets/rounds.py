"""Rounds of the adjustment of a calibration: camera priors, corner sd, board motion, outliers, clocks.

Camera priors are standard deviations of knots about zero, and weak observations of mrcal 2.2. The latter
observe lens terms as 0 and the principal point as central. Let n = 2 (corners of the board) (images),
including missing corners, and n_d the number of lens terms of all cameras:

    lambda p = 0,  lambda^2 = 0.0025 n / (4 n_d)         every lens term; 5 lambda for k4, k5, k6
    mu (cx - (w - 1)/2) = 0,  mu^2 = 0.0025 n / (2 K 500^2)       likewise cy; K cameras

and, of splined lenses, with n_d displacements of knots, lambda^2 = 0.0025 n / (0.04 n_d):

    lambda (e . d) = 0,  10 lambda (e x d) = 0        e: radial; (1, 0) at the centre, lambda for both

These are rows of unit weight in pixels, independent of the corner standard deviation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import argument_error
from photogram.arguments.types import Bools
from photogram.errors import InputError, RankError
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.network.knots import KNOTTED
from photogram.results.result import Result
from photogram.targets.calibration_result import Calibrated
from photogram.targets.findings import deviation_of_corners
from photogram.targets.motion import dated, errors_of_speeds
from photogram.targets.vision import photo_poses
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.network.block import Block
    from photogram.targets import Calibration

CORE = ("fx", "fy", "f", "cx", "cy")
DENOMINATOR = ("k4", "k5", "k6")
SHARE, ROUGH, FAR = 0.0025, 4.0, 500.0
FIRMER = 5.0
ROUGH_KNOTS, ACROSS = 0.04, 10.0


def regularised(
    cameras: Sequence[Camera], sizes: Sequence[tuple[int, int] | None], observed: int
) -> list[Camera]:
    terms = [[name for name in each.names if name not in CORE and _free(each, name)] for each in cameras]
    count = sum(map(len, terms))
    mu = math.sqrt(SHARE * observed / (2 * len(cameras) * FAR**2))
    knots = sum(len(each.knot_names) for each in cameras if each.knot_unknowns)
    found = []
    for camera, size, own in zip(cameras, sizes, terms, strict=True):
        if size is None:
            raise InputError(phrase("targets.no-size", camera=camera.title))
        firm = math.sqrt(SHARE * observed / (ROUGH * count)) if count else math.inf
        priors = {name: (0.0, 1 / (firm * (FIRMER if name in DENOMINATOR else 1.0))) for name in own}
        priors |= {
            name: ((extent - 1) / 2, 1 / mu)
            for name, extent in zip(("cx", "cy"), size, strict=True)
            if _free(camera, name)
        }
        values = {name: value for name, (value, _) in priors.items()}
        sd = {name: each for name, (_, each) in priors.items()}
        given = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
        knot_sd = camera.knot_sd
        if camera.knot_unknowns and camera.knots is not None:
            firm = math.sqrt(SHARE * observed / (ROUGH_KNOTS * knots))
            rows, columns, _ = camera.knots.shape
            knot_sd = np.tile([1 / firm, 1 / (ACROSS * firm)], (rows, columns, 1))
            if rows % 2 and columns % 2:  # the central knot has an undefined radial direction
                knot_sd[rows // 2, columns // 2] = 1 / firm
        found.append(
            camera.replace(parameters={**camera.parameters, **values}, sd={**given, **sd}, knot_sd=knot_sd)
        )
    return found


def weighted_block(start: Calibration) -> Block:
    if start.regularise is None:
        return start.block()
    observed = 2 * len(start.board.places) * len(start.corners.pictures)
    return start.block(regularised(start.cameras, start.corners.sizes, observed))


def _free(camera: Camera, name: str) -> bool:
    return float(camera.deviations[camera.names.index(name)]) > 0


WEAK_KNOT_SD = (1.0, 0.1)  # radial, tangential in the stereographic image; 1 is 53 degrees off the axis


def with_knot_sd(
    cameras: Sequence[Camera], knot_sd: tuple[float, float] | None, regularise: str | None
) -> list[Camera]:
    """Return cameras whose free knots are observed as zero, radially and tangentially.

    `knot_sd` is by default `WEAK_KNOT_SD`, unless `regularise` names other priors.
    """
    if knot_sd is not None:
        if not all(0 < each < np.inf for each in knot_sd):
            raise argument_error("knot_sd", "positive-numbers", count=2, value=knot_sd)
        if regularise is not None:
            raise InputError(phrase("error.exclusive", first="knot_sd", second="regularise"))
        if not any(each.model == KNOTTED for each in cameras):
            raise InputError(phrase("error.not-applicable", name="knot_sd", other=cameras[0].model))
    if regularise is not None:
        return list(cameras)
    own = WEAK_KNOT_SD if knot_sd is None else knot_sd
    return [each.replace(knot_sd=own) if each.knot_unknowns else each for each in cameras]


MIN_CHANGE = 0.01  # relative change of corner sd, and pose change in standard deviations


def better_start(start: Calibration, result: Result) -> Calibration | None:
    """Return a start with updated corner sd or board motion; None if both are stable."""
    better = start if start.sync != "offset" or not result.converged else _in_motion(start, result)
    if start.sd0 is None and start.shape == "points" and result.converged:
        change = deviation_of_corners(result)
        sd = start.assumed * change
        if abs(change - 1) > MIN_CHANGE and sd > 1e-6:  # else simulated without errors
            better = better.replace(assumed=sd)
    return None if better is start else better


def _in_motion(start: Calibration, result: Result) -> Calibration:
    """Return the calibration with motion from adjusted poses, if that changes it."""
    ended = Calibrated.of(result, start)
    again = ended.restarted_calibration().replace(motion=None)
    # Image positions with the new motion, everything else as adjusted.
    late = {name: each.values[0] for name, each in ended.offsets.items()}
    there = again.replace(
        sensors=ended.sensors, offsets=[late.get(each.name, 0.0) for each in ended.cameras]
    ).picture_poses()
    pictures = slice(len(start.corners.pictures))
    gaps = np.abs(photo_poses(there)[0] - result.photo_positions[pictures])
    return start if (gaps <= MIN_CHANGE * result.photo_sd[pictures, :3]).all() else again


NOTABLE_POSE_ERROR, MAX_POSE_ERROR = 0.01, 0.2  # relative motion errors: warning, error for a free offset


def checked_clocks(calibrated: Calibrated) -> list[Message]:
    """Return messages on the accuracy of the motion that determines clock offsets.

    Speeds follow from poses with errors: v = v_true + e. The offset is too small by the ratio of E(e'e) to
    v'v, weighted by the poses. Its standard deviation is too small as well.
    """
    messages = []
    start = calibrated.calibration
    photos = [calibrated.block.photo_ids[row] for row in calibrated.photos.tolist()]
    corners, sd = start.corners, np.asarray(start.sd_offsets)
    count, scale = len(photos), calibrated.covariance_scale
    # (V,) expected squared speeds from pose errors, and observed ones
    joint = (calibrated.covariance([("step", photos)]) / scale).reshape(count, 6, count, 6)
    own = joint[np.arange(count), :, np.arange(count)]
    speeds = np.nan_to_num(np.asarray(start.motion)[:, 0])
    squares = np.einsum("vi,vi->v", speeds, np.linalg.solve(own, speeds[..., np.newaxis])[..., 0])
    by_errors = errors_of_speeds(dated(corners, start.tied), start.references_of_views())
    expected = 6 * np.nan_to_num(by_errors) * scale
    for camera, each in enumerate(calibrated.cameras):
        if each.name not in calibrated.offsets or sd[camera] == 0:
            continue
        views = np.unique(corners.views[corners.cameras == camera])
        share = float(expected[views].sum() / squares[views].sum())
        if share > MAX_POSE_ERROR and np.isinf(sd[camera]):
            what = str(phrase("targets.offset", camera=each.name))
            message = phrase("targets.offset.weigh", camera=each.name, share=share)
            raise RankError(message, [photos[view] for view in views.tolist()], [], [each.name], what)
        if share > NOTABLE_POSE_ERROR:
            messages.append(Message(phrase("targets.offset.small", camera=each.name, share=share)))
    return messages


REMOVAL_FACTOR, OUTLIER_FACTOR = 5.0, 4.0  # multiples of the rms: start of removal, removed corners


def marked_as_mrcal(result: Result) -> Bools:
    """Return (m,) the images that mrcal removes, to reproduce its results.

    If a weighted residual exceeds 5 rms, all above 4 rms are removed. Data snooping tests each corner by its
    own precision.
    """
    weighted = np.abs(result.residuals / result.image_given_sd)
    rms = np.sqrt(np.nanmean(weighted**2))
    far = np.nanmax(weighted, axis=1, initial=0.0)
    return (
        far > OUTLIER_FACTOR * rms if (far > REMOVAL_FACTOR * rms).any() else np.zeros(len(far), dtype=bool)
    )
