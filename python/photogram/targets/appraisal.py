"""What a calibration is worth, found: maps, cross-validation, views to take next."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.errors import InputError, RankError
from photogram.targets.calibration_result import Calibrated, Worth, WorthOptions
from photogram.targets.cross_validated import cross_validate
from photogram.targets.cross_validation import CrossValidation
from photogram.targets.housings import housed_with, housing_of
from photogram.targets.maps import UncertaintyMap, distance_text
from photogram.targets.suggestions import suggest_views
from photogram.targets.uncertainty import uncertainty_map

__all__ = ["appraise", "median_distance", "model_verdict"]

FIGURES = 2
"""Significant, of the median distance of boards."""


def appraise(
    calibrated: Calibrated, asked: WorthOptions | None = None, progress: Callable[[str], None] | None = None
) -> Worth:
    """Return what a calibration is worth.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    asked
        What is asked; None: maps and cross-validation.
    progress
        Is told what is computed.

    Raises
    ------
    InputError
        A distance that is not positive.
    OutOfMemoryError, KeyboardInterrupt
        As of the adjustment.
    """
    asked = asked or WorthOptions()
    told = progress or (lambda _: None)
    remarks: list[str] = []
    cross = _cross_validated(calibrated, asked, told, remarks)
    maps: list[UncertaintyMap] = []
    for number, camera in enumerate(calibrated.cameras):
        if calibrated.calibration.corners.sizes[number] is None:
            remarks.append(f"{camera.name}: no map without the size of its pictures (--size WxH)")
            continue
        model = model_verdict(calibrated, number, cross)
        for distance in asked.distances or (math.inf, median_distance(calibrated, number)):
            told(f"map of {camera.name} {distance_text(distance, calibrated.calibration.board.unit)}")
            maps.append(
                uncertainty_map(
                    calibrated,
                    number,
                    distance,
                    asked.grid,
                    datum=asked.datum,
                    noise_only=asked.noise_only,
                    model=model,
                )
            )
    suggestions = []
    if asked.suggest and maps:
        told("views to take next")
        at = maps[0].distance
        suggestions.append(suggest_views(calibrated, at, camera=maps[0].camera, views=asked.suggest))
    return Worth(maps=tuple(maps), cross=tuple(cross), suggestions=tuple(suggestions), remarks=tuple(remarks))


def _cross_validated(
    calibrated: Calibrated, asked: WorthOptions, told: Callable[[str], None], remarks: list[str]
) -> list[CrossValidation]:
    """Return the cross-validation of each housing; what cannot be is told."""
    if asked.cross_validate is None:
        return []
    found = []
    for number, camera in enumerate(calibrated.cameras):
        if housed_with(calibrated, number)[0] != number:
            continue
        try:
            found.append(cross_validate(calibrated, asked.cross_validate, number, progress=told))
        except (InputError, RankError) as error:
            remarks.append(f"{camera.name}: no cross-validation: {error}")
    return found


def model_verdict(calibrated: Calibrated, camera: int, cross: Sequence[CrossValidation]) -> str:
    """Return what is known of the model of a camera's lens: by other views, and by a pattern of residuals."""
    name = calibrated.cameras[camera].name
    own = [each.verdict for each in cross if name in each.cameras]
    said = own or ["model not tested by cross-validation"]
    for test in calibrated.verdict.tests:
        if test.name == f"pattern over the frame of {name}" and not test.accepted:
            said.append("residuals have a pattern over the picture: the map is optimistic")
    return "; ".join(said)


def median_distance(calibrated: Calibrated, camera: int) -> float:
    """Return how far the middle of the board was from a camera in the median view, in two figures."""
    housing, own = housing_of(calibrated, camera)
    views = np.unique(housing.seen.views[housing.seen.cameras == own])
    middle = [*(housing.points.max(axis=0) + housing.points.min(axis=0)) / 2, 1.0]
    places = (housing.sensors[own] @ housing.poses[views] @ middle)[:, :3]
    return float(f"{np.median(np.linalg.norm(places, axis=1)):.{FIGURES}g}")
