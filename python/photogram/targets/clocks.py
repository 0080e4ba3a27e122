"""Whether the motion of a board tells the offsets between cameras, or only the errors of its poses."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import RankError
from photogram.messages import Message
from photogram.targets.calibration_result import Calibrated
from photogram.targets.motion import dated, errors_of_speeds

__all__ = ["checked_clocks"]

NOTABLE, MOST = 0.01, 0.2
"""Shares of the motion that are errors of poses: told, and refused where an offset is free."""


def checked_clocks(calibrated: Calibrated) -> list[Message]:
    """Return what is to be said of the motion of a board by which offsets between cameras are known.

    Its speeds follow from poses that have errors: v = v_true + e. An offset comes out too small by the share
    of E(e'e) in v'v, all by the weights of the poses, and has too small a standard deviation.

    Raises
    ------
    RankError
        A free offset, where a fifth or more are errors: the board stands still.
    """
    messages = []
    start, result = calibrated.calibration, calibrated.result
    corners, sd = start.corners, np.asarray(start.sd_offsets)
    shares = _shares(calibrated)
    for camera, each in enumerate(calibrated.cameras):
        if each.name not in calibrated.offsets or sd[camera] == 0:
            continue
        views = np.unique(corners.views[corners.cameras == camera])
        share = float(shares[0, views].sum() / shares[1, views].sum())
        if share > MOST and np.isinf(sd[camera]):
            photos = [result.block.photo_ids[row] for row in calibrated.photos[views].tolist()]
            what = f"the offset of {each.name} is not determined: the board hardly moves"
            told = (
                f"{what}; {share:.0%} of its motion are errors of its poses. Weigh it (sd_offsets, --offset)"
            )
            raise RankError(told, photos, [], [each.name], what)
        if share > NOTABLE:
            messages.append(
                Message(
                    f"the offset of {each.name} comes out too small by about {share:.0%}: so much of the"
                    " motion of the board are errors of its poses"
                )
            )
    return messages


def _shares(calibrated: Calibrated) -> Floats:
    """Return (2, V): squared speeds that errors of poses make on average, and those that are there."""
    start, result = calibrated.calibration, calibrated.result
    steps = ("step", [result.block.photo_ids[row] for row in calibrated.photos.tolist()])
    joint = result.covariance([steps]) / result.covariance_scale
    count = len(calibrated.photos)
    own = joint.reshape(count, 6, count, 6)[np.arange(count), :, np.arange(count)]
    speeds = np.nan_to_num(np.asarray(start.motion)[:, 0])
    there = np.einsum("vi,vi->v", speeds, np.linalg.solve(own, speeds[..., np.newaxis])[..., 0])
    by_errors = errors_of_speeds(dated(start.corners, start.tied), start.references_of_views())
    return np.stack([6 * np.nan_to_num(by_errors) * result.covariance_scale, there])
