"""Projection uncertainty of points fixed to the housing of a camera.

Let K and Pi be the partials of the image point by the camera parameters k and by the point p = d r(q). With G
= (I, -[p]x),  dq = K dk + Pi G tau,  Q_q = J Q J'.  A calibration moves its own axes. The datum is a matrix
T. It defines the motion tau = T db, (dt, w), of the camera axes for a change db of the unknowns.
"""

from __future__ import annotations

from typing import get_args

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.types import Floats
from photogram.network.cameras import Camera
from photogram.targets.housing import Housing
from photogram.targets.options import DatumName
from photogram.targets.vision import (
    cross_matrices,
    has_unknown_knots,
    imaged,
    motion_partials,
    rays,
    touched,
    unknown_of,
)

POINTS_PER_BATCH = 4096


def datum_rows(
    housing: Housing, camera: int, datum: DatumName, fixed: tuple[Floats, Floats, bool] | None = None
) -> Floats:
    """Return (6, c + 6) T of a camera by the name of a datum.

    For `image`, `fixed` contains (n, 3) fixed points in camera axes, their (n, 2, 2) weights W, and whether
    they are at finite distances.
    """
    one_of("datum", datum, get_args(DatumName))
    found = np.zeros((6, housing.common + 6))
    own = housing.parameters(camera)
    if datum == "corners":
        if camera not in (fixing := housing.fixing_corners):
            places, sd = housing.places(camera)
            weights = np.eye(2) / sd[:, np.newaxis, np.newaxis] ** 2
            fixing[camera] = fixed_points(housing.cameras[camera], places, weights)
        found[:, own] = fixing[camera]
    elif datum == "image" and fixed is not None:
        found[:, own] = fixed_points(housing.cameras[camera], *fixed)
    elif datum == "mean-frames":
        turn, shift = housing.sensors[camera, :3, :3], housing.sensors[camera, :3, 3]
        # p' = R p + t:  R (dt + w x p) + dt_s + w_s x R p  with R p = p' - t.
        about = np.eye(6)
        about[:3, 3:] = cross_matrices(shift)
        found[:, housing.mean_motion] = about @ np.kron(np.eye(2), turn)
        if camera:
            found[:, housing.sensor(camera)] = about
    return found


def fixed_points(camera: Camera, points: Floats, weights: Floats, finite: bool = True) -> Floats:
    """Return (6, p) T that minimises image shifts of points for parameter changes.

    T = -(sum G' Pi' W Pi G)^-1 sum G' Pi' W K. The (n, 3) points are in camera axes, W are their (n, 2, 2)
    image weights. The translation is omitted for points at infinity, if not `finite`.
    """
    normal, right = np.zeros((6, 6)), np.zeros((6, np.count_nonzero(unknown_of(camera))))
    for start in range(0, len(points), POINTS_PER_BATCH):
        part = slice(start, start + POINTS_PER_BATCH)
        images = (touched if has_unknown_knots(camera) else imaged)(camera, points[part])
        by_motion = images.by_point @ motion_partials(points[part], finite)
        weighted = weights[part] @ by_motion
        normal += weighted.reshape(-1, 6).T @ by_motion.reshape(-1, 6)
        if images.columns is not None:
            products = weighted.transpose(0, 2, 1) @ images.by_parameters
            columns = images.columns.ravel()
            for row, own in enumerate(right):
                own += np.bincount(columns, products[:, row].ravel(), minlength=len(own))
        else:
            right += weighted.reshape(-1, 6).T @ images.by_parameters.reshape(2 * len(weighted), -1)
    return _moved_back(normal, right, finite)


def housing_rows(housing: Housing) -> Floats:
    """Return (6, c + 6) T_rig: the motion of camera 0 that fixes the corners of all."""
    normal, right = np.zeros((6, 6)), np.zeros((6, housing.common + 6))
    for number, camera in enumerate(housing.cameras):
        places, sd = housing.places(number)
        turn, shift = housing.sensors[number, :3, :3], housing.sensors[number, :3, 3]
        for start in range(0, len(places), POINTS_PER_BATCH):
            part = slice(start, start + POINTS_PER_BATCH)
            images = imaged(camera, places[part])
            by_point = images.by_point / sd[part, np.newaxis, np.newaxis]
            turned = places[part] - shift  # R_s p
            by_motion = (by_point @ turn @ motion_partials(turned @ turn)).reshape(-1, 6)
            normal += by_motion.T @ by_motion
            own = images.by_parameters / sd[part, np.newaxis, np.newaxis]
            right[:, housing.parameters(number)] += by_motion.T @ own.reshape(len(by_motion), -1)
            if number:
                by_sensor = (by_point @ motion_partials(turned)).reshape(-1, 6)
                right[:, housing.sensor(number)] += by_motion.T @ by_sensor
    return _moved_back(normal, right, True)


