"""Which views of a board to take before there is a picture: by what each adds to a nominal camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.arguments.annotations import check_arguments
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

BOARD_OF_PICTURE = (0.9, 0.6, 0.4)  # longer side of the board over the shorter side of the picture
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
    """Plan the views of a board that calibrate a camera, and predict its uncertainty; without any picture.

    The first four show the board in the middle of the picture, tilted to all sides. Each further one is that
    of which the largest standard deviation over the picture becomes smallest, in the datum `corners`.

    Parameters
    ----------
    camera
        The nominal one (:func:`nominal_camera`, or one like it that has been calibrated): what is free in it
        is what the calibration would find.
    board, size
        The board, and width and height of the pictures.
    distances
        Of maps, in the unit of the board; views are chosen for the first. None: infinity, and the median
        distance of the views.
    sd0
        Standard deviation of a corner, pixels.
    views
        How many there are at the most.
    need
        The largest standard deviation over the picture, pixels, with which no further view is planned.
    away
        Distances at which the board may be held, in its unit. None: those at which its longer side takes 0.9,
        0.6 and 0.4 of the shorter side of the picture.
    progress
        Is told what is computed.

    Raises
    ------
    InputError
        Fewer than four views, values that are none, a board that the picture cannot show.
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
    """Return what views would give: the calibration by their corners, which have no errors."""
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


check_arguments(globals(), __all__)
