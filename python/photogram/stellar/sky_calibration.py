"""Calibration of a camera with any lens from digital sky exposures, with full covariance.

Pixels count right and down. x, y and the camera axis are right-handed. The reflection in the matrix of the
report transforms the left-handed north, east, zenith to them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import LARGEST_SD, shaped, truth_value
from photogram.arguments.fields import Checked
from photogram.arguments.objects import require, require_name
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import available_memory
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.parameters import COMMON
from photogram.stellar.places import Earth, apparent_places, epoch, sidereal_time, transformed_angles
from photogram.stellar.problem import NO_PRIOR, core_problem, core_threads
from photogram.stellar.sky import Site
from photogram.stellar.sky_cameras import SkyCamera, weight_of
from photogram.words import Phrase, phrase

_STILL = Earth()
_PER_IMAGE = 2000  # Memory per image, bytes


@dataclass(frozen=True, eq=False)
class Exposure(Checked):
    """Digital exposure with star images.

    Attributes
    ----------
    utc
        UTC of mid exposure, such as 2024-03-01T21:03:05.25.
    xy
        (k, 2) measured star images, pixels; brightest first for identification.
    attitude
        (3,) approximate alpha, omega, kappa, radians.
    stars
        (k,) index of each image's star in the catalogue, -1 for none; None if unknown.
    """

    utc: str
    xy: Floats
    attitude: Floats
    stars: Indices | None = None


@dataclass(frozen=True, eq=False)
class SkyCalibration:
    """Calibrated camera and the attitudes of E exposures."""

    camera: SkyCamera  # With covariance, scaled by the variance of unit weight
    attitudes: Floats  # (E, 3) alpha, omega, kappa in radians
    attitude_covariances: Floats  # (E, 3, 3)
    cross_covariances: Floats  # (E, 3, k) between attitudes and camera
    exposures: Indices  # (m,) exposure and catalogue star of each image
    stars: Indices
    # (m, 2) measured pixels; measured minus computed, pixels; redundancy numbers; residuals over their mean
    # errors
    xy: Floats
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    catalogue: Indices  # (S,) catalogue index of the used stars
    # (S, 2) adjusted minus catalogue right ascension and declination, radians; redundancy numbers;
    # residuals over their mean errors. NaN for fixed stars.
    star_residuals: Floats
    star_redundancy: Floats
    star_standardized: Floats
    mean_error: float  # Mean error of unit weight: ratio of actual and assumed pixel standard deviations
    degrees_of_freedom: int  # Degrees of freedom of the adjustment
    iterations: int
    status: str


def project_sky(camera: SkyCamera, attitude: Floats, site: Site, places: Floats, time: float) -> Floats:
    """Return the pixels (n, 2) of apparent positions.

    NaN below the horizon, behind the camera, and beyond the range of invertible distortion.

    Raises
    ------
    InputError
        If the attitude does not have three angles, or if positions do not have two coordinates.
    """
    standard = site.standard_coordinates(shaped("places", places, (None, 2)), time)
    attitude = shaped("attitude", attitude, (3,))
    pixels = _photocore.plate_images(standard, attitude, camera.common[:-4], camera.kind)
    limit = _photocore.radial_domain(camera.facts.model, camera.model_values)
    if limit is not None:
        # If the radial distortion decreases, stars far outside would have images in the frame.
        ideal = replace(camera, values=np.where(np.arange(len(camera.values)) < 2, 1.0, 0.0))
        straight = _photocore.plate_images(standard, attitude, ideal.common[:-4], camera.kind)
        pixels[np.linalg.norm(straight, axis=1) >= limit[0]] = np.nan
    return pixels


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
    """Calibrate a camera with digital sky exposures.

    Parameters
    ----------
    exposures
        Exposures with their stars.
    camera
        Camera with initial values.
    site, catalogue
        Station and stars. The aberration of the site is diurnal. Its latitude and longitude, and the
        resulting attitudes, refer to the mean pole.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    fixed
        Names of camera parameters to fix (of `camera.names`).
    common_scale
        Whether fx is the principal distance of both axes.
    prior
        Calibrated camera whose values are weighted by their covariance. Its fixed parameters have zero
        weight.
    weigh_stars
        Whether to weight stars by the mean errors of the catalogue and estimate them. Stars without mean
        errors are fixed. If False, all stars are fixed: catalogue positions are a thousand times more
        accurate than a pixel.
    earth
        UT1 - UTC, and the pole.
    threads
        Number of threads; None: all processors.

    Raises
    ------
    InputError
        If exposures or their stars are missing, if a parameter does not exist, or if the prior has another
        lens. If a standard deviation is not positive or its square underflows, or if `threads` is less than
        1.
    AdjustmentError
        If the stars do not determine the camera, or if the memory is insufficient.
    """
    truth_value("common_scale", common_scale)
    truth_value("weigh_stars", weigh_stars)
    processors = core_threads(threads)
    for name in sorted(fixed):
        require_name("camera parameter", name, camera.names)
    if not exposures:
        raise InputError(phrase("error.missing", name="exposures"))
    require(0 < pixel_sd < LARGEST_SD, "pixel_sd", "range", low=0, high=LARGEST_SD, value=pixel_sd)
    if prior is not None and (prior.lens, prior.common_scale) != (camera.lens, common_scale):
        pairs = {"prior": (prior.lens, prior.common_scale), "camera": (camera.lens, common_scale)}
        lenses = {
            name: phrase("stars.lens-fx-fy" if common else "stars.lens", lens=lens)
            for name, (lens, common) in pairs.items()
        }
        raise InputError(phrase("stars.prior-lens", **lenses))
    values = camera.values.copy()
    if common_scale and not camera.common_scale:
        values[:2] = values[:2].mean()
    camera = replace(camera, values=values, common_scale=common_scale)
    place = earth.site_of_date(site)
    images = _Images(exposures, place, catalogue, earth.dut1, weigh_stars)
    needed = _PER_IMAGE * len(images.xy) + (16 * (3 * len(exposures)) ** 2 if weigh_stars else 0)
    if (memory := available_memory()) is not None and needed > memory:
        code = "stars.memory.stars" if weigh_stars else "stars.memory"
        sizes = {"needed": needed / 2**30, "free": memory / 2**30}
        raise AdjustmentError(phrase(code, exposures=len(exposures), images=len(images.xy), **sizes))
    free = np.array([name not in fixed for name in camera.names])
    free[1] &= not common_scale
    core = _core(images, exposures, camera, place, free, prior, pixel_sd)
    try:
        found = core.adjust(
            unit=1.0, fraction=1e-5, max_iterations=100, covariance=True, threads=processors, progress=None
        )
    except _photocore.StellarError as error:
        raise AdjustmentError(_undetermined(error, camera, len(exposures))) from None
    weighted = 0 if prior is None else int((prior.known & free).sum())
    freedom = 2 * len(images.xy) + weighted - 3 * len(exposures) - int(free.sum())
    result = _result(found, images, camera, len(exposures), freedom)
    if earth.pole == (0.0, 0.0):
        return result
    # The rotation between the poles is too small to affect covariances.
    turned = [transformed_angles(angles, place, site, earth.pole) for angles in result.attitudes]
    change = np.array(turned) - result.attitudes
    return replace(result, attitudes=result.attitudes + np.remainder(change + np.pi, 2 * np.pi) - np.pi)


def _undetermined(error: _photocore.StellarError, camera: SkyCamera, exposures: int) -> Phrase:
    kind, message, indices = error.args
    if kind != "undetermined" or not indices:
        return phrase("stars.no-solution", reason=str(message))
    attitudes = sorted({index // 3 + 1 for index in indices if index < 3 * exposures})
    places = dict(zip(camera.facts.places, camera.names, strict=True))
    names: list[str | Phrase] = [places[i - 3 * exposures] for i in indices if i >= 3 * exposures]
    if attitudes:
        names.append(phrase("stars.attitudes", numbers=attitudes))
    return phrase("stars.undetermined", names=names)


def partials(
    exposures: Sequence[Exposure],
    camera: SkyCamera,
    site: Site,
    catalogue: Catalogue,
    earth: Earth = _STILL,
) -> tuple[Floats, Floats]:
    """Return partials of matched images by attitude and camera.

    Returns
    -------
    (m, 2, 3) pixels per radian, and (m, 2, k) in the order of `camera.names`.
    """
    place = earth.site_of_date(site)
    images = _Images(exposures, place, catalogue, earth.dut1, False)
    core = _core(images, exposures, camera, place, np.ones(len(camera.values), bool), None, 1.0)
    equations = core.equations()
    return equations["pointing"], equations["common"][:, :, camera.facts.places]


class _Images:
    def __init__(
        self, exposures: Sequence[Exposure], site: Site, catalogue: Catalogue, dut1: float, weigh: bool
    ) -> None:
        exposure_of, stars, xy, times, places = [], [], [], [], []
        for number, exposure in enumerate(exposures):
            chosen = np.flatnonzero(exposure.stars >= 0) if exposure.stars is not None else np.zeros(0, int)
            if exposure.stars is None or not chosen.size:
                raise InputError(phrase("stars.no-stars", number=number + 1, utc=exposure.utc))
            named = exposure.stars[chosen]
            exposure_of.append(np.full(len(chosen), number))
            stars.append(named)
            xy.append(exposure.xy[chosen])
            times.append(np.full(len(chosen), sidereal_time(site, exposure.utc, dut1)))
            places.append(apparent_places(catalogue.take(named), exposure.utc, site.effects))
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
        # The axes of date and of the catalogue differ by minutes of arc, negligible for an ellipse.
        errors[:, 0] /= np.cos(self.places[:, 1])
        self.weights = np.zeros((len(errors), 2, 2))
        self.weights[self.weighted] = errors[self.weighted, :, None] ** -2.0 * np.eye(2)


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
    fixed = np.ones(first + len(COMMON), bool)
    fixed[:first] = fixed[place[free]] = False
    weighted = NO_PRIOR
    if prior is not None:
        # Fixed parameters are conditions of the others: a block of the full weight matrix.
        weights = np.zeros((len(free), len(free)))
        known = np.ix_(prior.known, prior.known)
        weights[known] = weight_of(prior.covariance[known])
        rows = np.flatnonzero(prior.known & free)
        names = [camera.names[i] for i in rows]
        weighted = place[rows], prior.values[rows], weights[np.ix_(rows, rows)], names
    attitudes = [exposure.attitude for exposure in exposures]
    return core_problem(
        site,
        camera.kind,
        np.concatenate([*attitudes, camera.common]),
        fixed,
        prior=weighted,
        places=images.places,
        star_weights=images.weights,
        star_fixed=~images.weighted,
        image_stars=images.local,
        image_pointings=images.exposures,
        image_xy=images.xy,
        image_weights=np.broadcast_to(np.eye(2) / pixel_sd**2, (count, 2, 2)).copy(),
        image_times=images.times,
        image_shifts=images.shifts,
    )


def _result(
    found: dict[str, Any], images: _Images, camera: SkyCamera, count: int, freedom: int
) -> SkyCalibration:
    mean_error = math.sqrt(sum(found["sums_of_squares"]) / freedom) if freedom > 0 else 1.0
    held = ~images.weighted[:, None]
    place, variance = camera.facts.places, mean_error**2
    parameters = found["parameters"]
    with np.errstate(over="ignore"):
        covariance = variance * found["common_cofactors"][np.ix_(place, place)]
    if not np.isfinite(covariance).all():
        raise AdjustmentError(phrase("stars.variances-too-large"))
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
