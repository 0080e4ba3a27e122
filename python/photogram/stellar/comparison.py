"""Each exposure of a night against the others: the test of its residuals as a group.

Leaving an exposure out changes the sum of squares by T = v'v + g'(N - S)^+ g, where v are its residuals
over their standard deviation, g = C'v with its partials C by the camera, N the information of the whole night
about the camera, and S what of it this exposure gave. T is what is left when the camera is known from the
others, with their covariance, and only the attitude is estimated: the exposure is held out without another
adjustment (W. Baarda's test of a group of observations, Netherlands Geodetic Commission 2, 5, 1968).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.odds import binomial_tail
from photogram.stellar.places import Earth
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, SkyCalibration, partials

__all__ = ["HeldOut", "fewer_stars", "held_out"]


LEVEL = 0.05
"""Probability that any exposure of a good night is found unlike the others."""
NOTABLE = 2.0
"""Exposures whose residuals are larger than the others foretell by less are only not as sharp."""
_INVISIBLE = 1e-6
"""Share of the information about a direction below which the others do not determine it."""
_ATTITUDE = 3


@dataclass(frozen=True)
class HeldOut:
    """How an exposure fits the camera of the others.

    Attributes
    ----------
    factor
        Root mean square of its residuals under that camera over what the others' residuals foretell; NaN
        where that cannot be told.
    probability
        Of a sum of squares as large, the unit weight of the others taken as known.
    """

    factor: float
    probability: float

    def unlike(self, exposures: int) -> bool:
        """Whether one of so many exposures does not fit the others."""
        return self.factor > NOTABLE and self.probability < LEVEL / exposures


def held_out(
    exposures: Sequence[Exposure],
    found: SkyCalibration,
    site: Site,
    catalogue: Catalogue,
    *,
    pixel_sd: float,
    earth: Earth,
) -> list[HeldOut]:
    """Hold each exposure out.

    Parameters
    ----------
    exposures
        Those that were adjusted, with the adjusted attitudes.
    found
        What came out.
    site, catalogue, pixel_sd, earth
        As for `calibrate_exposures`; the pole is that of the adjustment.
    """
    sd = np.sqrt(np.diag(found.camera.covariance))
    free = np.flatnonzero(sd > 0)
    unit, freedom = found.mean_error, found.degrees_of_freedom
    if not (freedom > 0 and unit > 0 and len(free)):
        return [HeldOut(np.nan, 1.0)] * len(exposures)
    scale = sd[free] / unit
    attitude, camera = partials(exposures, found.camera, site, catalogue, earth)
    camera = camera[:, :, free] * (scale / pixel_sd)
    attitude, residuals = attitude / pixel_sd, found.residuals / pixel_sd
    cofactors = found.camera.covariance[np.ix_(free, free)] / unit**2 / np.outer(scale, scale)
    # The square root of the cofactors makes the information of the whole night the unit matrix.
    values, vectors = np.linalg.eigh(cofactors)
    camera = camera @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    omega = unit**2 * freedom
    tests = []
    for number in range(len(exposures)):
        of = found.exposures == number
        rows = camera[of].reshape(-1, len(free)), attitude[of].reshape(-1, _ATTITUDE)
        total, rank = _held_out(*rows, residuals[of].ravel())
        tests.append(_test(total, rank, omega - total, freedom - rank))
    return tests


def fewer_stars(images: Indices, matched: Indices) -> list[int]:
    """Return the exposures in which far fewer images have a star than in the others, the worst first.

    Less than half of the share of the others, and that beyond chance: the probability of so few among so
    many, binomial, is below 5 % for all exposures together.

    Parameters
    ----------
    images, matched
        (E,) of each exposure.
    """
    found = []
    for number, (count, few) in enumerate(zip(images.tolist(), matched.tolist(), strict=True)):
        others = int(images.sum()) - count
        share = (int(matched.sum()) - few) / others if others else 0.0
        if few < 0.5 * share * count:
            # As many without a star, or more; the share of a star missing is small enough for the tail in
            # logs.
            probability = binomial_tail(count, 1.0 - share, count - few)
            if probability < LEVEL / len(images):
                found.append((few / (share * count), number))
    return [number for _, number in sorted(found)]


def _held_out(camera: Floats, attitude: Floats, residuals: Floats) -> tuple[float, int]:
    """Return T and its rank; the information of the whole night is the unit matrix."""
    base, _ = np.linalg.qr(attitude / np.maximum(np.linalg.norm(attitude, axis=0), 1e-300))
    own = camera - base @ (base.T @ camera)
    share, directions = np.linalg.eigh(np.eye(camera.shape[1]) - own.T @ own)
    seen = share > _INVISIBLE
    gradient = directions[:, seen].T @ (own.T @ residuals)
    total = float(residuals @ residuals + np.sum(gradient**2 / share[seen]))
    return total, len(residuals) - _ATTITUDE - int((~seen).sum())


def _test(total: float, rank: int, others: float, freedom: int) -> HeldOut:
    if rank < 1 or freedom < 1:
        return HeldOut(np.nan, 1.0)
    # The sum of the others is not negative, but for what is not linear.
    variance = max(others, 1e-12 * total) / freedom
    probability = _photocore.chi_square(total / variance, float(rank), upper=True)
    return HeldOut(float(np.sqrt(total / rank / variance)), probability)
