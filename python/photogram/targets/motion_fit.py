"""Motion between two calibrated cameras, and the remaining image differences.

With the rays r_a of camera a at pixels q and the motion T of the axes,  d(q) = f_b(T d r_a(q)) - q.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.targets.housing import transformed
from photogram.targets.sightings import nearest_rotations
from photogram.targets.vision import imaged, motion_partials, moved_by, rays
from photogram.words import phrase

Criterion = Literal["pixels", "mrcal"]  # squares of pixel differences, or mrcal 2: fourth powers of angles

STEPS = 200
TOLERANCE = 1e-11  # relative to radians and the shortest distance
MIN_PIXELS = 10
HUBER_THETA_SQUARED = np.radians(5.0) ** 2  # the criterion of mrcal increases more slowly beyond


@dataclass(frozen=True, eq=False)
class Fitted:
    """Fitted motion between the axes of two cameras."""

    motion: Floats  # (4, 4) axes of camera a -> axes of camera b
    finite: bool  # whether the translation was fitted: all distances are finite
    points: int  # number of pixels of the fit, counted at every distance


def points_at(camera: Camera, pixels: Floats, distances: Sequence[float]) -> Floats:
    """Return (D n, 3) points on pixel rays at each distance; directions at infinity."""
    towards = rays(camera, pixels)
    return np.concatenate([towards * (each if np.isfinite(each) else 1.0) for each in distances])


def differences_at(a: Camera, b: Camera, fitted: Fitted, pixels: Floats, distance: float) -> Floats:
    """Return (n, 2) d(q) at (n, 2) pixels of camera a; NaN if not visible in both."""
    points = points_at(a, pixels, [distance])
    moved = transformed(fitted.motion, points) if np.isfinite(distance) else points @ fitted.motion[:3, :3].T
    return np.asarray(imaged(b, moved).xy - pixels)


def fitted_motion(
    a: Camera,
    b: Camera,
    pixels: Floats,
    distances: Sequence[float],
    criterion: Criterion = "pixels",
    weights: Floats | None = None,
) -> Fitted:
    """Return the motion that minimises the differences at (n, 2) pixels of camera a.

    Pixels that are not visible in both are ignored. A translation is fitted if all distances are finite; with
    one distance it is arbitrary along the rays. Weights of each pixel are ordered by distance: (D n, 2, 2) W
    of pixel differences, or (D n,) w of the mrcal criterion. NaN excludes a pixel, None means equal weights.
    """
    finite = bool(np.isfinite(distances).all())
    towards = points_at(a, pixels, distances)
    aims, places = (np.concatenate([each] * len(distances)) for each in (rays(b, pixels), pixels))
    if weights is None:
        weights = np.tile(np.eye(2), (len(towards), 1, 1)) if criterion == "pixels" else np.ones(len(towards))
    numbers = np.column_stack([towards, aims, weights.reshape(len(towards), -1)])
    usable = np.isfinite(numbers).all(axis=1)
    if (count := int(np.count_nonzero(usable))) < MIN_PIXELS:
        raise InputError(phrase("targets.few-pixels", count=count, least=MIN_PIXELS))
    towards, aims, places, weights = towards[usable], aims[usable], places[usable], weights[usable]
    motion, free = np.eye(4), slice(0 if finite else 3, 6)
    unit = towards / np.linalg.norm(towards, axis=1)[:, np.newaxis]
    motion[:3, :3] = nearest_rotations((aims.T @ unit)[np.newaxis])[0]
    for _ in range(STEPS):
        moved = transformed(motion, towards)
        by_motion = motion_partials(moved, finite)[:, :, free]
        if criterion == "pixels":
            images = imaged(b, moved)
            known = np.isfinite(images.xy).all(axis=1)
            partials = (images.by_point @ by_motion)[known]
            weighted = (weights[known] @ partials).reshape(-1, partials.shape[2])
            normal = weighted.T @ partials.reshape(weighted.shape)
            right = weighted.T @ (places - images.xy)[known].ravel()
        else:
            normal, right = _angle_step(moved, aims, weights**2, by_motion)
        step = np.zeros(6)
        step[free] = np.linalg.solve(normal, right)
        motion = moved_by(motion, step)
        if np.abs(step[3:]).max() < TOLERANCE and np.abs(step[:3]).max() < TOLERANCE * np.min(distances):
            break
    return Fitted(motion, finite, count)


def _angle_step(moved: Floats, aims: Floats, weights: Floats, by_motion: Floats) -> tuple[Floats, Floats]:
    """Return Newton's equations of sum w^2 rho(theta^4), theta^2 = |u - v|^2.

    For unit vectors u, v with e = theta^2 and D = du, the gradient of e^2 is 4 e D' (u - v). Its second
    derivatives are 8 (D' (u - v))^2 + 4 e D' D, without the curvature of u. Huber: beyond k, e^2 becomes 2 k
    |e| - k^2.
    """
    length = np.linalg.norm(moved, axis=1)
    unit = moved / length[:, np.newaxis]
    across = (np.eye(3) - unit[:, :, np.newaxis] * unit[:, np.newaxis]) / length[:, np.newaxis, np.newaxis]
    turned = across @ by_motion
    apart = unit - aims
    e = (apart**2).sum(axis=1)
    slope = np.einsum("nij,ni->nj", turned, apart)
    inside = e < HUBER_THETA_SQUARED
    level = weights * np.where(inside, e, HUBER_THETA_SQUARED)
    normal = 2 * np.einsum("n,ni,nj->ij", weights * inside, slope, slope)
    normal += np.einsum("n,nki,nkj->ij", level, turned, turned)
    return normal, -np.einsum("n,ni->i", level, slope)
