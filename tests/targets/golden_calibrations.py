"""Calibrations of an independent program (../shared/data/targets) as arrays of a housing."""

import ast
import base64
import io
from dataclasses import replace
from functools import cache

import given_targets
import numpy as np
from given_targets import NAMES, golden, rig_cofactors

from golden_data import shared
from photogram import Camera, _photocore
from photogram.targets.housing import Housing, SeenCorners, mean_motion
from photogram.targets.vision import composed, motion_partials, of_vectors

VIEWS = 20


@cache
def rig_small():
    """Return two cameras of eight parameters each, 20 views of a board whose points have weights."""
    data = golden("rig_small")
    found, seen = data["points"], rig_corners()
    whole = rig_cofactors()
    common = whole.shape[0] - 6 * VIEWS
    poses = composed(found["R"], found["t"])
    to_motion = np.zeros((common + 6, len(whole)))
    to_motion[:common, :common] = np.eye(common)
    to_motion[common:, common:] = np.concatenate(mean_motion(poses), axis=1)
    points = np.array(found["board"])
    weights = np.zeros((common, common))
    weights[22:, 22:] = np.diag(1 / np.tile(data["board"]["point_sd"], len(points)) ** 2)
    return Housing(
        cameras=tuple(
            Camera("opencv", dict(zip(NAMES, each, strict=True)), sd=np.inf) for each in found["cameras"]
        ),
        sensors=np.stack([np.eye(4), composed(found["sensor1"]["R"], found["sensor1"]["t"])]),
        poses=poses,
        points=points,
        points_by_board=np.eye(3 * len(points)).reshape(len(points), 3, -1),
        seen=seen,
        cofactors=to_motion @ whole @ to_motion.T,
        weights=weights,
        variance=1.0,
    )


@cache
def rig_corners():
    """Return the corners of both cameras."""
    corners = np.array(golden("rig_small")["corners"])
    views, cameras, points = corners[:, :3].astype(np.int64).T
    return SeenCorners(cameras, views, points, corners[:, 3:5], 0.3 * 2.0 ** corners[:, 5])


@cache
def stored(name):
    """Return the inputs of a calibration of mrcal, which are in its file: base 85 of the bytes of a NPZ."""
    text = shared("targets", f"{name}.cameramodel").read_text()
    content = ast.literal_eval(text)["optimization_inputs"]
    return dict(np.load(io.BytesIO(base64.b85decode(content)), allow_pickle=False))


@cache
def opencv8():
    """Return the wide lens of mrcal at its optimum with regularisation; poses once more from the corners."""
    given, found = stored("opencv8-0"), golden("mrcal_opencv8")["with_regularisation"]
    names = list(found["intrinsics"])
    camera = Camera("opencv_pinhole", found["intrinsics"], sd=dict.fromkeys(names, np.inf))
    observed = given["observations_board"].reshape(len(given["observations_board"]), -1, 3)
    views, points = np.nonzero(observed[:, :, 2] > 0)
    rows = observed[views, points]
    points_by_board = bent(*given["observations_board"].shape[1:3])
    spacing = float(given["calibration_object_spacing"])
    board = grid(*given["observations_board"].shape[1:3], spacing) + points_by_board @ found["board_bend"]
    seen = SeenCorners(np.zeros_like(views), views, points, rows[:, :2], 1 / rows[:, 2])
    frames = given["frames_rt_toref"]
    poses = of_vectors(frames)
    scale = found["regularisation_scale"]
    sd = dict.fromkeys(names[4:9], 1 / scale["lens"])
    sd |= dict.fromkeys(names[9:], 1 / scale["denominator"])
    sd |= dict.fromkeys(("cx", "cy"), 1 / scale["centre"])
    weights = np.diag([*(1 / sd[name] ** 2 if name in sd else 0.0 for name in names), 0.0, 0.0])
    given = Housing(
        (camera,), np.eye(4)[np.newaxis], poses, board, points_by_board, seen, np.zeros((20, 20)), weights
    )
    moved = dense(given)[1]
    poses = np.stack(
        [
            composed(
                _photocore.vector_rotations(step[np.newaxis, 3:])[0] @ each[:3, :3], each[:3, 3] + step[:3]
            )
            for step, each in zip(moved, poses, strict=True)
        ]
    )
    housing = replace(given, poses=poses, variance=found["sigma_mrcal"] ** 2)
    return replace(housing, cofactors=dense(housing)[0])


def grid(rows, columns, spacing):
    """Return the points of a chessboard."""
    places = np.arange(rows * columns)
    return spacing * np.column_stack([places % columns, places // columns, np.zeros_like(places)])


def bent(rows, columns):
    """Return what two parabolas, 4 a (1 - a) and 4 b (1 - b), do to the points of a board."""
    places = np.arange(rows * columns)
    a, b = places % columns / (columns - 1), places // columns / (rows - 1)
    found = np.zeros((rows * columns, 3, 2))
    found[:, 2] = np.column_stack([4 * a * (1 - a), 4 * b * (1 - b)])
    return found


def dense(housing):
    """Return cofactors by normal equations of views, one by one, and (V, 6) steps of the poses alone."""
    poses, normal = housing.poses, housing.weights.copy()
    mean = mean_motion(poses)
    inverse, across, steps = [], [], []
    for view in range(len(poses)):
        by_common, by_pose, misclosure = rows_of_view(housing, view)
        own = np.linalg.inv(by_pose.T @ by_pose)
        mixed = by_pose.T @ by_common
        normal += by_common.T @ by_common - mixed.T @ own @ mixed
        inverse.append(own)
        across.append(-own @ mixed)
        steps.append(own @ by_pose.T @ misclosure)
    cofactors = np.linalg.inv(normal)
    to_mean = np.einsum("vij,vjk->ik", mean, np.array(across))
    both = np.vstack([np.eye(len(cofactors)), to_mean])
    found = both @ cofactors @ both.T
    found[-6:, -6:] += np.einsum("vij,vjk,vlk->il", mean, np.array(inverse), mean)
    return found, np.array(steps)


def rows_of_view(housing, view):
    """Return whitened partials by the common unknowns and by the pose of a view; observed less computed."""
    seen, own = housing.seen, housing.seen.views == view
    pose, points, cameras = housing.poses[view], seen.points[own], seen.cameras[own]
    turned = housing.points[points] @ pose[:3, :3].T
    each = [housing.linearized(camera, turned + pose[:3, 3]) for camera in range(len(housing.cameras))]
    xy, by_point, by_common = (
        np.stack(parts)[cameras, np.arange(len(points))] for parts in zip(*each, strict=True)
    )
    by_pose = by_point @ motion_partials(turned)
    by_common[:, :, housing.board] = by_point @ pose[:3, :3] @ housing.points_by_board[points]
    sd = seen.sd[own, np.newaxis]
    return (
        (by_common / sd[:, :, np.newaxis]).reshape(-1, housing.common),
        (by_pose / sd[:, :, np.newaxis]).reshape(-1, 6),
        ((seen.xy[own] - xy) / sd).ravel(),
    )


@cache
def adjusted_rig():
    """Return the simulated rig as the package adjusts it, from its true values."""
    return given_targets.rig_small().adjust()
