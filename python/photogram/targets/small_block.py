"""Views of one camera as a block whose object space is the board, whose points are held."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Undetermined
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.targets.sightings import Sightings
from photogram.targets.vision import photo_poses, vision_poses

__all__ = ["Adjusted", "adjusted_views"]

ROUGHLY = 1e-3
"""Of a standard deviation: where steps end of what is only to be begun with."""


@dataclass(frozen=True, eq=False)
class Adjusted:
    """A camera with the poses of its views, adjusted.

    Attributes
    ----------
    camera
        The camera; what was free of it is.
    poses
        (P, 4, 4) board -> camera.
    variance
        The variance of unit weight, px^2.
    is_whole
        Whether all that was free was adjusted, converged, and is more than hardly determined.
    """

    camera: Camera
    poses: Floats
    variance: float
    is_whole: bool


def adjusted_views(
    camera: Camera, seen: Sightings, poses: Floats, tolerance: float = ROUGHLY
) -> Adjusted | None:
    """Adjust a camera and the poses of views; with less of it free where they do not determine all.

    Parameters
    ----------
    camera
        The camera, what is unknown of it free; nothing is where the poses alone are adjusted.
    seen
        The views, their corners in the order of their numbers.
    poses
        (P, 4, 4) board -> camera, to begin with.
    tolerance
        As of :func:`photogram.adjust`.

    Returns
    -------
    What was adjusted; None where the adjustment fails, whatever is held.
    """
    view, point = np.nonzero(np.isfinite(seen.xy[..., 0]))
    positions, attitudes = photo_poses(poses)
    block = Block(
        photo_positions=positions,
        photo_attitudes=attitudes.values("omega_phi_kappa"),
        point_positions=seen.places,
        point_sd=0.0,
        image_photos=view,
        image_points=point,
        image_xy=seen.xy[view, point],
        image_sd=np.repeat(seen.sd[view, point, np.newaxis], 2, axis=1),
        cameras=[camera],
        photo_cameras=0,
    )
    attempts = _less_and_less(camera)
    for free in attempts:
        own = camera.replace(sd=dict.fromkeys(free, math.inf))
        try:
            result = adjust(block.replace(cameras=[own]), covariance=False, tolerance=tolerance)
        except AdjustmentError:
            continue
        if result.status == "diverged":
            continue
        turned = Attitudes.of("omega_phi_kappa", result.photo_attitudes)
        found = vision_poses(result.photo_positions, turned)
        adjusted = result.cameras[0].camera.replace(sd=camera.sd)
        squares, freedom = result.sum_and_freedom
        weak = any(isinstance(each, Undetermined) for each in result.messages)
        whole = free == attempts[0] and result.converged and not weak
        return Adjusted(adjusted, found, squares / max(freedom, 1.0), whole)
    return None


def _less_and_less(camera: Camera) -> Sequence[list[str]]:
    """Return what is free in one attempt after the other: all, then no lens, then no principal point."""
    free = [name for name, sd in zip(camera.names, camera.deviations, strict=True) if sd > 0]
    attempts: list[list[str]] = []
    for kept in ({*free}, {"f", "fx", "fy", "cx", "cy"}, {"f", "fx", "fy"}):
        own = [name for name in free if name in kept]
        if own not in attempts and (own or not free):
            attempts.append(own)
    return attempts
