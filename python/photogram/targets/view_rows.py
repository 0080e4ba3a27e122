"""Observation equations of one view: partials of its images by the common unknowns and by its pose."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.targets.housing import Housing
from photogram.targets.imaging import imaged, motion_partials

__all__ = ["ViewRows", "view_rows"]


@dataclass(frozen=True, eq=False)
class ViewRows:
    """Images of n points in one view.

    Attributes
    ----------
    xy
        (n, 2) images, pixels.
    by_common, by_pose
        (n, 2, c) and (n, 2, 6) partials by the common unknowns and by the step (dt, w) of the pose.
    by_point
        (n, 2, 3) partials by the place of the point on the board.
    """

    xy: Floats
    by_common: Floats
    by_pose: Floats
    by_point: Floats


def view_rows(housing: Housing, pose: Floats, cameras: Indices, points: Indices) -> ViewRows:
    """Return the images of points of the board, each in one of the cameras, and their partials.

    Parameters
    ----------
    housing, pose
        The cameras, and the (4, 4) pose board -> camera 0 of the view.
    cameras, points
        (n,) of each image.
    """
    xy, by_pose, by_point = (np.empty((len(points), 2, *more)) for more in ((), (6,), (3,)))
    by_common = np.zeros((len(points), 2, housing.common))
    turned = housing.points[points] @ pose[:3, :3].T
    for number in np.unique(cameras).tolist():
        own = cameras == number
        turn, shift = housing.sensors[number, :3, :3], housing.sensors[number, :3, 3]
        in_camera = (turned[own] + pose[:3, 3]) @ turn.T
        images = imaged(housing.cameras[number], in_camera + shift)
        in_first = images.by_point @ turn
        xy[own] = images.xy
        by_common[own, :, housing.parameters(number)] = images.by_parameters
        if number:
            by_common[own, :, housing.sensor(number)] = images.by_point @ motion_partials(in_camera)
        by_point[own] = in_first @ pose[:3, :3]
        by_common[own, :, housing.board] = by_point[own] @ housing.points_by_board[points[own]]
        by_pose[own] = in_first @ motion_partials(turned[own])
    return ViewRows(xy, by_common, by_pose, by_point)
