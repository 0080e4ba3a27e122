"""Digital exposures of the sky to a calibrated camera of any lens, with full covariance.

Pixels count right and down; x, y, axis of the camera are right-handed: the reflection in the
report's matrix leads from the left-handed north, east, zenith to them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import LARGEST_SD, length, shaped
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import available_memory
from photogram.messages import listed
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.options import core_threads
from photogram.stellar.places import Earth, apparent_places, epoch, sidereal_time
from photogram.stellar.pointing import transformed_angles
from photogram.stellar.problem import weight_root
from photogram.stellar.sky import Site
from photogram.stellar.sky_cameras import COMMON, BrownCamera, SkyCamera, weight_of

__all__ = [
    "BrownCamera",
    "Exposure",
    "SkyCalibration",
    "SkyCamera",
    "calibrate_exposures",
    "partials",
    "project_sky",
    "stars_near",
]

_STILL = Earth()
_SLACK = math.radians(2.0)
_PER_IMAGE = 2000
"""Bytes of memory that an image takes."""


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
        (k,) index of each image's star in the catalogue, -1 for none; None where they are not
        known.
    """

    utc: str
    xy: Floats
    attitude: Floats
    stars: Indices | None = None


@dataclass(frozen=True, eq=False)
class SkyCalibration:
    """A calibrated camera and the attitudes of E exposures."""

    camera: SkyCamera  # With covariance, scaled by the variance of unit weight
    attitudes: Floats  # (E, 3) alpha, omega, kappa in radians, and (E, 3, 3)
    attitude_covariances: Floats
    cross_covariances: Floats  # (E, 3, k) of attitudes and camera
    exposures: Indices  # (m,) exposure and catalogue star of each image used
    stars: Indices
    # (m, 2) measured pixels; measured minus computed, pixels; redundancy numbers; residuals over their
    # mean errors
    xy: Floats
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    catalogue: Indices  # (S,) index in the catalogue of the stars used
    # (S, 2) adjusted minus catalogue right ascension and declination, radians; redundancy numbers;
    # residuals over their mean errors. NaN for stars that were held.
    star_residuals: Floats
    star_redundancy: Floats
    star_standardized: Floats
    mean_error: float  # Mean error of unit weight: of a pixel coordinate over its assumed standard deviation
    degrees_of_freedom: int  # Of the adjustment
    iterations: int
    status: str


def project_sky(camera: SkyCamera, attitude: Floats, site: Site, places: Floats, time: float) -> Floats:
    """Return the pixels (n, 2) of apparent places.

    NaN below the horizon, behind the camera, and where distortion folds.

    Raises
    ------
    InputError
        Other than three angles, and two coordinates of each place.
    """
    standard = site.standard_coordinates(shaped("places", places, (length("places", places), 2)), time)
    attitude = shaped("attitude", attitude, (3,))
    pixels = _photocore.plate_images(standard, attitude, camera.common[:-4], camera.kind)
    limit = _photocore.radial_domain(camera.facts.model, camera.model_values)
    if limit is not None:
        # Where radial distortion turns back, it would fold stars from far outside into the frame.
        ideal = replace(camera, values=np.where(np.arange(len(camera.values)) < 2, 1.0, 0.0))
        straight = _photocore.plate_images(standard, attitude, ideal.common[:-4], camera.kind)
        pixels[np.linalg.norm(straight, axis=1) >= limit[0]] = np.nan
    return pixels


def stars_near(
    exposure: Exposure,
    camera: SkyCamera,
    site: Site,
    catalogue: Catalogue,
    frame: tuple[float, float],
    margin: float,
    dut1: float = 0.0,
) -> Indices:
    """Return the stars of a catalogue around the field of an exposure, by index.

    `margin` (radians) is what the attitude may be off.
    """
    alpha, omega = exposure.attitude[:2]
    if not math.cos(alpha) * math.cos(omega) > 0.02:
        # Nearly level or below: there are no standard coordinates to go by.
        return np.arange(len(catalogue.ids))
    axis = np.array([[math.tan(alpha), math.tan(omega) / math.cos(alpha)]])
    ((ra, dec),) = site.places(axis, sidereal_time(site, exposure.utc, dut1))
    # Distortion, and precession over the years.
    reach = 1.1 * camera.largest_angle(frame) + margin + _SLACK
    centre = np.array([math.cos(dec) * math.cos(ra), math.cos(dec) * math.sin(ra), math.sin(dec)])
    return np.flatnonzero(catalogue.directions @ centre >= math.cos(min(reach, math.pi)))


