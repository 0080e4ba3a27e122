"""Rounds of the adjustment of a calibration: corner sd, board motion, outliers, clocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools
from photogram.errors import RankError
from photogram.messages import Message
from photogram.results.result import Result
from photogram.targets.calibration_result import Calibrated
from photogram.targets.findings import deviation_of_corners
from photogram.targets.motion import dated, errors_of_speeds
from photogram.targets.vision import photo_poses
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibration

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
