"""The catalogue stars of an exposure, accepted by the odds against a chance match, and attitudes by them."""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.neighbours import mutually_nearest
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.matching import FEWEST, STRETCH, Match, Search, match
from photogram.stellar.odds import ACCEPTED, DOUBTFUL, expected_false, log_odds, star_probabilities
from photogram.stellar.places import Earth, apparent_places, sidereal_time
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, project_sky, stars_near
from photogram.stellar.sky_cameras import SkyCamera

__all__ = ["Found", "identify", "identify_again"]


_GRID = (24, 16)
"""Places of the frame that are looked through."""
_LEAST = 0.02
_STILL = Earth()
STARS_OF_AN_ATTITUDE = 2


def local_directions(standard: Floats) -> Floats:
    """Return unit directions (n, 3) north, east, zenith of standard coordinates (n, 2)."""
    every = np.column_stack([standard, np.ones(len(standard))])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True), float)


def turned_to(rays: Floats, directions: Floats) -> Floats:
    """Return alpha, omega, kappa of the camera that sees directions along rays, by least squares.

    Parameters
    ----------
    rays
        (n, 3) unit directions in the camera: x right, y down, z along the axis; what is not finite does not
        count.
    directions
        (n, 3) the same north, east, zenith.

    Notes
    -----
    The matrix that maximizes the sum of ray' M direction is U diag(1, 1, d) V' of the singular value
    decomposition of the sum of ray direction' (S. Umeyama, IEEE PAMI 13, 1991), with d = -1 or 1 so that det
    M = -1: the local triad is left-handed.
    """
    finite = np.isfinite(rays).all(axis=1) & np.isfinite(directions).all(axis=1)
    left, _, right = np.linalg.svd(rays[finite].T @ directions[finite])
    sign = -float(np.linalg.det(left) * np.linalg.det(right))
    matrix = left @ np.diag([1.0, 1.0, sign]) @ right
    return _photocore.pointing_of_matrix(np.ascontiguousarray(matrix))


def has_named_stars(exposure: Exposure) -> bool:
    """Whether the images of an exposure name enough stars for its attitude."""
    return exposure.stars is not None and int((exposure.stars >= 0).sum()) >= STARS_OF_AN_ATTITUDE


def attitude_of_stars(
    exposure: Exposure, camera: SkyCamera, site: Site, catalogue: Catalogue, earth: Earth = _STILL
) -> tuple[Floats, float]:
    """Return alpha, omega, kappa of an exposure with named stars, and the sum of squared misfits.

    Misfits are between unit directions of images under the camera and of their stars.
    """
    stars = exposure.stars
    assert stars is not None
    has = np.flatnonzero(stars >= 0)
    place = earth.site_of_date(site)
    places = apparent_places(catalogue.take(stars[has]), exposure.utc, place.effects)
    time = sidereal_time(place, exposure.utc, earth.dut1)
    rays, seen = camera.rays(exposure.xy[has]), local_directions(place.standard_coordinates(places, time))
    attitude = turned_to(rays, seen)
    return attitude, float(np.nansum((rays - seen @ _photocore.pointing_matrix(attitude).T) ** 2))


