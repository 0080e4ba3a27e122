"""What is to be said of splined lenses: knots that hang on their priors, and pixels beyond the knots."""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.network.knots import Knot, beyond_knots
from photogram.network.observations.prior import Prior
from photogram.results.cameras import AdjustedCamera
from photogram.targets.calibrated import Calibrated
from photogram.targets.imaging import TURNED
from photogram.targets.lens_fit import field_of, grid_of_pixels

__all__ = ["spline_lines"]

HANGS = 0.05
"""Redundancy of a prior below which what it is of comes from it."""


def spline_lines(calibrated: Calibrated) -> list[str]:
    """Return sentences on the knots of each splined lens."""
    return [
        line
        for number, each in enumerate(calibrated.cameras)
        if each.camera.knots is not None
        for line in (*_from_priors(calibrated, number), *_beyond(calibrated, number))
    ]


def _from_priors(calibrated: Calibrated, number: int) -> list[str]:
    """Return which share of the knots of a camera comes from their priors."""
    camera = calibrated.cameras[number]
    of_knots = {id(each) for each in camera.given.knot_unknowns}
    if not of_knots:
        return [f"{camera.name}: its knots are held"]
    hang = 0
    block = calibrated.result.block
    for kind in calibrated.result.kinds.values():
        for row, own in zip(kind.rows.tolist(), kind.redundancy, strict=True):
            observation = block.observations[row]
            if not (isinstance(observation, Prior) and isinstance(observation.unknown, Knot)):
                continue
            if id(observation.unknown) in of_knots:
                hang += bool(np.nansum(own) / 2 < HANGS)
    told = f"{camera.name}: {hang} of {len(of_knots)} knots are from their prior (redundancy below {HANGS:g})"
    return [f"{told}; {len(of_knots) - _touched(calibrated, number)} of them no image touches"]


def _touched(calibrated: Calibrated, number: int) -> int:
    """Return how many knots of a camera the image of a corner touches."""
    camera = calibrated.cameras[number].camera
    corners = calibrated.calibration.corners
    poses = calibrated.picture_poses[corners.picture]
    own = corners.use & (corners.cameras[corners.picture] == number)
    points = calibrated.points[corners.point[own]]
    seen = np.einsum("nij,nj->ni", poses[own, :3, :3], points) + poses[own, :3, 3]
    patches, _ = _photocore.camera_patches(camera.model, camera.values, seen * TURNED)
    return len(np.unique(patches))


def _beyond(calibrated: Calibrated, number: int) -> list[str]:
    """Return which share of the picture lies beyond the knots, and the field that would do."""
    size = calibrated.calibration.corners.sizes[number]
    if size is None:
        return []
    adjusted: AdjustedCamera = calibrated.cameras[number]
    camera = adjusted.camera
    rays = camera.rays(grid_of_pixels(size))
    share = float(beyond_knots(camera.parameters, rays).mean())
    if not share:
        return [f"{adjusted.name}: the whole picture is within its knots"]
    count = (int(camera.parameters["nx"]), int(camera.parameters["ny"]))
    would_do = math.ceil(field_of(rays, count, camera.parameters["order"]))
    return [
        f"{adjusted.name}: {share:.1%} of the picture is beyond its knots, where nothing is said of its"
        f" uncertainty; fov_x_deg = {would_do} would do"
    ]
