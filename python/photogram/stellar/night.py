"""A night of exposures: from measured star images and rough attitudes to the calibrated camera.

Stars are identified with an ideal camera first, then again with the calibrated one; images that contradict it
are left out, one round after the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from photogram.errors import InputError
from photogram.messages import Message
from photogram.stellar.cameras import BrownCamera
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.matching import mutually_nearest
from photogram.stellar.places import Earth, apparent_places, sidereal_time
from photogram.stellar.skies import (
    Exposure,
    SkyCalibration,
    calibrate_exposures,
    identify,
    project_sky,
    stars_near,
)
from photogram.stellar.sky import Site

__all__ = ["CalibratedNight", "Night", "calibrate_night"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

CORRELATED = 0.95
"""Correlations above this are named."""
SIGNIFICANT = 1.96
"""Distortion terms below this multiple of their mean error are named (5 % of error)."""
_ROUNDS = 20
_REACH = 3.0
"""Distance from a predicted image up to which a measured one is called its star at least, pixels."""
_FEWEST = 2
"""Stars that an attitude needs."""


@dataclass(frozen=True, eq=False)
class Night:
    """Exposures of one camera, and what is known of it beforehand.

    Attributes
    ----------
    site, earth
        Where the camera stood; UT1 - UTC and the pole.
    catalogue
        As deep as the images.
    frame
        Width and height, pixels.
    camera
        Approximate, such as `BrownCamera.of_field`; or the calibrated one that is `prior`.
    exposures
        With approximate attitudes; images in the order of their brightness. Stars that are known already
        stand in `Exposure.stars`.
    names
        (E,) of the exposures.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    attitude_error
        Largest error of the approximate attitudes, radians.
    tolerance
        Largest distance between an image and its star under the ideal camera, when the best polynomials are
        taken off; pixels.
    rejection
        Images with larger standardized residuals are left out; 0 for none.
    fixed, prior, weigh_stars
        As for `calibrate_exposures`.
    title
        For the report.
    """

    site: Site
    catalogue: Catalogue
    frame: tuple[float, float]
    camera: BrownCamera
    exposures: Sequence[Exposure]
    names: tuple[str, ...]
    pixel_sd: float = 0.1
    attitude_error: float = float(np.radians(1.0))
    tolerance: float = 8.0
    rejection: float = 4.0
    fixed: tuple[str, ...] = ()
    prior: BrownCamera | None = None
    weigh_stars: bool = False
    earth: Earth = field(default_factory=Earth)
    title: str = ""

    def __post_init__(self) -> None:
        if not self.exposures or len(self.names) != len(self.exposures):
            raise InputError(
                f"there are {len(self.exposures)} exposures, and {len(self.names)} names of them"
            )
        if not (min(self.frame) > 0 and self.pixel_sd > 0 and self.tolerance > 0 and self.rejection >= 0):
            raise InputError(
                "frame, standard deviation and tolerance must be positive, rejection not negative"
            )


@dataclass(frozen=True, eq=False)
class CalibratedNight:
    """A calibrated camera, and what happened to the images.

    Attributes
    ----------
    night
        What was calibrated.
    exposures
        Those that took part, with the stars of their images.
    names
        Their names.
    calibration
        Camera and attitudes.
    identified, rejected
        (E,) images with a star, and those of them that were left out because they contradict the rest.
    messages
        Remarks.
    """

    night: Night
    exposures: tuple[Exposure, ...]
    names: tuple[str, ...]
    calibration: SkyCalibration
    identified: Indices
    rejected: Indices
    messages: tuple[Message, ...]

    @property
    def converged(self) -> bool:
        """Whether the last adjustment ended by its criterion."""
        return self.calibration.status == "converged"

    @property
    def camera(self) -> BrownCamera:
        """The calibrated camera."""
        return self.calibration.camera

    def correlated(self) -> list[tuple[str, str, float]]:
        """Name pairs of camera parameters whose correlation exceeds 0.95."""
        sd = np.sqrt(np.diag(self.camera.covariance))
        scale = np.divide(1.0, sd, out=np.zeros_like(sd), where=sd > 0)
        found = self.camera.covariance * np.outer(scale, scale)
        rows, columns = np.nonzero(np.triu(np.abs(found) > CORRELATED, 1))
        names = BrownCamera.NAMES
        return [(names[i], names[j], float(found[i, j])) for i, j in zip(rows, columns, strict=True)]

    def significance(self) -> dict[str, float]:
        """Return each estimated distortion term over its mean error."""
        sd = np.sqrt(np.diag(self.camera.covariance))
        rows = zip(BrownCamera.NAMES[4:], self.camera.values[4:], sd[4:], strict=True)
        return {name: float(abs(value) / error) for name, value, error in rows if error > 0}


@dataclass(frozen=True, eq=False)
class _Seen:
    """An exposure that takes part.

    Attributes
    ----------
    index
        Among those of the night.
    stars
        (k,) catalogue star of each image, -1 for none.
    kept
        (k,) which images take part.
    """

    index: int
    stars: Indices
    kept: NDArray[np.bool_]

    def exposure(self, night: Night, attitude: Floats | None = None) -> Exposure:
        """Return the exposure with the stars of the images that take part."""
        given = night.exposures[self.index]
        start = given.attitude if attitude is None else attitude
        return replace(given, attitude=start, stars=np.where(self.kept, self.stars, -1))


def calibrate_night(night: Night, threads: int | None = None) -> CalibratedNight:
    """Identify the stars of a night and calibrate the camera.

    Raises
    ------
    InputError
        No exposure shows enough stars of the catalogue.
    AdjustmentError
        The stars do not determine the camera.
    """
    # The pole turns all attitudes alike: it waits for the last adjustment.
    still = replace(night, earth=Earth(night.earth.dut1))
    seen, messages = _identified(still)
    found = _adjusted(still, [each.exposure(still) for each in seen], night.camera, threads)
    for _ in range(_ROUNDS):
        pairs = zip(seen, found.attitudes, strict=True)
        again = [_seen_again(still, each, found, attitude) for each, attitude in pairs]
        same = zip(again, seen, strict=True)
        if all((a.kept == b.kept).all() and (a.stars == b.stars).all() for a, b in same):
            break
        seen = again
        exposures = [each.exposure(still, a) for each, a in zip(seen, found.attitudes, strict=True)]
        found = _adjusted(still, exposures, found.camera, threads)
    else:
        messages.append(Message(f"images still come and go after {_ROUNDS} rounds of rejection"))
    exposures = [each.exposure(still, a) for each, a in zip(seen, found.attitudes, strict=True)]
    if night.earth.pole != (0.0, 0.0):
        found = _adjusted(night, exposures, found.camera, threads)
    result = CalibratedNight(
        night=night,
        exposures=tuple(exposures),
        names=tuple(night.names[each.index] for each in seen),
        calibration=found,
        identified=np.array([int((each.stars >= 0).sum()) for each in seen]),
        rejected=np.array([int(((each.stars >= 0) & ~each.kept).sum()) for each in seen]),
        messages=(),
    )
    return replace(result, messages=(*messages, *_doubtful(result)))


def _adjusted(
    night: Night, exposures: Sequence[Exposure], camera: BrownCamera, threads: int | None
) -> SkyCalibration:
    return calibrate_exposures(
        exposures,
        camera,
        night.site,
        night.catalogue,
        pixel_sd=night.pixel_sd,
        fixed=night.fixed,
        prior=night.prior,
        weigh_stars=night.weigh_stars,
        earth=night.earth,
        threads=threads,
    )


def _identified(night: Night) -> tuple[list[_Seen], list[Message]]:
    """Identify stars with the camera as it is known beforehand; leave out exposures that show too few."""
    radius = float(night.camera.values[0]) * math.tan(night.attitude_error)
    seen, messages = [], []
    for index, exposure in enumerate(night.exposures):
        stars = exposure.stars
        if stars is None:
            stars = identify(
                exposure,
                night.camera,
                night.site,
                night.catalogue,
                frame=night.frame,
                radius=radius,
                tolerance=night.tolerance,
                earth=night.earth,
            )
        count = int((stars >= 0).sum())
        if count < _FEWEST:
            name = night.names[index]
            text = f"exposure {name} is left out: {count} of its {len(stars)} images are identified"
            messages.append(Message(text))
        else:
            seen.append(_Seen(index, stars, stars >= 0))
    if not seen:
        raise InputError("no exposure shows stars of the catalogue where its attitude says they are")
    return seen, messages


def _seen_again(night: Night, seen: _Seen, found: SkyCalibration, attitude: Floats) -> _Seen:
    """Identify stars with the calibrated camera, and leave out images that are far from theirs."""
    given = night.exposures[seen.index]
    noise = max(1.4826 * float(np.median(np.abs(found.residuals))), 1e-3 * night.pixel_sd)
    limit = night.rejection * noise if night.rejection else math.inf
    turned = replace(given, attitude=attitude)
    near = stars_near(turned, found.camera, night.site, night.catalogue, night.frame, 0.0, night.earth.dut1)
    stars = given.stars
    if stars is not None:
        near = np.union1d(near, stars[stars >= 0])
    places = apparent_places(night.catalogue.take(near), given.utc)
    time = sidereal_time(night.site, given.utc, night.earth.dut1)
    predicted = project_sky(found.camera, attitude, night.site, places, time)
    if stars is None:
        reach = max(2 * night.rejection * noise, _REACH)
        with np.errstate(invalid="ignore"):
            seen_by = ((predicted > -reach) & (predicted < np.array(night.frame) + reach)).all(axis=1)
        inside = np.flatnonzero(seen_by)
        nearest = mutually_nearest(given.xy, predicted[inside], reach)
        local = np.where(nearest >= 0, inside[nearest], -1) if len(inside) else nearest
        stars = np.where(local >= 0, near[local], -1)
    else:
        local = np.where(stars >= 0, np.searchsorted(near, stars), -1)
    off = np.abs(given.xy - predicted[local]).max(axis=1)
    kept = (stars >= 0) & (off <= limit)
    return _Seen(seen.index, stars, kept) if kept.sum() >= _FEWEST else seen


def _doubtful(result: CalibratedNight) -> list[Message]:
    """Name what the stars hardly determine."""
    status = result.calibration.status
    texts = [] if result.converged else [f"the adjustment has not converged: {status}"]
    texts += [f"correlation of {a} and {b}: {r:+.4f}" for a, b, r in result.correlated()]
    weak = [f"{name} ({t:.1f} mean errors)" for name, t in result.significance().items() if t < SIGNIFICANT]
    if weak:
        texts.append(f"distortion terms that are not significant: {', '.join(weak)}")
    return [Message(text) for text in texts]