def calibrate_exposures(
    exposures: Sequence[Exposure],
    camera: SkyCamera,
    site: Site,
    catalogue: Catalogue,
    *,
    pixel_sd: float = 0.1,
    fixed: Sequence[str] = (),
    common_scale: bool = False,
    prior: SkyCamera | None = None,
    weigh_stars: bool = False,
    earth: Earth = _STILL,
    threads: int | None = None,
) -> SkyCalibration:
    """Calibrate a camera by digital exposures of the sky.

    Parameters
    ----------
    exposures
        With their stars.
    camera
        Initial values.
    site, catalogue
        Where, and which stars. The aberration of the site is the diurnal one; its latitude and longitude, and
        the attitudes that come out, are from the mean pole.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    fixed
        Names of camera parameters to hold (of `camera.names`).
    common_scale
        Whether fx is the principal distance of both axes.
    prior
        A calibrated camera, whose values take part with the weight of their covariance; what was held in it
        has no weight.
    weigh_stars
        Estimate the stars, too, with the mean errors of the catalogue; stars without are held. Else all are
        held: catalogue places are a thousand times better than a pixel.
    earth
        UT1 - UTC, and the pole.
    threads
        Number of threads; all processors when None.

    Raises
    ------
    InputError
        No exposures, or one without stars; a parameter that does not exist; a standard deviation that is not
        positive, or whose square is none; a prior of another lens; fewer than one thread.
    AdjustmentError
        The stars do not determine the camera, or the memory does not hold the adjustment.
    """
    processors = core_threads(threads)
    unknown = sorted(set(fixed) - set(camera.names))
    if unknown:
        raise InputError(f"there is no camera parameter {', '.join(unknown)}")
    if not exposures:
        raise InputError("there are no exposures")
    if not 0 < pixel_sd < LARGEST_SD:
        raise InputError(f"the standard deviation of an image coordinate is {pixel_sd} pixels")
    if prior is not None and (prior.lens, prior.common_scale) != (camera.lens, common_scale):
        raise InputError(
            f"the prior is a camera {_described(prior.lens, prior.common_scale)},"
            f" not {_described(camera.lens, common_scale)}"
        )
    camera = _tied(camera, common_scale)
    place = earth.site_of_date(site)
    images = _Images(exposures, place, catalogue, earth.dut1, weigh_stars)
    _refuse_too_large(len(images.xy), len(exposures), weigh_stars)
    free = np.array([name not in fixed for name in camera.names])
    free[1] &= not common_scale
    core = _core(images, exposures, camera, place, free, prior, pixel_sd)
    try:
        found = core.adjust(
            unit=1.0, fraction=1e-5, max_iterations=100, covariance=True, threads=processors, progress=None
        )
    except _photocore.StellarError as error:
        undetermined = _undetermined(error, camera, len(exposures))
        raise AdjustmentError(f"the stars do not determine the camera: {undetermined}") from None
    weighted = 0 if prior is None else int((prior.known & free).sum())
    freedom = 2 * len(images.xy) + weighted - 3 * len(exposures) - int(free.sum())
    result = _result(found, images, camera, len(exposures), freedom)
    if earth.pole == (0.0, 0.0):
        return result
    # The turn between the poles is so small that covariances stay.
    turned = [transformed_angles(angles, place, site, earth.pole) for angles in result.attitudes]
    change = np.array(turned) - result.attitudes
    return replace(result, attitudes=result.attitudes + np.remainder(change + np.pi, 2 * np.pi) - np.pi)


