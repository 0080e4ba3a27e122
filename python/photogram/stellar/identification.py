"""Identification of the catalogue stars of an exposure by odds against chance, and attitudes from stars."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import replace
from photogram.stellar.matching import (
    STRETCH,
    Match,
    Search,
    match,
)
from photogram.stellar.places import apparent_places, sidereal_time
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, project_sky
from photogram.stellar.sky_cameras import SkyCamera

if TYPE_CHECKING:
    from photogram.stellar import Night


_GRID = (24, 16)  # frame points for the search of the sky
_LEAST = 0.02
_SLACK = math.radians(2.0)
STARS_OF_AN_ATTITUDE = 2
_STARS_OF_FIRST_ATTITUDE = 3


def local_directions(standard: Floats) -> Floats:
    """Return unit directions (n, 3) north, east, zenith of standard coordinates."""
    every = np.column_stack([standard, np.ones(len(standard))])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True), float)


def turned_to(rays: Floats, directions: Floats) -> Floats:
    """Return alpha, omega, kappa that fit camera rays (n, 3) to directions (n, 3).

    Rays have x right, y down and z along the axis, directions are north, east, zenith; only finite rows are
    used. The matrix that maximises the sum of ray' M direction is U diag(1, 1, d) V'. U and V are from the
    singular value decomposition of the sum of ray direction' (S. Umeyama, IEEE PAMI 13, 1991). d is -1 or 1
    so that det M = -1, since the local triad is left-handed.
    """
    finite = np.isfinite(rays).all(axis=1) & np.isfinite(directions).all(axis=1)
    left, _, right = np.linalg.svd(rays[finite].T @ directions[finite])
    sign = -float(np.linalg.det(left) * np.linalg.det(right))
    matrix = left @ np.diag([1.0, 1.0, sign]) @ right
    return _photocore.pointing_of_matrix(np.ascontiguousarray(matrix))


def has_named_stars(exposure: Exposure) -> bool:
    """Return whether an exposure names enough stars for its attitude."""
    return exposure.stars is not None and int((exposure.stars >= 0).sum()) >= STARS_OF_AN_ATTITUDE


def attitude_of_stars(exposure: Exposure, camera: SkyCamera, night: Night) -> tuple[Floats, float]:
    """Return the attitude from named stars, and the sum of squared misfits.

    Misfits are between unit directions of images under the camera and of their stars.
    """
    stars = exposure.stars
    assert stars is not None
    has = np.flatnonzero(stars >= 0)
    place = night.earth.site_of_date(night.site)
    places = apparent_places(night.catalogue.take(stars[has]), exposure.utc, place.effects)
    time = sidereal_time(place, exposure.utc, night.earth.dut1)
    rays, seen = camera.rays(exposure.xy[has]), local_directions(place.standard_coordinates(places, time))
    attitude = turned_to(rays, seen)
    return attitude, float(np.nansum((rays - seen @ _photocore.pointing_matrix(attitude).T) ** 2))


def sky_share(camera: SkyCamera, attitude: Floats, frame: tuple[float, float]) -> float:
    """Return the fraction of a frame (width, height) above the horizon."""
    x, y = ((np.arange(count) + 0.5) / count * size for count, size in zip(_GRID, frame, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    zenith = camera.rays(grid) @ _photocore.pointing_matrix(np.asarray(attitude, float))[:, 2]
    with np.errstate(invalid="ignore"):
        return max(float(np.mean(zenith > 0)), _LEAST)


def attitude_radius(night: Night) -> float:
    """Return the largest image displacement by attitude errors, pixels."""
    return float(night.camera.values[0]) * math.tan(night.attitude_error)


def stars_near(exposure: Exposure, camera: SkyCamera, site: Site, night: Night, margin: float) -> Indices:
    """Return the indices of catalogue stars around the field of an exposure.

    `margin` is the largest error of the attitude, radians.
    """
    alpha, omega = exposure.attitude[:2]
    if not math.cos(alpha) * math.cos(omega) > 0.02:
        # At or below the horizon standard coordinates are undefined.
        return np.arange(len(night.catalogue.ids))
    axis = np.array([[math.tan(alpha), math.tan(omega) / math.cos(alpha)]])
    ((ra, dec),) = site.places(axis, sidereal_time(site, exposure.utc, night.earth.dut1))
    # Margin for distortion, and for precession over the years.
    reach = 1.1 * camera.largest_angle(night.frame) + margin + _SLACK
    centre = np.array([math.cos(dec) * math.cos(ra), math.cos(dec) * math.sin(ra), math.sin(dec)])
    return np.flatnonzero(night.catalogue.directions @ centre >= math.cos(min(reach, math.pi)))


def identify(
    exposure: Exposure,
    night: Night,
    camera: SkyCamera,
    *,
    tolerance: float,
    stretch: float,
    tried: float = 0.0,
) -> tuple[Match, Indices, Floats]:
    """Identify the catalogue stars of an exposure with an approximate attitude.

    The principal distance of the camera may have the relative error `stretch`. The tolerance is the largest
    distance of image and star after the best polynomials, pixels. `tried` is the number of earlier hypotheses
    about this exposure.

    Returns
    -------
    The match; (k,) index in the catalogue by the best hypothesis, accepted or not, -1 for none; alpha, omega,
    kappa from these stars, the given ones if there are too few.
    """
    frame, catalogue, dut1, radius = night.frame, night.catalogue, night.earth.dut1, attitude_radius(night)
    if stretch > STRETCH:
        # The corners may have an equal additional displacement.
        radius += stretch * max(frame)
    site = night.earth.site_of_date(night.site)
    time = sidereal_time(site, exposure.utc, dut1)
    near = stars_near(exposure, camera, site, night, radius / camera.values[0])
    places = apparent_places(catalogue.take(near), exposure.utc, site.effects)
    predicted = project_sky(camera, exposure.attitude, site, places, time)
    axis = None if night.roll_known else camera.values[2:4]
    with np.errstate(invalid="ignore"):
        if axis is None:
            inside = ((predicted >= -radius) & (predicted <= np.array(frame) + radius)).all(axis=1)
        else:
            inside = np.linalg.norm(predicted - axis, axis=1) <= 0.5 * math.hypot(*frame) + radius
    seen = np.flatnonzero(inside)
    share = sky_share(camera, exposure.attitude, frame)
    search = Search(frame, radius, stretch, axis, share, tried)
    matched = match(exposure.xy, predicted[seen], search, tolerance=tolerance)
    local = np.where(matched.found >= 0, seen[matched.found], -1) if len(seen) else matched.found
    rows = np.flatnonzero(local >= 0)
    attitude = exposure.attitude
    if len(rows) >= _STARS_OF_FIRST_ATTITUDE:
        values = camera.values.copy()
        values[:2] /= matched.scale
        rays = replace(camera, values=values).rays(exposure.xy[rows])
        standard = site.standard_coordinates(places[local[rows]], time)
        attitude = turned_to(rays, local_directions(standard))
    stars = np.where(local >= 0, near[local], -1) if len(near) else local
    return matched, stars, attitude
