"""The catalogue stars of an exposure, accepted by the odds against a chance match."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.network.neighbours import mutually_nearest
from photogram.stellar.cameras import BrownCamera
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.matching import STRETCH, Match, match
from photogram.stellar.odds import ACCEPTED, expected_false
from photogram.stellar.places import Earth, apparent_places, sidereal_time
from photogram.stellar.skies import Exposure, project_sky, stars_near
from photogram.stellar.sky import Site

__all__ = ["Found", "Sighting", "identify", "identify_again"]

_STILL = Earth()


@dataclass(frozen=True, eq=False)
class Sighting:
    """Stars of the images of an exposure, and what speaks for them.

    Attributes
    ----------
    stars
        (k,) index in the catalogue; -1 where there is none, and everywhere where chance would have found as
        much.
    match
        The count that was made.
    """

    stars: Indices
    match: Match

    @property
    def accepted(self) -> bool:
        """Whether chance would not have found as much."""
        return self.match.accepted

    def reason(self) -> str:
        """Say why an exposure is not accepted."""
        if self.match.crowded:
            return (
                "so many stars of the catalogue are within the tolerance that none can be told from another:"
                " give a smaller tolerance_px"
            )
        if not math.isfinite(self.match.expected):
            return f"no two of its {len(self.stars)} images are as far apart as two stars of its field"
        return (
            f"only {self.match.matched} of {self.match.images} images have a star; chance finds as many"
            f" {_times(self.match.expected)} (accepted below {ACCEPTED:g})"
        )


def _times(expected: float) -> str:
    return f"{expected:.2g} times" if expected < 1 else "at least once"


def identify(
    exposure: Exposure,
    camera: BrownCamera,
    site: Site,
    catalogue: Catalogue,
    *,
    frame: tuple[float, float],
    radius: float,
    tolerance: float = 3.0,
    earth: Earth = _STILL,
    stretch: float = STRETCH,
) -> Sighting:
    """Find the catalogue star of each image.

    Parameters
    ----------
    exposure
        With its approximate attitude; the brightest images first.
    camera
        Approximate, such as `BrownCamera.of_field`.
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
    """
    site = earth.site_of_date(site)
    time = sidereal_time(site, exposure.utc, earth.dut1)
    near = stars_near(exposure, camera, site, catalogue, frame, radius / camera.values[0], earth.dut1)
    places = apparent_places(catalogue.take(near), exposure.utc)
    predicted = project_sky(camera, exposure.attitude, site, places, time)
    margin = np.array([-radius, -radius]), np.array(frame) + radius
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(((predicted >= margin[0]) & (predicted <= margin[1])).all(axis=1))
    made = match(
        exposure.xy, predicted[seen], frame=frame, radius=radius, tolerance=tolerance, stretch=stretch
    )
    if not made.accepted:
        return Sighting(np.full(len(made.found), -1, np.int64), made)
    return Sighting(np.where(made.found >= 0, near[seen[made.found]], -1), made)


@dataclass(frozen=True, eq=False)
class Found:
    """Stars of an exposure under a calibrated camera.

    Attributes
    ----------
    stars
        (k,) catalogue star of each image, -1 for none.
    off
        (k,) largest coordinate difference of image and star, pixels; NaN for none.
    inside
        Catalogue stars in the frame.
    """

    stars: Indices
    off: Floats
    inside: int

    def expected(self, limit: float, radius: float, frame: tuple[float, float]) -> float:
        """Return the expected number of wrong attitudes under which as many images have a star so near.

        Attitudes are counted that differ by the limit (pixels), as far as the approximate one may be wrong
        (`radius`, pixels) in its three angles.
        """
        mu = self.inside / (frame[0] * frame[1]) * (2 * limit) ** 2
        attitudes = (1 + 2 * radius / limit) ** 3
        matched = int((self.off <= limit).sum())
        return expected_false(len(self.stars), 2, mu, matched, attitudes)


def identify_again(
    exposure: Exposure,
    camera: BrownCamera,
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
    places = apparent_places(catalogue.take(near), exposure.utc)
    predicted = project_sky(
        camera, exposure.attitude, site, places, sidereal_time(site, exposure.utc, earth.dut1)
    )
    with np.errstate(invalid="ignore"):
        seen = ((predicted > -reach) & (predicted < np.array(frame) + reach)).all(axis=1)
    inside = np.flatnonzero(seen)
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
    return Found(stars, off, len(inside))