def _described(lens: str, common_scale: bool) -> str:
    return f"of the lens {lens}{' with fx = fy' if common_scale else ''}"


def _tied(camera: SkyCamera, common_scale: bool) -> SkyCamera:
    """Return a camera whose fy is fx, or no longer."""
    values = camera.values.copy()
    if common_scale and not camera.common_scale:
        values[:2] = values[:2].mean()
    return replace(camera, values=values, common_scale=common_scale)


def _undetermined(error: _photocore.StellarError, camera: SkyCamera, exposures: int) -> str:
    """Name what the stars of so many exposures do not determine."""
    kind, message, indices = error.args
    if kind != "undetermined" or not indices:
        return str(message)
    attitudes = sorted({index // 3 + 1 for index in indices if index < 3 * exposures})
    places = dict(zip(camera.facts.places, camera.names, strict=True))
    left = [places[index - 3 * exposures] for index in indices if index >= 3 * exposures]
    if attitudes:
        left.append(f"the attitudes of exposures {listed([str(number) for number in attitudes])}")
    return f"they leave {', '.join(left)} open"


def _refuse_too_large(images: int, exposures: int, weigh_stars: bool) -> None:
    """Refuse what the machine cannot hold: stars that are estimated tie all attitudes to each other."""
    attitudes = 3 * exposures
    needed = _PER_IMAGE * images + (16 * attitudes**2 if weigh_stars else 0)
    free = available_memory()
    if free is not None and needed > free:
        raise AdjustmentError(
            f"{exposures} exposures with {images} images take {needed / 2**30:.1f} GiB of memory, and"
            f" {free / 2**30:.1f} GiB are free" + ("; hold the stars" if weigh_stars else "")
        )


def partials(
    exposures: Sequence[Exposure],
    camera: SkyCamera,
    site: Site,
    catalogue: Catalogue,
    earth: Earth = _STILL,
) -> tuple[Floats, Floats]:
    """Return partials of the images that have a star, by their attitude and by the camera.

    Returns
    -------
    (m, 2, 3) pixels a radian, and (m, 2, k) in the order of `camera.names`.
    """
    place = earth.site_of_date(site)
    images = _Images(exposures, place, catalogue, earth.dut1, False)
    core = _core(images, exposures, camera, place, np.ones(len(camera.values), bool), None, 1.0)
    equations = core.equations()
    return equations["pointing"], equations["common"][:, :, list(camera.facts.places)]


class _Images:
    """All images of all exposures, with the apparent places of their stars."""

    def __init__(
        self, exposures: Sequence[Exposure], site: Site, catalogue: Catalogue, dut1: float, weigh: bool
    ) -> None:
        exposure_of, stars, xy, times, places = [], [], [], [], []
        for number, exposure in enumerate(exposures):
            chosen = np.flatnonzero(exposure.stars >= 0) if exposure.stars is not None else np.zeros(0, int)
            if exposure.stars is None or not chosen.size:
                raise InputError(f"exposure {number + 1} ({exposure.utc}) has no stars")
            exposure_of.append(np.full(len(chosen), number))
            stars.append(exposure.stars[chosen])
            xy.append(exposure.xy[chosen])
            times.append(np.full(len(chosen), sidereal_time(site, exposure.utc, dut1)))
            places.append(apparent_places(catalogue.take(exposure.stars[chosen]), exposure.utc, site.effects))
        self.exposures, self.stars = np.concatenate(exposure_of), np.concatenate(stars)
        self.xy, self.times = np.vstack(xy), np.concatenate(times)
        every = np.vstack(places)
        self.catalogue, first, self.local = np.unique(self.stars, return_index=True, return_inverse=True)
        self.places = every[first]
        shifts = every - self.places[self.local]
        shifts[:, 0] = np.remainder(shifts[:, 0] + np.pi, 2 * np.pi) - np.pi
        self.shifts = shifts
        errors = catalogue.take(self.catalogue).mean_errors(epoch(exposures[0].utc))
        self.weighted: Bools = (errors.min(axis=1) > 0) & weigh
        # The axes of date differ from those of the catalogue by minutes of arc: nothing to an error ellipse.
        errors[:, 0] /= np.cos(self.places[:, 1])
        self.weights = np.zeros((len(errors), 2, 2))
        self.weights[self.weighted] = np.array([np.diag(row**-2.0) for row in errors[self.weighted]]).reshape(
            -1, 2, 2
        )


def _core(
    images: _Images,
    exposures: Sequence[Exposure],
    camera: SkyCamera,
    site: Site,
    free: Bools,
    prior: SkyCamera | None,
    pixel_sd: float,
) -> _photocore.StellarProblem:
    first, count = 3 * len(exposures), len(images.xy)
    place = first + np.array(camera.facts.places)
    fixed = np.ones(first + COMMON, bool)
    fixed[:first] = fixed[place[free]] = False
    weighted, values, root = np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 0))
    if prior is not None:
        # What is held conditions the others: a block of the whole weight matrix.
        weights = np.zeros((len(free), len(free)))
        weights[np.ix_(prior.known, prior.known)] = weight_of(
            prior.covariance[np.ix_(prior.known, prior.known)]
        )
        chosen = np.flatnonzero(prior.known & free)
        weighted, values = place[chosen], prior.values[chosen]
        root = weight_root(weights[np.ix_(chosen, chosen)], [camera.names[i] for i in chosen])
    return _photocore.StellarProblem(
        station=site.core,
        camera=camera.kind,
        pointings=np.array([exposure.attitude for exposure in exposures], float),
        common=camera.common,
        fixed=fixed.tolist(),
        weighted=weighted,
        weighted_values=values,
        weight_root=root,
        star_places=images.places,
        star_catalogue=images.places,
        star_weights=images.weights,
        star_fixed=(~images.weighted).tolist(),
        image_stars=images.local.astype(np.int64),
        image_pointings=images.exposures.astype(np.int64),
        image_xy=images.xy,
        image_weights=np.broadcast_to(np.eye(2) / pixel_sd**2, (count, 2, 2)).copy(),
        image_times=images.times,
        image_shifts=images.shifts,
        axis=None,
    )


