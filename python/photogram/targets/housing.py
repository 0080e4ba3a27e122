"""Calibrated cameras of one housing: values, cofactors, observed corners, and projection uncertainty.

Uncertainty maps, differences, new views and triangulation are computed from these arrays. Steps are R <-
Exp(w) R, t <- t + dt.

Projections are of points fixed to the housing. Let K and Pi be the partials of the image point by the camera
parameters k and by the point p = d r(q). With G = (I, -[p]x),  dq = K dk + Pi G tau,  Q_q = J Q J'.  A
calibration moves its own axes. The datum is a matrix T. It defines the motion tau = T db, (dt, w), of the
camera axes for a change db of the unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, get_args

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import unknown_name
from photogram.network.cameras import Camera
from photogram.targets.options import DatumName
from photogram.targets.vision import (
    cross_matrices,
    imaged,
    motion_partials,
    points_at,
    sensor_steps,
    touched,
    transformed,
    unknown_of,
)
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated


@dataclass(frozen=True, eq=False)
class SeenCorners:
    """Adjusted corners (m) of the cameras in a housing."""

    cameras: Indices  # (m,) camera, board point and view of each corner
    views: Indices
    points: Indices
    xy: Floats  # (m, 2) pixels
    sd: Floats  # (m,) standard deviations a priori, pixels
    # (m, 4, 4) board -> camera at the time of each corner; None: all cameras use the pose of the view
    poses: Floats | None = None


@dataclass(frozen=True, eq=False)
class Housing:
    """K cameras fixed to one another, with values and cofactors.

    The c common unknowns start with the estimated parameters and knots of each camera. The sensor (dt, w) of
    each but the first camera follows, then the unknowns of the board.
    """

    cameras: tuple[Camera, ...]  # adjusted; parameters with a standard deviation were unknown
    sensors: Floats  # (K, 4, 4) camera 0 -> camera k; the first is the identity
    poses: Floats  # (V, 4, 4) board -> camera 0, of each view
    points: Floats  # (n, 3) adjusted points of the board
    points_by_board: Floats  # (n, 3, b) partials by the unknowns of the board
    seen: SeenCorners
    # (c + 6, c + 6) of the common unknowns and of the mean motion of the boards (:func:`mean_motion`), for a
    # priori unit weight
    cofactors: Floats
    weights: Floats  # (c, c) prior weights of the common unknowns: inverse covariances, 0 without
    variance: float = 1.0  # of unit weight: covariances are cofactors times this

    @property
    def common(self) -> int:
        return len(self.weights)

    @property
    def mean_motion(self) -> slice:
        return slice(self.common, self.common + 6)

    @property
    def board(self) -> slice:
        return slice(self.common - self.points_by_board.shape[2], self.common)

    @cached_property
    def fixing_corners(self) -> dict[int, Floats]:
        """(6, p) T that fixes the observed corners of each camera, as far as computed."""
        return {}

    def parameters(self, camera: int) -> slice:
        counts = [np.count_nonzero(unknown_of(each)) for each in self.cameras]
        start = sum(counts[:camera])
        return slice(start, start + counts[camera])

    def sensor(self, camera: int) -> slice:
        end = self.parameters(len(self.cameras) - 1).stop + 6 * camera
        return slice(end - 6 if camera else end, end)

    def noise_only(self) -> Housing:
        to_common = self.cofactors[:, : self.common]
        return replace(self, cofactors=self.cofactors - to_common @ self.weights @ to_common.T)

    def linearized(self, camera: int, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (n, 2) projections by a camera of (n, 3) points in axes of camera 0.

        The partials are by these points, (n, 2, 3), and by the common unknowns, (n, 2, c), 0 for the board.
        """
        turn, shift = self.sensors[camera, :3, :3], self.sensors[camera, :3, 3]
        turned = points @ turn.T
        images = imaged(self.cameras[camera], turned + shift)
        by_common = np.zeros((len(points), 2, self.common))
        by_common[:, :, self.parameters(camera)] = images.by_parameters
        if camera:
            by_common[:, :, self.sensor(camera)] = images.by_point @ motion_partials(turned)
        return images.xy, images.by_point @ turn, by_common

    def places(self, camera: int) -> tuple[Floats, Floats]:
        """Return (m, 3) corners of a camera in its axes, and (m,) their sd in pixels."""
        seen, own = self.seen, self.seen.cameras == camera
        poses = (self.sensors[camera] @ self.poses)[seen.views] if seen.poses is None else seen.poses
        return transformed(poses[own], self.points[seen.points[own]]), seen.sd[own]

    def board_distances(self, camera: int) -> Floats:
        """Return (v,) distances of board centre and camera in its views."""
        views = np.unique(self.seen.views[self.seen.cameras == camera])
        places = (self.sensors[camera] @ self.poses[views] @ [*middle_of(self.points), 1.0])[:, :3]
        return np.asarray(np.linalg.norm(places, axis=1))