def _moved_back(normal: Floats, right: Floats, finite: bool) -> Floats:
    """Return -N^-1 B, without translation for points at infinity."""
    found = np.zeros_like(right)
    free = slice(0 if finite else 3, 6)
    found[free] = -np.linalg.solve(normal[free, free], right[free])
    return found


PIXELS_PER_BATCH = 2048


def projection_cofactors(
    housing: Housing, camera: int, pixels: Floats, distance: float, rows: Floats
) -> Floats:
    """Return (n, 2, 2) cofactors of projections at (n, 2) pixels; NaN if undefined.

    The distance is from the centre of this camera, infinite for directions; `rows` are (6, c + 6) of the
    datum (:func:`datum_rows`).
    """
    own, unknowns, moved = housing.cameras[camera], housing.parameters(camera), rows @ housing.cofactors
    across = moved[:, unknowns]  # of the axis motion and the camera parameters
    cofactors = np.block([[housing.cofactors[unknowns, unknowns], across.T], [across, moved @ rows.T]])
    found = np.empty((len(pixels), 2, 2))
    for start in range(0, len(pixels), PIXELS_PER_BATCH):
        part = pixels[start : start + PIXELS_PER_BATCH]
        if has_unknown_knots(own):
            values = _of_touched(own, part, distance, cofactors)
        else:
            values = of_functions(image_partials(own, part, distance), cofactors)
        found[start : start + PIXELS_PER_BATCH] = values
    return found


def _of_touched(camera: Camera, pixels: Floats, distance: float, cofactors: Floats) -> Floats:
    """Return (n, 2, 2) cofactors J Q J' of projections by a splined lens."""
    finite = bool(np.isfinite(distance))
    points = rays(camera, pixels) * (distance if finite else 1.0)
    images = touched(camera, points)
    by_motion = images.by_point @ motion_partials(points, finite)
    motion = np.broadcast_to(np.arange(len(cofactors) - 6, len(cofactors)), (len(points), 6))
    assert images.columns is not None
    columns = np.hstack([images.columns, motion])
    partials = np.concatenate([images.by_parameters, by_motion], axis=2)
    own = cofactors[columns[:, :, np.newaxis], columns[:, np.newaxis]]
    return np.asarray(partials @ own @ partials.transpose(0, 2, 1))


def common_partials(housing: Housing, camera: int, pixels: Floats, distance: float, rows: Floats) -> Floats:
    """Return (n, 2, c) J by the common unknowns, in a datum independent of views."""
    partials = image_partials(housing.cameras[camera], pixels, distance)
    found = partials[:, :, -6:] @ rows[:, : housing.common]
    found[:, :, housing.parameters(camera)] += partials[:, :, :-6]
    return np.asarray(found)


def image_partials(camera: Camera, pixels: Floats, distance: float) -> Floats:
    """Return (n, 2, p + 6) J = (K, Pi G) of points at (n, 2) pixels and a distance."""
    finite = bool(np.isfinite(distance))
    return point_partials(camera, rays(camera, pixels) * (distance if finite else 1.0), finite)


def point_partials(camera: Camera, points: Floats, finite: bool) -> Floats:
    """Return (n, 2, p + 6) J = (K, Pi G) of (n, 3) points or directions."""
    images = imaged(camera, points)
    return np.concatenate([images.by_parameters, images.by_point @ motion_partials(points, finite)], axis=2)


def of_functions(partials: Floats, cofactors: Floats) -> Floats:
    """Return (n, 2, 2) J Q J' of (n, 2, u) partials."""
    whole = (partials.reshape(-1, partials.shape[2]) @ cofactors).reshape(partials.shape)
    return np.asarray(whole @ partials.transpose(0, 2, 1))


def worst(covariances: Floats) -> Floats:
    """Return (n,) worst-direction standard deviations of (n, 2, 2) covariances.

    sqrt((a + c)/2 + sqrt(((a - c)/2)^2 + b^2)) of [a b; b c].
    """
    a, b, c = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    return np.asarray(np.sqrt((a + c) / 2 + np.hypot((a - c) / 2, b)))
