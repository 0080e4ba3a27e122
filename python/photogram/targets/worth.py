"""What a calibration is worth: maps of uncertainty, what cross-validation says of them, what to do next."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from photogram.errors import InputError, RankError
from photogram.targets.calibrated import Calibrated
from photogram.targets.compared import Difference
from photogram.targets.cross_validated import CrossValidation, Into, cross_validate
from photogram.targets.datums import DatumName
from photogram.targets.housings import housed_with, housing_of
from photogram.targets.maps import UncertaintyMap, distance_text
from photogram.targets.suggestions import Suggestions, suggest_views
from photogram.targets.uncertainty import uncertainty_map

__all__ = ["Asked", "Worth", "median_distance", "model_verdict", "worth"]

FIGURES = 2
"""Significant, of the median distance of boards."""


@dataclass(frozen=True)
class Asked:
    """What is asked of a calibration.

    Attributes
    ----------
    distances
        At which maps are drawn, in the unit of the board; none: infinity, and the boards' median distance.
    datum, noise_only
        Of maps.
    cross_validate
        How views are split; None: they are not.
    suggest
        How many views to take next are looked for.
    grid
        Of maps, pixels across and down.
    """

    distances: Sequence[float] = ()
    datum: DatumName = "corners"
    noise_only: bool = False
    cross_validate: Into | None = "odd"
    suggest: int = 0
    grid: tuple[int, int] = (60, 40)


@dataclass(frozen=True, eq=False, kw_only=True)
class Worth:
    """What a calibration is worth.

    Attributes
    ----------
    maps
        Of each camera at each distance.
    cross
        Cross-validations, one for each housing.
    suggestions
        Views to take next, for the first camera.
    differences
        From another calibration, camera by camera.
    remarks
        What could not be computed, and why.
    """

    maps: tuple[UncertaintyMap, ...] = ()
    cross: tuple[CrossValidation, ...] = ()
    suggestions: tuple[Suggestions, ...] = ()
    differences: tuple[Difference, ...] = ()
    remarks: tuple[str, ...] = field(default=())

    @property
    def largest(self) -> float:
        """Largest standard deviation of all maps where the board was seen, pixels; NaN without maps."""
        return max((each.largest for each in self.maps), default=math.nan)

    @property
    def sentences(self) -> list[str]:
        """What a reader wants first, a line for each thing."""
        said = []
        for camera in dict.fromkeys(each.camera for each in self.maps):
            own = [each for each in self.maps if each.camera == camera]
            largest = ", ".join(
                f"{each.largest:.2g} px {distance_text(each.distance, each.unit)}" for each in own
            )
            said.append(f"{camera}: worst where the board was seen {largest}; {own[0].model}")
        said += [line for each in self.differences for line in each.sentences]
        for each in self.suggestions:
            said += [f"view to take next: {line}" for line in each.sentences]
        return [*said, *self.remarks]


def worth(
    calibrated: Calibrated, asked: Asked | None = None, progress: Callable[[str], None] | None = None
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
    asked = asked or Asked()
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
    calibrated: Calibrated, asked: Asked, told: Callable[[str], None], remarks: list[str]
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
