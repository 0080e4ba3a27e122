"""Corners as they might have been measured: of the values of a calibration, with errors drawn anew."""

from __future__ import annotations

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.errors import InputError
from photogram.network.cameras import images_of
from photogram.targets.calibration import Calibration
from photogram.targets.housing import transformed
from photogram.targets.vision import FLIP

__all__ = ["simulate_corners"]


def simulate_corners(calibration: Calibration, seed: int = 1) -> Calibration:
    """Return a calibration whose corners are images of its own values, with errors as large as it says.

    The points of a board whose shape is `points` are drawn about their nominal places, once for all views.

    Parameters
    ----------
    calibration
        Its cameras, poses and sensors are taken for true; which corners there are stays as it is.
    seed
        The same seed gives the same errors.

    Raises
    ------
    InputError
        Nobody has said how well corners are measured, or one has no image by these values.
    """
    if calibration.sd0 is None:
        raise InputError("corners are drawn with a standard deviation: sd0 says none")
    random = np.random.default_rng(seed)
    corners = calibration.corners
    places = calibration.places().copy()
    if calibration.shape == "points":
        places += calibration.board.deviations(corners.view_count) * random.standard_normal(places.shape)
    poses = calibration.picture_poses()
    seen = transformed(poses[corners.picture], places[corners.point])
    xy = images_of(calibration.cameras, corners.cameras[corners.picture], seen @ FLIP)
    if not np.isfinite(xy).all():
        row = int(np.argmin(np.isfinite(xy).all(axis=1)))
        raise InputError(f"{corners.title(row)} has no image by the values of the calibration")
    errors = calibration.sd0 * corners.sd[:, np.newaxis] * random.standard_normal(xy.shape)
    return calibration.replace(corners=corners.replace(xy=xy + errors))


check_arguments(globals(), __all__)
