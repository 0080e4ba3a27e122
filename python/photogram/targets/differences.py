"""Difference of two calibrations, or of two cameras, as users ask for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.arguments.arrays import shown
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.targets.calibration_difference import CameraDifference, Side, compared
from photogram.targets.calibration_result import Calibrated
from photogram.targets.housings import camera_number, housing_of, size_of
from photogram.targets.motion_fit import Criterion
from photogram.targets.projection import datum_rows
from photogram.targets.uncertainty import checked_distance

__all__ = ["difference"]


def difference(
    a: Calibrated | Camera,
    b: Calibrated | Camera,
    distance: float | Sequence[float] = np.inf,
    *,
    camera: int | str = 0,
    size: tuple[int, int] | None = None,
    criterion: Criterion = "pixels",
    radius: float | None = None,
    grid: tuple[int, int] = (60, 40),
) -> CameraDifference:
    """Compare two calibrations: where they image the same points, the motion of their axes out.

    Parameters
    ----------
    a, b
        Adjusted calibrations, or cameras alone, of which no uncertainty is known.
    distance
        At which they are compared, one or several, from the centre of camera a in the unit of its board.
        Infinite: only a rotation lies between them. One finite distance leaves the translation arbitrary.
    camera
        Which camera of calibrations: number or name.
    size
        Width and height of the pictures of a; None: as its calibration says.
    criterion
        `pixels`: least squares of the differences, weighted by the uncertainties where both are known.
        `mrcal`: least fourth powers of angles between rays.
    radius
        Pixels about the middle of the picture that the motion is fitted to; None: all, weighted, or a sixth
        of the shorter side where uncertainties are not known.
    grid
        Pixels across and down.

    Raises
    ------
    InputError
        Neither a calibration nor a camera, a size that nobody knows, a distance that is not positive,
        cameras that see too little in common.
    """
    distances = [distance] if isinstance(distance, float | int) else list(distance)
    if not distances:
        raise InputError("two calibrations are compared at a distance: none is given")
    if size is None:
        if not isinstance(a, Calibrated):
            raise InputError("two cameras are compared over a picture: give its size")
        size = size_of(a, camera_number(a, camera))
    unit = next((each.calibration.board.unit for each in (a, b) if isinstance(each, Calibrated)), "m")
    return compared(
        _side(a, camera, "a"),
        _side(b, camera, "b"),
        size,
        tuple(checked_distance(each) for each in distances),
        unit=unit,
        criterion=criterion,
        radius=radius,
        grid=grid,
    )


def _side(given: object, camera: int | str, name: str) -> Side:
    if isinstance(given, Camera):
        return Side(given.name or name, given)
    if not isinstance(given, Calibrated):
        raise InputError(f"{name} is neither a calibration that was adjusted nor a camera: {shown(given)}")
    number = camera_number(given, camera)
    housing, own = housing_of(given, number)
    columns = housing.parameters(own)
    return Side(
        name=f"{given.cameras[number].name} of {name}",
        camera=housing.cameras[own],
        corners=housing.seen.xy[housing.seen.cameras == own],
        covariance=housing.variance * housing.cofactors[columns, columns],
        rows=datum_rows(housing, own, "corners")[:, columns],
    )


check_arguments(globals(), ["difference"])