def middle_of(points: Floats) -> Floats:
    return np.asarray((points.max(axis=0) + points.min(axis=0)) / 2)


def mean_motion(poses: Sequence[Floats] | Floats) -> Floats:
    """Return (V, 6, 6) partials of the mean board motion by pose steps (dt_i, w_i).

    A board point p at p - t_i moves by dt_i + w_i x (p - t_i). The mean over the views is the motion (1/V)
    sum (dt_i + [t_i]x w_i, w_i) of all p.
    """
    moved = np.asarray(poses)
    found = np.tile(np.eye(6), (len(moved), 1, 1))
    found[:, :3, 3:] = cross_matrices(moved[:, :3, 3])
    return found / len(moved)


def camera_number(calibrated: Calibrated, camera: int | str) -> int:
    """Return the number of a camera by number or name; InputError if it does not exist."""
    names = [each.name for each in calibrated.cameras]
    if isinstance(camera, str) and camera in names:
        return names.index(camera)
    if isinstance(camera, str) or not 0 <= camera < len(names):
        raise InputError(unknown_name("camera", str(camera), names))
    return camera


def size_of(calibrated: Calibrated, camera: int) -> tuple[int, int]:
    """Return image width and height of a camera; InputError if they are unknown."""
    size = calibrated.calibration.corners.sizes[camera]
    if size is None:
        name = calibrated.cameras[camera].name
        raise InputError(phrase("targets.no-size", camera=name))
    return size


def housing_of(calibrated: Calibrated, camera: int = 0) -> tuple[Housing, int]:
    cameras = housed_with(calibrated, camera)
    made = calibrated._housings
    if cameras[0] not in made:
        corners = calibrated.calibration.corners
        views = np.unique(corners.views[np.isin(corners.cameras, cameras)])
        poses, block = calibrated.poses[views], calibrated.block
        rows, count = _board_rows(calibrated), len(calibrated.points)
        by_points = np.zeros((count, 3, len(rows), 3))
        by_points[rows, :, np.arange(len(rows))] = np.eye(3)
        by_board = by_points.reshape(count, 3, -1)
        if calibrated.bend is not None:
            by_board = calibrated.calibration.board.shifts().transpose(0, 2, 1)
        used = calibrated.used_images & np.isin(corners.cameras[block.image_photos], cameras)
        used &= calibrated.image_weights > 0
        photos = block.image_photos[used]
        seen = SeenCorners(
            cameras=np.argsort(cameras)[np.searchsorted(np.sort(cameras), corners.cameras[photos])],
            views=np.searchsorted(views, corners.views[photos]),
            points=block.image_points[used],
            xy=block.image_xy[used],
            sd=block.image_sd[used, 0] / np.sqrt(calibrated.image_weights[used]),
            poses=calibrated.picture_poses[photos],
        )
        made[cameras[0]] = Housing(
            cameras=tuple(calibrated.cameras[each].camera for each in cameras),
            sensors=calibrated.sensors[cameras],
            poses=poses,
            points=calibrated.points,
            points_by_board=by_board,
            seen=seen,
            cofactors=_cofactors(calibrated, cameras, views, poses, by_board.shape[2]),
            weights=_weights(calibrated, cameras),
            variance=calibrated.covariance_scale,
        )
    return made[cameras[0]], cameras.index(camera)


def housed_with(calibrated: Calibrated, camera: int) -> list[int]:
    """Return the cameras tied to one, including itself, reference first."""
    references = np.asarray(calibrated.calibration.references)
    reference = int(references[camera])
    others = np.flatnonzero((references == reference) & (np.arange(len(references)) != reference))
    return [reference, *others.tolist()]


def _board_rows(calibrated: Calibrated) -> list[int]:
    if calibrated.calibration.shape != "points":
        return []
    return np.flatnonzero(calibrated.used_points).tolist()


