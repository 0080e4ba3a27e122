"""Uncertainty of a calibrated camera at pixels, over its image and with distance; differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, shaped, truth_value, value_field
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.network.knots import beyond_knots
from photogram.targets.calibration_difference import CameraDifference, Criterion, Side, compared, points_at
from photogram.targets.calibration_result import Calibrated
from photogram.targets.housing import camera_number, housing_of, size_of
from photogram.targets.maps import UncertaintyCurve, UncertaintyMap, image_grid
from photogram.targets.options import DatumName
from photogram.targets.projection import datum_rows, projection_cofactors, worst
from photogram.words import phrase

IMAGE_GRID = (60, 40)  # rays that define the datum `image`


def projection_uncertainty(
    result: Calibrated,
    camera: int | str,
    pixels: ArrayLike,
    distance: float = np.inf,
    datum: DatumName = "corners",
    noise_only: bool = False,
) -> Floats:
    """Compute the projection uncertainty of points fixed to the camera housing.

    See docs/targets.md.

    Parameters
    ----------
    result, camera
        The adjusted calibration, and one of its cameras: number or name.
    pixels
        (n, 2) pixels, from 0 at the centre of the first pixel.
    distance
        Distance of the points from the camera centre, in the unit of the board; infinite: directions.
    datum
        Fixed reference: `corners`, the observed corners of the camera; `mean-frames`, the mean of the boards,
        as in mrcal. `image`, rays of the whole image at this distance; `axes`, the camera axes.
    noise_only
        Whether to include only corner errors and no prior errors, as in mrcal. The result is too small for
        lens parts determined only by priors.

    Returns
    -------
    (n, 2, 2) covariances, square pixels, scaled by the variance of unit weight; NaN for undefined pixels.

    Raises
    ------
    InputError
        If the camera does not exist, if the distance is not positive, or if arrays have other shapes.
    """
    truth_value("noise_only", noise_only)
    where = shaped("pixels", pixels, (None, 2))
    number = camera_number(result, camera)
    housing, own = housing_of(result, number)
    if noise_only:
        housing = housing.noise_only()
    away, fixed = checked_distance(distance), None
    if datum == "image":
        points = points_at(housing.cameras[own], image_grid(size_of(result, number), IMAGE_GRID)[2], [away])
        points = points[np.isfinite(points).all(axis=1)]
        fixed = points, np.broadcast_to(np.eye(2), (len(points), 2, 2)), bool(np.isfinite(away))
    rows = datum_rows(housing, own, datum, fixed)
    found = housing.variance * projection_cofactors(housing, own, where, distance, rows)
    seen = result.cameras[number].camera
    if seen.knots is not None:
        # Beyond the knots the edge polynomials are extrapolated with unknown errors.
        found[beyond_knots(seen.parameters, seen.rays(where))] = np.nan
    return found


def uncertainty_map(
    result: Calibrated,
    camera: int | str = 0,
    distance: float = np.inf,
    grid: tuple[int, int] = (60, 40),
    *,
    datum: DatumName = "corners",
    noise_only: bool = False,
    model: str = "not tested against other views",
) -> UncertaintyMap:
    """Compute the projection uncertainty over the image of a camera.

    Parameters
    ----------
    result, camera, distance, datum, noise_only
        As in :func:`projection_uncertainty`.
    grid
        Number of pixels across and down, from edge to edge.
    model
        Verdict of :func:`cross_validate` on the lens model.

    Raises
    ------
    InputError
        As in :func:`projection_uncertainty`, or if the image size is unknown.
    """
    truth_value("noise_only", noise_only)
    number = camera_number(result, camera)
    size = size_of(result, number)
    columns, rows, pixels = image_grid(size, grid)
    found = projection_uncertainty(result, number, pixels, distance, datum, noise_only)
    housing, own = housing_of(result, number)
    return UncertaintyMap(
        camera=result.cameras[number].name,
        size=size,
        distance=float(distance),
        unit=result.calibration.board.unit,
        datum=datum,
        noise_only=noise_only,
        columns=columns,
        rows=rows,
        covariances=found.reshape(len(rows), len(columns), 2, 2),
        corners=housing.seen.xy[housing.seen.cameras == own],
        model=model,
    )


def uncertainty_against_distance(
    result: Calibrated,
    camera: int | str,
    pixel: Sequence[float],
    distances: ArrayLike,
    *,
    datum: DatumName = "corners",
    noise_only: bool = False,
) -> UncertaintyCurve:
    """Compute the projection uncertainty of a pixel at several distances.

    Parameters
    ----------
    result, camera, datum, noise_only
        As in :func:`projection_uncertainty`.
    pixel
        Column and row.
    distances
        (n,) distances from the camera centre; infinite: directions.

    Raises
    ------
    InputError
        As in :func:`projection_uncertainty`.
    """
    truth_value("noise_only", noise_only)
    number = camera_number(result, camera)
    place = shaped("pixel", pixel, (2,))
    away = shaped("distances", distances, (None,))
    sd = [
        worst(projection_uncertainty(result, number, place[np.newaxis], each, datum, noise_only))[0]
        for each in away.tolist()
    ]
    return UncertaintyCurve(
        camera=result.cameras[number].name,
        pixel=(float(place[0]), float(place[1])),
        unit=result.calibration.board.unit,
        datum=datum,
        distances=away,
        sd=np.array(sd),
    )


def checked_distance(distance: float) -> float:
    """Return a distance.

    InputError: if it is not positive.
    """
    if not distance > 0:
        raise argument_error("distance", "positive", value=distance)
    return float(distance)


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
    """Compare the projections of two calibrations without the motion of their axes.

    Parameters
    ----------
    a, b
        Adjusted calibrations, or cameras without uncertainty.
    distance
        Distances of comparison, one or several, from the centre of camera a in the unit of its board. At
        infinity, only a rotation is fitted. One finite distance leaves the translation arbitrary.
    camera
        Camera of calibrations: number or name.
    size
        Image width and height of a; None: from its calibration.
    criterion
        `pixels`: least squares of the differences, weighted by the uncertainties if both are known. `mrcal`:
        least fourth powers of angles between rays.
    radius
        Radius about the image centre of the pixels for the motion fit. None: all, weighted, or a sixth of the
        shorter side if uncertainties are unknown.
    grid
        Number of pixels across and down.

    Raises
    ------
    InputError
        If an argument is neither a calibration nor a camera, or if the image size is unknown. If a distance
        is not positive, or if the cameras have too few common pixels.
    """
    distances = [distance] if isinstance(distance, float | int) else list(distance)
    if not distances:
        raise argument_error("distance", "empty")
    if size is None:
        if not isinstance(a, Calibrated):
            raise argument_error("size", "empty")
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
        raise InputError(phrase("targets.no-calibration", name=name, value=value_field(given)))
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
