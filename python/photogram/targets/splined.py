"""What is to be said of splined lenses: knots that hang on their priors, and pixels beyond the knots."""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.lazy_dataclasses import dataclass
from photogram.network.knots import Knot, beyond_knots
from photogram.network.observations.prior import Prior
from photogram.targets.calibration_result import Calibrated
from photogram.targets.lens_fit import field_of, grid_of_pixels
from photogram.targets.vision import TURNED

__all__ = ["Spline", "spline_lines", "splines"]

HANGS = 0.05
"""Redundancy of a prior below which what it is of comes from it."""


@dataclass(frozen=True)
class Spline:
    """What is to be said of the knots of a splined lens.

    Attributes
    ----------
    camera
        Its name.
    knots
        How many are unknown.
    from_prior, untouched
        Of these, how many come from their prior, and how many no image touches.
    beyond
        The share of the picture beyond the knots; None where its size is not known.
    fov_x_deg
        With which no pixel would be beyond; None where none is.
    """

    camera: str
    knots: int
    from_prior: int
    untouched: int
    beyond: float | None
    fov_x_deg: int | None

    @property
    def lines(self) -> list[str]:
        """The same in sentences."""
        found = [
            f"{self.camera}: {self.from_prior} of {self.knots} knots are from their prior (redundancy below"
            f" {HANGS:g}); {self.untouched} of them no image touches"
            if self.knots
            else f"{self.camera}: its knots are held"
        ]
        if self.fov_x_deg is not None:
            found.append(
                f"{self.camera}: {self.beyond:.1%} of the picture is beyond its knots, where nothing is said"
                f" of its uncertainty; fov_x_deg = {self.fov_x_deg} would do"
            )
        elif self.beyond is not None:
            found.append(f"{self.camera}: the whole picture is within its knots")
        return found


def splines(calibrated: Calibrated) -> list[Spline]:
    """Return what is to be said of each splined lens."""
    found = []
    for number, each in enumerate(calibrated.cameras):
        if each.camera.knots is None:
            continue
        knots = len(each.given.knot_unknowns)
        untouched = knots - _touched(calibrated, number) if knots else 0
        hang = _from_prior(calibrated, number)
        found.append(Spline(each.name, knots, hang, untouched, *_beyond(calibrated, number)))
    return found


def spline_lines(calibrated: Calibrated) -> list[str]:
    """Return sentences on the knots of each splined lens."""
    return [line for each in splines(calibrated) for line in each.lines]


def _from_prior(calibrated: Calibrated, number: int) -> int:
    """Return how many knots of a camera come from their priors."""
    of_knots = {id(each) for each in calibrated.cameras[number].given.knot_unknowns}
    hang = 0
    block = calibrated.result.block
    for kind in calibrated.result.kinds.values():
        for row, own in zip(kind.rows.tolist(), kind.redundancy, strict=True):
            observation = block.observations[row]
            if not (isinstance(observation, Prior) and isinstance(observation.unknown, Knot)):
                continue
            if id(observation.unknown) in of_knots:
                hang += bool(np.nansum(own) / 2 < HANGS)
    return hang


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


def _beyond(calibrated: Calibrated, number: int) -> tuple[float | None, int | None]:
    """Return which share of the picture lies beyond the knots, and the field that would do."""
    size = calibrated.calibration.corners.sizes[number]
    if size is None:
        return None, None
    camera = calibrated.cameras[number].camera
    rays = camera.rays(grid_of_pixels(size))
    share = float(beyond_knots(camera.parameters, rays).mean())
    if not share:
        return share, None
    count = (int(camera.parameters["nx"]), int(camera.parameters["ny"]))
    return share, math.ceil(field_of(rays, count, camera.parameters["order"]))