def _cofactors(
    calibrated: Calibrated, cameras: list[int], views: Indices, poses: Floats, board: int
) -> Floats:
    given = calibrated.block.cameras
    lengths = [len(each.names) + 2 * len(each.knot_unknowns) for each in given]
    starts = np.concatenate([[0], np.cumsum(lengths)])
    kept = [starts[each] + np.flatnonzero(unknown_of(calibrated.cameras[each].camera)) for each in cameras]
    sensors = calibrated.sensors_adjusted()
    kept += [starts[-1] + 6 * sensors.index(each) + np.arange(6) for each in cameras[1:]]
    kept.append(starts[-1] + 6 * len(sensors) + np.arange(board))
    columns = np.concatenate(kept)
    before = starts[-1] + 6 * len(sensors) + board
    partials = np.zeros((len(columns) + 6, before + 6 * len(calibrated.poses)))
    partials[np.arange(len(columns)), columns] = 1.0
    for view, each in zip(views.tolist(), mean_motion(poses), strict=True):
        partials[len(columns) :, before + 6 * view : before + 6 * view + 6] = each
    parts = ("cameras", "sensors", *(("board",) if board else ()), "views")
    return calibrated.combined(partials, parts)


def _weights(calibrated: Calibrated, cameras: list[int]) -> Floats:
    block, rows = calibrated.block, _board_rows(calibrated)
    blocks = []
    for number in cameras:
        camera = block.cameras[number]
        sd = camera.deviations
        weighted = np.isfinite(sd[sd > 0])
        own = np.diag(np.where(weighted, 1 / sd[sd > 0] ** 2, 0.0))
        covariance = camera.prior_covariance
        if covariance is not None:
            own[np.ix_(weighted, weighted)] = np.linalg.inv(covariance)
        knots = [knot.covariance for knot in camera.knot_unknowns if np.any(knot.sd)]
        blocks += [own, *(np.zeros((2, 2)) if each is None else np.linalg.inv(each) for each in knots)]
    for number in cameras[1:]:  # observations of sensors, by their steps dt, w
        back = np.linalg.inv(sensor_steps(calibrated.sensors[number]))
        weights = np.diag(1 / np.asarray(calibrated.calibration.sd_sensors)[number] ** 2)
        blocks.append(back.T @ weights @ back)
    points = np.diag(1 / block.point_sd[rows].ravel() ** 2)
    bend = np.diag(1 / np.asarray(calibrated.calibration.sd_bend) ** 2)
    blocks.append(points if calibrated.bend is None else bend)
    found = np.zeros((sum(map(len, blocks)),) * 2)
    start = 0
    for own in blocks:
        found[start : start + len(own), start : start + len(own)] = own
        start += len(own)
    return found


POINTS_PER_BATCH = 4096


def datum_rows(housing: Housing, camera: int, datum: DatumName) -> Floats:
    """Return (6, c + 6) T of a camera by the name of a datum; 0 for `image`, which depends on a distance."""
    one_of("datum", datum, get_args(DatumName))
    found = np.zeros((6, housing.common + 6))
    own = housing.parameters(camera)
    if datum == "corners":
        if camera not in (fixing := housing.fixing_corners):
            places, sd = housing.places(camera)
            weights = np.eye(2) / sd[:, np.newaxis, np.newaxis] ** 2
            fixing[camera] = fixed_points(housing.cameras[camera], places, weights)
        found[:, own] = fixing[camera]
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
        images = (touched if np.any(camera.knot_sd) else imaged)(camera, points[part])
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
    finite, found = bool(np.isfinite(distance)), np.empty((len(pixels), 2, 2))
    for start in range(0, len(pixels), PIXELS_PER_BATCH):
        part = slice(start, start + PIXELS_PER_BATCH)
        points = points_at(own, pixels[part], [distance])
        if not np.any(own.knot_sd):
            found[part] = of_functions(point_partials(own, points, finite), cofactors)
            continue
        images = touched(own, points)
        assert images.columns is not None
        motion = np.broadcast_to(np.arange(len(cofactors) - 6, len(cofactors)), (len(points), 6))
        columns = np.hstack([images.columns, motion])
        partials = np.concatenate(
            [images.by_parameters, images.by_point @ motion_partials(points, finite)], 2
        )
        touching = cofactors[columns[:, :, np.newaxis], columns[:, np.newaxis]]
        found[part] = partials @ touching @ partials.transpose(0, 2, 1)
    return found


def common_partials(housing: Housing, camera: int, pixels: Floats, distance: float, rows: Floats) -> Floats:
    """Return (n, 2, c) J by the common unknowns, in a datum independent of views."""
    own = housing.cameras[camera]
    partials = point_partials(own, points_at(own, pixels, [distance]), bool(np.isfinite(distance)))
    found = partials[:, :, -6:] @ rows[:, : housing.common]
    found[:, :, housing.parameters(camera)] += partials[:, :, :-6]
    return np.asarray(found)


def point_partials(camera: Camera, points: Floats, finite: bool | Bools) -> Floats:
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