def _result(
    found: dict[str, Any], images: _Images, camera: SkyCamera, count: int, freedom: int
) -> SkyCalibration:
    mean_error = math.sqrt(sum(found["sums_of_squares"]) / freedom) if freedom > 0 else 1.0
    held = ~images.weighted[:, None]
    place, variance = list(camera.facts.places), mean_error**2
    parameters = found["parameters"]
    with np.errstate(over="ignore"):
        covariance = variance * found["common_cofactors"][np.ix_(place, place)]
    if not np.isfinite(covariance).all():
        raise AdjustmentError(
            "the variances of the camera are beyond double precision: images lie too far from their stars, or"
            " standard deviations cannot be right"
        )
    values = parameters[3 * count :][place]
    if camera.common_scale:
        values[1] = values[0]
    return SkyCalibration(
        camera=replace(camera, values=values, covariance=covariance),
        attitudes=parameters[: 3 * count].reshape(count, 3),
        attitude_covariances=variance * found["pointing_cofactors"],
        cross_covariances=variance * np.take(found["cross_cofactors"], place, axis=2),
        exposures=images.exposures,
        stars=images.stars,
        xy=images.xy,
        residuals=found["residuals"],
        redundancy=found["image_redundancy"],
        standardized=found["image_standardized"] / (mean_error or math.nan),
        catalogue=images.catalogue,
        star_residuals=np.where(held, np.nan, found["places"] - images.places),
        star_redundancy=np.where(held, np.nan, found["place_redundancy"]),
        # The engine's residuals are observed minus computed.
        star_standardized=np.where(held, np.nan, -found["place_standardized"] / (mean_error or math.nan)),
        mean_error=mean_error,
        degrees_of_freedom=freedom,
        iterations=len(found["iterations"]),
        status=found["status"],
    )
