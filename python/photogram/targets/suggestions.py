"""Suggestions for the next view of the board, ranked by the predicted uncertainty map."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import product

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.targets.board import Board
from photogram.targets.calibration_result import Calibrated
from photogram.targets.housing import (
    Housing,
    camera_number,
    housed_with,
    housing_of,
    middle_of,
    size_of,
    transformed,
)
from photogram.targets.maps import image_grid, parts_of
from photogram.targets.new_views import Candidate, Suggestions, best_views, shown_of
from photogram.targets.projection import common_partials, datum_rows, worst
from photogram.targets.uncertainty import checked_distance
from photogram.targets.vision import composed, inverted, rays
from photogram.words import phrase

DISTANCE_QUANTILES = (0.1, 0.5, 0.9)  # of the boards
TILT_DEG, TURN_DEG = 30.0, 90.0
TILTS = {
    "": (0.0, 0.0),
    f"tilted {TILT_DEG:g} degrees about x": (TILT_DEG, 0.0),
    f"tilted {-TILT_DEG:g} degrees about x": (-TILT_DEG, 0.0),
    f"tilted {TILT_DEG:g} degrees about y": (0.0, TILT_DEG),
    f"tilted {-TILT_DEG:g} degrees about y": (0.0, -TILT_DEG),
}
TURNS = {"": 0.0, f"turned by {TURN_DEG:g} degrees": TURN_DEG}
STEPS_TO_MIDDLE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)  # relative distances from the image part to the image centre
GRID = (12, 8)  # pixels across and down


def suggest_views(
    result: Calibrated,
    distance: float = np.inf,
    candidates: Sequence[Candidate] | None = None,
    *,
    camera: int | str = 0,
    views: int = 1,
) -> Suggestions:
    """Suggest views of the board that minimise the largest image uncertainty.

    Parameters
    ----------
    result
        The adjusted calibration. The board has the same size, and corners have the best observed precision.
    distance
        Distance of the uncertainty map, in the unit of the board; infinite: directions.
    candidates
        Possible views. None: the board at 5 x 4 image positions and three observed distances, frontal and
        tilted by 30 degrees, upright and rotated. It is completely visible if detection requires it.
    camera
        Camera of the map: number or name. On a rig, all cameras observe the board.
    views
        Number of views, each chosen in addition to the previous ones.

    Raises
    ------
    InputError
        If the camera does not exist, if the image size is unknown, or if no candidate shows the board.
    """
    number = camera_number(result, camera)
    checked_distance(distance)
    housing, own = housing_of(result, number)
    sizes = np.array([size_of(result, each) for each in housed_with(result, number)])
    pixels = image_grid(size_of(result, number), GRID)[2]
    functions = common_partials(housing, own, pixels, distance, datum_rows(housing, own, "corners"))
    known = np.isfinite(functions).all(axis=(1, 2))
    common = housing.cofactors[: housing.common, : housing.common]
    before = worst(housing.variance * functions[known] @ common @ functions[known].transpose(0, 2, 1))
    if candidates is None:
        candidates = candidate_views(housing, own, size_of(result, number), result.calibration.board)
    found = best_views(
        housing, functions[known], list(candidates), sizes, float(housing.seen.sd.min()), views
    )
    if not found:
        raise InputError(phrase("targets.no-candidate"))
    return Suggestions(
        camera=result.cameras[number].name,
        distance=float(distance),
        unit=result.calibration.board.unit,
        pixels=pixels[known],
        before=before,
        views=tuple(found),
    )


def candidate_views(housing: Housing, camera: int, size: tuple[int, int], board: Board) -> list[Candidate]:
    """Return views at all image parts, three distances, tilts and rotations."""
    away = np.quantile(housing.board_distances(camera), DISTANCE_QUANTILES).tolist()
    to_first = inverted(housing.sensors[camera])
    counts = np.unique(housing.seen.views[housing.seen.cameras == camera], return_counts=True)[1]
    whole = board.found_whole and np.median(counts) == len(housing.points)
    found = views_over_picture(housing.cameras[camera], size, board, away, whole=bool(whole))
    return [Candidate(each.name, to_first @ each.pose) for each in found]


def views_over_picture(
    camera: Camera, size: tuple[int, int], board: Board, distances: Sequence[float], *, whole: bool
) -> list[Candidate]:
    """Return views, board -> camera, with the board centre in each part of the image.

    `distances` are between board centre and camera. A board that must be detected as a `whole` is moved
    towards the image centre until it is completely visible.
    """
    found = []
    steps = STEPS_TO_MIDDLE if whole else STEPS_TO_MIDDLE[:1]
    centre = (np.array(size) - 1) / 2
    for part in parts_of(size):
        tried = rays(camera, np.array([part.middle + step * (centre - part.middle) for step in steps]))
        tried = tried[np.isfinite(tried).all(axis=1)]
        held = zip(*(views_towards(each, part.name, board, distances) for each in tried), strict=True)
        for way in held:
            for view in way:
                places = transformed(view.pose, board.places)
                if not whole or len(shown_of(camera, np.array(size), places)[0]) == len(places):
                    found.append(view)
                    break
    return found


def views_towards(
    towards: Floats,
    place: str,
    board: Board,
    distances: Sequence[float],
    tilts: Collection[str] = TILTS,
    turns: Collection[str] = TURNS,
) -> list[Candidate]:
    """Return views, board -> camera, with the board centre in a direction (3,)."""
    found, middle = [], middle_of(board.places)
    # The shortest rotation from z, the board normal, to the direction
    axis = np.cross([0.0, 0.0, 1.0], towards)
    sine = float(np.linalg.norm(axis))
    vector = axis * np.arctan2(sine, towards[2]) / sine if sine > 0 else axis
    facing = _photocore.vector_rotations(vector[np.newaxis])[0]
    for distance, tilt, turn in product(
        dict.fromkeys(f"{float(f'{each:.2g}'):g}" for each in distances), tilts, turns
    ):
        angles = np.radians([[*TILTS[tilt], 0.0], [0.0, 0.0, TURNS[turn]]])
        tilted, turned = _photocore.vector_rotations(angles)
        rotation = facing @ tilted @ turned
        pose = composed(rotation, float(distance) * towards - rotation @ middle)
        words = (place, f"{distance} {board.unit}", tilt, turn)
        found.append(Candidate(", ".join(filter(None, words)), pose))
    return found
