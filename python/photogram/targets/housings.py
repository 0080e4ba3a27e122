"""From adjusted calibrations to the arrays that their products are computed from."""

from __future__ import annotations

from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from photogram.arguments.arrays import shown
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.targets.housing import Housing, SeenCorners, mean_motion
from photogram.targets.vision import sensor_steps, unknown_of

if TYPE_CHECKING:
    from photogram.targets import Calibrated


def camera_number(calibrated: Calibrated, camera: int | str) -> int:
    """Return the number of a camera by its number or name; an InputError where there is no such one."""
    names = [each.name for each in calibrated.cameras]
    if isinstance(camera, str) and camera in names:
        return names.index(camera)
    if isinstance(camera, str) or not 0 <= camera < len(names):
        raise InputError(f"the calibration has the cameras {', '.join(names)}, not {shown(camera)}")
    return camera


def size_of(calibrated: Calibrated, camera: int) -> tuple[int, int]:
    """Return width and height of the pictures of a camera; an InputError where nobody has said."""
    size = calibrated.calibration.corners.sizes[camera]
    if size is None:
        name = calibrated.cameras[camera].name
        raise InputError(f"how large the pictures of {name} are is not known: a map needs their size")
    return size


_HOUSINGS: WeakKeyDictionary[Calibrated, dict[int, Housing]] = WeakKeyDictionary()


def housing_of(calibrated: Calibrated, camera: int = 0) -> tuple[Housing, int]:
    """Return the housing of a camera, and the camera's number in it."""
    cameras = housed_with(calibrated, camera)
    made = _HOUSINGS.setdefault(calibrated, {})
    if cameras[0] not in made:
        corners = calibrated.calibration.corners
        views = np.unique(corners.views[np.isin(corners.cameras, cameras)])
        poses, by_board = calibrated.poses[views], _points_by_board(calibrated)
        made[cameras[0]] = Housing(
            cameras=tuple(calibrated.cameras[each].camera for each in cameras),
            sensors=calibrated.sensors[cameras],
            poses=poses,
            points=calibrated.points,
            points_by_board=by_board,
            seen=_seen(calibrated, cameras, views),
            cofactors=_cofactors(calibrated, cameras, views, poses, by_board.shape[2]),
            weights=_weights(calibrated, cameras),
            variance=calibrated.result.covariance_scale,
        )
    return made[cameras[0]], cameras.index(camera)


def housed_with(calibrated: Calibrated, camera: int) -> list[int]:
    """Return the cameras that are tied to one, the reference first, with itself among them."""
    references = np.asarray(calibrated.calibration.references)
    reference = int(references[camera])
    others = np.flatnonzero((references == reference) & (np.arange(len(references)) != reference))
    return [reference, *others.tolist()]


def _board_rows(calibrated: Calibrated) -> list[int]:
    """Return the points of the board that are unknowns."""
    if calibrated.calibration.shape != "points":
        return []
    return np.flatnonzero(calibrated.result.used_points).tolist()


def _points_by_board(calibrated: Calibrated) -> Floats:
    if calibrated.bend is not None:
        return calibrated.calibration.board.shifts().transpose(0, 2, 1)
    rows = _board_rows(calibrated)
    found = np.zeros((len(calibrated.points), 3, len(rows), 3))
    found[rows, :, np.arange(len(rows))] = np.eye(3)
    return found.reshape(len(found), 3, -1)


def _seen(calibrated: Calibrated, cameras: list[int], views: Indices) -> SeenCorners:
    """Return the corners that took part; views and cameras are numbered within the housing."""
    result, corners = calibrated.result, calibrated.calibration.corners
    block = result.block
    used = result.used_images & np.isin(corners.cameras[block.image_photos], cameras)
    used &= result.image_weights > 0
    photos = block.image_photos[used]
    return SeenCorners(
        cameras=np.array([cameras.index(each) for each in corners.cameras[photos].tolist()], dtype=np.int64),
        views=np.searchsorted(views, corners.views[photos]),
        points=block.image_points[used],
        xy=block.image_xy[used],
        sd=block.image_sd[used, 0] / np.sqrt(result.image_weights[used]),
        poses=calibrated.picture_poses[photos],
    )


def _cofactors(
    calibrated: Calibrated, cameras: list[int], views: Indices, poses: Floats, board: int
) -> Floats:
    """Return the cofactors of common unknowns, `board` of them of the board, and of its mean motion."""
    given = calibrated.result.block.cameras
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
    """Return the inverse covariances of what was known before: of cameras, sensors, points and the bend."""
    block, rows = calibrated.result.block, _board_rows(calibrated)
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