def sky_share(camera: SkyCamera, attitude: Floats, frame: tuple[float, float]) -> float:
    """Return what of a frame (width, height) shows the sky: not the ground, nor what no ray reaches."""
    x, y = ((np.arange(count) + 0.5) / count * size for count, size in zip(_GRID, frame, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    zenith = camera.rays(grid) @ _photocore.pointing_matrix(np.asarray(attitude, float))[:, 2]
    with np.errstate(invalid="ignore"):
        return max(float(np.mean(zenith > 0)), _LEAST)


_FOR_ATTITUDE = 3
"""Stars that a first attitude is computed from at least."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """Stars of the images of an exposure, and what speaks for them."""

    # (k,) index in the catalogue; -1 where there is none, and everywhere where chance would have found
    # as much
    stars: Indices
    match: Match  # The count that was made
    found: Indices  # (k,) the stars that the best hypothesis gives, whatever speaks for it
    attitude: Floats  # (3,) alpha, omega, kappa that go with them; the given one where there are not enough

    @property
    def accepted(self) -> bool:
        """Whether chance would not have found as much."""
        return self.match.accepted

    @property
    def doubtful(self) -> bool:
        """Whether chance may or may not have found as much."""
        return not self.accepted and self.match.expected <= DOUBTFUL

    def reason(self) -> str:
        """Say why an exposure is not accepted."""
        if self.match.crowded:
            return (
                "so many stars of the catalogue are within the tolerance that none can be told from another:"
                " give a smaller tolerance_px"
            )
        if len(self.stars) < FEWEST:
            return f"it has {len(self.stars)} images of the {FEWEST} that are needed"
        if self.match.stars < FEWEST:
            return f"the catalogue has {self.match.stars} stars in its field, of the {FEWEST} that are needed"
        if not math.isfinite(self.match.expected):
            return f"no two of its {len(self.stars)} images lie to each other as two stars of its field do"
        return (
            f"only {self.match.matched} of {self.match.images} images have a star; chance finds as many"
            f" {_times(self.match.expected)} (accepted below {ACCEPTED:g})"
        )


def _times(expected: float) -> str:
    return f"{expected:.2g} times" if expected < 1 else "at least once"


def identify(
    exposure: Exposure,
    camera: SkyCamera,
    site: Site,
    catalogue: Catalogue,
    *,
    frame: tuple[float, float],
    radius: float,
    tolerance: float = 3.0,
    earth: Earth = _STILL,
    stretch: float = STRETCH,
    roll_known: bool = True,
    tried: float = 0.0,
) -> Sighting:
    """Find the catalogue star of each image.

    Parameters
    ----------
    exposure
        With its approximate attitude; the brightest images first.
    camera
        Approximate, such as `SkyCamera.of_field`.
    site, catalogue
        Where, and which stars; the brightest first (`Catalogue.brighter`).
    frame
        Width and height in pixels.
    radius, tolerance
        Largest error of the approximate attitude, and of an image after the best polynomials, pixels.
    earth
        UT1 - UTC, and the pole.
    stretch
        Share by which the principal distance of the camera may be wrong.
    roll_known
        Whether the camera is turned about its axis as the attitude says.
    tried
        Hypotheses about this exposure that were counted before: they count with those of this one.
    """
    if stretch > STRETCH:
        # The corners are as far away from where they should be.
        radius += stretch * max(frame)
    site = earth.site_of_date(site)
    time = sidereal_time(site, exposure.utc, earth.dut1)
    near = stars_near(exposure, camera, site, catalogue, frame, radius / camera.values[0], earth.dut1)
    places = apparent_places(catalogue.take(near), exposure.utc, site.effects)
    predicted = project_sky(camera, exposure.attitude, site, places, time)
    axis = None if roll_known else camera.values[2:4]
    with np.errstate(invalid="ignore"):
        if axis is None:
            inside = ((predicted >= -radius) & (predicted <= np.array(frame) + radius)).all(axis=1)
        else:
            inside = np.linalg.norm(predicted - axis, axis=1) <= 0.5 * math.hypot(*frame) + radius
    seen = np.flatnonzero(inside)
    share = sky_share(camera, exposure.attitude, frame)
    search = Search(frame, radius, stretch, axis, share, tried)
    made = match(exposure.xy, predicted[seen], search, tolerance=tolerance)
    local = np.where(made.found >= 0, seen[made.found], -1) if len(seen) else made.found
    has = np.flatnonzero(local >= 0)
    attitude = exposure.attitude
    if len(has) >= _FOR_ATTITUDE:
        values = camera.values.copy()
        values[:2] /= made.scale
        rays = replace(camera, values=values).rays(exposure.xy[has])
        standard = site.standard_coordinates(places[local[has]], time)
        attitude = turned_to(rays, local_directions(standard))
    stars = np.where(local >= 0, near[local], -1) if len(near) else local
    accepted = stars if made.accepted else np.full(len(stars), -1, np.int64)
    return Sighting(accepted, made, stars, attitude)


@dataclass(frozen=True, eq=False)
class Found:
    """Stars of an exposure under a calibrated camera."""

    stars: Indices  # (k,) catalogue star of each image, -1 for none
    off: Floats  # (k,) largest coordinate difference of image and star, pixels; NaN for none
    inside: int  # Catalogue stars in the frame
    predicted: Floats  # (n, 2) where they and those within reach are, pixels
    nearest: Indices  # (k,) which of these each image has; -1 for none
    area: float  # Of the frame that shows the sky, square pixels
    xy: Floats  # (k, 2) the images
    named: bool = False  # Whether the images name their stars

    @property
    def density(self) -> float:
        """Catalogue stars a square pixel of the sky."""
        return self.inside / self.area

    def probabilities(self, sd: float) -> Floats:
        """Return the probability (k,) of each star, NaN for none, and where images name theirs.

        `sd` is the standard deviation of an image coordinate.
        """
        if self.named:
            return np.full(len(self.stars), np.nan)
        return star_probabilities(self.xy, self.predicted, self.nearest, sd, self.density)

    def log_odds(self, sd: float) -> float:
        """Return the logarithm of the odds of the exposure against chance, as Lang et al. have them."""
        has = self.nearest >= 0
        off = np.linalg.norm(self.xy[has] - self.predicted[self.nearest[has]], axis=1)
        return log_odds(off, len(self.stars), sd, self.density)

    def expected(self, limit: float, radius: float, roll: float) -> float:
        """Return the expected number of wrong attitudes under which as many images have a star so near.

        Attitudes are counted that differ by the limit (pixels), as far as the approximate one may be wrong
        (`radius`, pixels), and the corners by its turn about the axis (`roll`, pixels).
        """
        mu = self.density * (2 * limit) ** 2
        attitudes = (1 + 2 * radius / limit) ** 2 * (1 + 2 * roll / limit)
        matched = int((self.off <= limit).sum())
        return expected_false(len(self.stars), 2, mu, matched, attitudes)


def identify_again(
    exposure: Exposure,
    camera: SkyCamera,
    site: Site,
    catalogue: Catalogue,
    *,
    frame: tuple[float, float],
    reach: float,
    earth: Earth = _STILL,
) -> Found:
    """Find the nearest star of each image under a calibrated camera and attitude.

    Images that name their star keep it.

    Parameters
    ----------
    exposure, camera, site, catalogue, frame, earth
        As for `identify`; the attitude is the adjusted one.
    reach
        Largest distance, pixels.
    """
    near = stars_near(exposure, camera, site, catalogue, frame, 0.0, earth.dut1)
    named = exposure.stars
    if named is not None:
        near = np.union1d(near, named[named >= 0])
    places = apparent_places(catalogue.take(near), exposure.utc, site.effects)
    predicted = project_sky(
        camera, exposure.attitude, site, places, sidereal_time(site, exposure.utc, earth.dut1)
    )
    with np.errstate(invalid="ignore"):
        seen = ((predicted > -reach) & (predicted < np.array(frame) + reach)).all(axis=1)
        in_frame = ((predicted >= 0) & (predicted <= frame)).all(axis=1)
    inside = np.flatnonzero(seen)
    nearest = np.full(len(exposure.xy), -1, np.int64)
    if named is None:
        nearest = mutually_nearest(exposure.xy, predicted[inside], reach)
        local = np.where(nearest >= 0, inside[nearest], -1) if len(inside) else nearest
        stars = np.where(local >= 0, near[local], -1)
    else:
        stars = named
        local = np.where(named >= 0, np.searchsorted(near, named), -1)
    off = np.full(len(local), np.nan)
    has = local >= 0
    off[has] = np.abs(exposure.xy[has] - predicted[local[has]]).max(axis=1)
    area = frame[0] * frame[1] * sky_share(camera, exposure.attitude, frame)
    return Found(
        stars, off, int(in_frame.sum()), predicted[inside], nearest, area, exposure.xy, named is not None
    )
