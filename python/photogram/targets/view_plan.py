"""Planning of board views before images exist, by their effect on a nominal camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.arguments.arrays import argument_error, whole_number
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.network.cameras import Camera
from photogram.targets.appraisal import median_distance
from photogram.targets.board import Board
from photogram.targets.calibration import Calibration
from photogram.targets.calibration_result import Calibrated
from photogram.targets.corners import Corners
from photogram.targets.first_calibration import weakly_known
from photogram.targets.housing import transformed
from photogram.targets.new_views import Candidate, shown_of
from photogram.targets.regularisation import weighted_block
from photogram.targets.suggestions import GRID, TILTS, suggest_views, views_over_picture, views_towards
from photogram.targets.uncertainty import checked_distance, uncertainty_map
from photogram.targets.view_plan_result import PlannedView, ViewPlan
from photogram.targets.vision import rays
from photogram.targets.worth import Worth
from photogram.words import phrase

__all__ = ["plan_views"]

BOARD_OF_PICTURE = (0.9, 0.6, 0.4)  # ratio of the longer side of the board and the shorter side of the image
FIRST_TILTS = tuple(name for name in TILTS if name)
MODEL = "planned: the lens is taken for one of this model"  # in titles of maps


def plan_views(
    camera: Camera,
    board: Board,
    size: tuple[int, int],
    distances: Sequence[float] = (),
    *,
    sd0: float = 0.3,
    views: int = 12,
    need: float = 0.0,
    away: Sequence[float] = (),
    progress: Callable[[str], None] | None = None,
) -> ViewPlan:
    """Plan views of a board that calibrate a camera, and predict its uncertainty.

    Images are not needed. The first four views show the board in the image centre, tilted to all sides. Each
    further view minimises the largest standard deviation over the image, in the datum `corners`.

    Parameters
    ----------
    camera
        Nominal camera (:func:`nominal_camera`, or a similar calibrated one). Its free parameters are the
        unknowns of the calibration.
    board, size
        The board, and image width and height.
    distances
        Distances of maps, in the unit of the board; views are chosen for the first. None: infinity, and the
        median distance of the views.
    sd0
        Standard deviation of a corner, pixels.
    views
        Maximum number of views.
    need
        Required standard deviation over the image, pixels, at which planning stops.
    away
        Possible board distances, in its unit. None: its longer side covers 0.9, 0.6 and 0.4 of the shorter
        image side.
    progress
        Called with the current step.

    Raises
    ------
    InputError
        If there are fewer than four views, if values are invalid, or if the board is not visible in an image.
    """
    if whole_number("views", views) < len(FIRST_TILTS):
        raise argument_error("views", "least", low=len(FIRST_TILTS), value=views)
    for each in (*distances, *away):
        checked_distance(each)
    report = progress or (lambda _: None)
    board = board.replace(shape=board.shape_of(views))
    centre = (np.array(size) - 1) / 2
    middle, beside = rays(camera, np.stack([centre, centre + np.array([1.0, 0.0])]))
    pixels = float(np.ptp(board.places, axis=0).max() / np.linalg.norm(beside - middle))  # times distance
    held = sorted(away or [pixels / (share * min(size)) for share in BOARD_OF_PICTURE])
    first = [held[len(held) // 2]]
    taken = views_towards(middle, "middle of the picture", board, first, FIRST_TILTS, [""])
    candidates = views_over_picture(camera, size, board, held, whole=board.found_whole)
    worst, largest = (distances or (math.inf,))[0], [math.nan] * (len(FIRST_TILTS) - 1)
    known = weakly_known(camera, size)
    while True:
        found = _predicted(known, board, size, sd0, taken)
        largest.append(float(np.nanmax(uncertainty_map(found, 0, worst, GRID).sd)))
        report(f"view {len(taken)}: largest standard deviation {largest[-1]:.3g} px")
        if len(taken) >= views or largest[-1] <= need:
            break
        taken.append(suggest_views(found, worst, candidates).views[0].candidate)
    maps = [
        uncertainty_map(found, 0, each, model=MODEL)
        for each in distances or (worst, median_distance(found, 0))
    ]
    corners = np.bincount(found.calibration.corners.picture).tolist()
    return ViewPlan(
        calibrated=replace(found, worth=Worth(maps=tuple(maps))),
        views=tuple(map(PlannedView, taken, corners, largest)),
        distance=worst,
        need=need,
    )


def _predicted(
    camera: Camera, board: Board, size: tuple[int, int], sd0: float, views: Sequence[Candidate]
) -> Calibrated:
    shown = [shown_of(camera, np.array(size), transformed(each.pose, board.places)) for each in views]
    for each, (points, _) in zip(views, shown, strict=True):
        if not len(points):
            raise InputError(phrase("targets.not-shown", name=each.name))
    count = len(views)
    corners = Corners(
        pictures=[f"view {number}" for number in range(1, count + 1)],
        cameras=np.zeros(count, dtype=np.int64),
        views=np.arange(count),
        camera_names=["camera"],
        sizes=[size],
        picture=np.repeat(np.arange(count), [len(points) for points, _ in shown]),
        point=np.concatenate([points for points, _ in shown]),
        xy=np.concatenate([xy for _, xy in shown]),
    )
    poses = np.array([each.pose for each in views])
    start = Calibration(board=board, corners=corners, cameras=[camera], poses=poses, sd0=sd0)
    result = adjust(weighted_block(start), unit_variance="unity", covariance="verdict")
    return Calibrated(calibration=start, result=result)
