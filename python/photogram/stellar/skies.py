"""Digital exposures of the sky to a calibrated camera: pinhole and Brown distortion, with full covariance.

Pixels count right and down; x, y, axis of the camera are right-handed: the reflection in the
report's matrix leads from the left-handed north, east, zenith to them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.errors import AdjustmentError, InputError
from photogram.stellar.cameras import BROWN_PLACE, COMMON, BrownCamera
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.matching import match
from photogram.stellar.places import apparent_places, sidereal_time
from photogram.stellar.sky import Site

__all__ = ["BrownCamera", "Exposure", "SkyCalibration", "calibrate_exposures", "identify", "project_sky"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Exposure:
    """A digital exposure.

    Attributes
    ----------
    utc
        Mid exposure, such as 2024-03-01T21:03:05.25.
    xy
        (k, 2) measured star images, pixels; the brightest first where stars are to be identified.
    attitude
        (3,) approximate alpha, omega, kappa, radians.
    stars
        (k,) index of each image's star in the catalogue, -1 for none; None where `identify` is to find out.
    """

    utc: str
    xy: Floats
    attitude: Floats
    stars: Indices | None = None


@dataclass(frozen=True, eq=False)
class SkyCalibration:
    """A calibrated camera and the attitudes of E exposures.

    Attributes
    ----------
    camera
        With covariance, scaled by the variance of unit weight.
    attitudes, attitude_covariances
        (E, 3) alpha, omega, kappa in radians, and (E, 3, 3).
    cross_covariances
        (E, 3, 9) of attitudes and camera.
    exposures, stars
        (m,) exposure and catalogue star of each image used.
    residuals, redundancy, standardized
        (m, 2) measured minus computed, pixels; redundancy numbers; residuals over their mean errors.
    mean_error
        Mean error of unit weight: of a pixel coordinate over its assumed standard deviation.
    degrees_of_freedom, iterations, status
        Of the adjustment.
    """

    camera: BrownCamera
    attitudes: Floats
    attitude_covariances: Floats
    cross_covariances: Floats
    exposures: Indices
    stars: Indices
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    mean_error: float
    degrees_of_freedom: int
    iterations: int
    status: str


def project_sky(camera: BrownCamera, attitude: Floats, site: Site, places: Floats, time: float) -> Floats:
    """Return the pixels (n, 2) of apparent places.

    NaN below the horizon, behind the camera, and where distortion folds.
    """
    standard = site.standard_coordinates(places, time)
    attitude = np.asarray(attitude, float)
    pixels = _photocore.plate_images(standard, attitude, camera.common[:13], (1.0, True, False))
    ideal = np.zeros(13)
    ideal[3:5] = 1.0
    square = np.sum(_photocore.plate_images(standard, attitude, ideal, (1.0, True, False)) ** 2, axis=1)
    # Where radial distortion turns back, it would fold stars from far outside into the frame.
    k1, k2, k3 = camera.values[4:7]
    roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0]) if camera.values[4:7].any() else np.zeros(0)
    turns = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real
    pixels[square >= turns.min(initial=np.inf)] = np.nan
    return pixels


def identify(
    exposure: Exposure,
    camera: BrownCamera,
    site: Site,
    catalogue: Catalogue,
    *,
    frame: tuple[float, float],
    radius: float,
    tolerance: float = 3.0,
    dut1: float = 0.0,
) -> Indices:
    """Find the catalogue star of each image.

    Parameters
    ----------
    exposure
        With its approximate attitude; the brightest images first.
    camera
        Approximate, such as `BrownCamera.of_field`.
    site, catalogue
        Where, and which stars; as deep as the images, the brightest first (`Catalogue.brighter`).
    frame
        Width and height in pixels.
    radius, tolerance
        Largest error of the approximate attitude, and of an image after the best polynomials, pixels.
    dut1
        UT1 - UTC in seconds.

    Returns
    -------
    (k,) index in the catalogue; -1 where there is none.
    """
    time = sidereal_time(site, exposure.utc, dut1)
    predicted = project_sky(camera, exposure.attitude, site, apparent_places(catalogue, exposure.utc), time)
    margin = np.array([-radius, -radius]), np.array(frame) + radius
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(((predicted >= margin[0]) & (predicted <= margin[1])).all(axis=1))
    found = match(exposure.xy, predicted[seen], radius=radius, tolerance=tolerance)
    return np.where(found >= 0, seen[found] if len(seen) else -1, -1)


def calibrate_exposures(
    exposures: list[Exposure],
    camera: BrownCamera,
    site: Site,
    catalogue: Catalogue,
    *,
    pixel_sd: float = 0.1,
    fixed: tuple[str, ...] = (),
    dut1: float = 0.0,
    threads: int | None = None,
) -> SkyCalibration:
    """Calibrate a camera by digital exposures of the sky.

    Stars are held at their catalogue places, which are a thousand times better than a pixel.

    Parameters
    ----------
    exposures
        With their stars.
    camera
        Initial values; a camera with covariance is no prior here.
    site, catalogue
        Where, and which stars. The aberration of the site is the diurnal one.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    fixed
        Names of camera parameters to hold (of fx, fy, cx, cy, k1, k2, k3, p1, p2).
    dut1
        UT1 - UTC in seconds.
    threads
        Number of threads; all processors when None.

    Raises
    ------
    InputError
        An exposure without stars; a parameter that does not exist.
    AdjustmentError
        The stars do not determine the camera.
    """
    unknown = sorted(set(fixed) - set(BrownCamera.NAMES))
    if unknown:
        raise InputError(f"there is no camera parameter {', '.join(unknown)}")
    images = _Images(exposures, site, catalogue, dut1)
    count = len(exposures)
    held = np.ones(3 * count + COMMON, bool)
    held[: 3 * count] = False
    held[
        3 * count
        + np.array(
            [place for name, place in zip(BrownCamera.NAMES, BROWN_PLACE, strict=True) if name not in fixed]
        )
    ] = False
    core = _core(images, exposures, camera, site, held, pixel_sd)
    try:
        found = core.adjust(
            unit=1.0, fraction=1e-5, max_iterations=100, covariance=True, threads=threads or 0, progress=None
        )
    except _photocore.StellarError as error:
        raise AdjustmentError(f"the stars do not determine the camera: {error.args[1]}") from None
    return _result(found, images, count, int((~held).sum()))


class _Images:
    """All images of all exposures, with the apparent places of their stars."""

    def __init__(self, exposures: list[Exposure], site: Site, catalogue: Catalogue, dut1: float) -> None:
        exposure_of, stars, xy, times, places = [], [], [], [], []
        for number, exposure in enumerate(exposures):
            chosen = np.flatnonzero(exposure.stars >= 0) if exposure.stars is not None else np.zeros(0, int)
            if exposure.stars is None or not chosen.size:
                raise InputError(f"exposure {number + 1} ({exposure.utc}) has no stars")
            exposure_of.append(np.full(len(chosen), number))
            stars.append(exposure.stars[chosen])
            xy.append(exposure.xy[chosen])
            times.append(np.full(len(chosen), sidereal_time(site, exposure.utc, dut1)))
            places.append(apparent_places(catalogue.take(exposure.stars[chosen]), exposure.utc))
        self.exposures, self.stars = np.concatenate(exposure_of), np.concatenate(stars)
        self.xy, self.times = np.vstack(xy), np.concatenate(times)
        every = np.vstack(places)
        _, first, self.local = np.unique(self.stars, return_index=True, return_inverse=True)
        self.places = every[first]
        shifts = every - self.places[self.local]
        shifts[:, 0] = np.remainder(shifts[:, 0] + np.pi, 2 * np.pi) - np.pi
        self.shifts = shifts


def _core(
    images: _Images, exposures: list[Exposure], camera: BrownCamera, site: Site, held: Any, pixel_sd: float
) -> _photocore.StellarProblem:
    stars, count = len(images.places), len(images.xy)
    return _photocore.StellarProblem(
        station=site.core,
        camera=(1.0, True, False),
        pointings=np.array([exposure.attitude for exposure in exposures], float),
        common=camera.common,
        fixed=held.tolist(),
        weighted=np.zeros(0, np.int64),
        weighted_values=np.zeros(0),
        weight_root=np.zeros((0, 0)),
        star_places=images.places,
        star_catalogue=images.places,
        star_weights=np.zeros((stars, 2, 2)),
        star_fixed=[True] * stars,
        image_stars=images.local.astype(np.int64),
        image_pointings=images.exposures.astype(np.int64),
        image_xy=images.xy,
        image_weights=np.broadcast_to(np.eye(2) / pixel_sd**2, (count, 2, 2)).copy(),
        image_times=images.times,
        image_shifts=images.shifts,
        axis=None,
    )


def _result(found: dict[str, Any], images: _Images, count: int, unknowns: int) -> SkyCalibration:
    freedom = 2 * len(images.xy) - unknowns
    mean_error = math.sqrt(found["sums_of_squares"][0] / freedom) if freedom > 0 else 1.0
    cofactors = mean_error**2 * found["cofactors"]
    place = list(BROWN_PLACE)
    if count <= 3:
        full = cofactors.reshape(3 * count + COMMON, -1)
        own = np.array([full[3 * e : 3 * e + 3, 3 * e : 3 * e + 3] for e in range(count)])
        cross = np.array([full[3 * e : 3 * e + 3, 3 * count :] for e in range(count)])
        common = full[3 * count :, 3 * count :]
    else:
        rows = cofactors[: count * 3 * (3 + COMMON)].reshape(count, 3, 3 + COMMON)
        own, cross = rows[:, :, :3], rows[:, :, 3:]
        common = cofactors[count * 3 * (3 + COMMON) :].reshape(COMMON, COMMON)
    parameters = found["parameters"]
    return SkyCalibration(
        camera=BrownCamera(parameters[3 * count :][place], common[np.ix_(place, place)]),
        attitudes=parameters[: 3 * count].reshape(count, 3),
        attitude_covariances=own,
        cross_covariances=cross[:, :, place],
        exposures=images.exposures,
        stars=images.stars,
        residuals=found["residuals"],
        redundancy=found["image_redundancy"],
        standardized=found["image_standardized"] / mean_error,
        mean_error=mean_error,
        degrees_of_freedom=freedom,
        iterations=len(found["iterations"]),
        status=found["status"],
    )
