"""A night of exposures: from measured star images and rough attitudes to the calibrated camera.

Stars are identified with an ideal camera first, then again with the calibrated one; images that contradict it
are left out, one round after the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.messages import Message, listed
from photogram.show.ways import Judged
from photogram.statistics.limits import GlobalTest, global_test
from photogram.stellar.cameras import BrownCamera
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.comparison import held_out
from photogram.stellar.hints import Setting, find_hint
from photogram.stellar.identification import Found, Sighting, identify, identify_again
from photogram.stellar.odds import ACCEPTED
from photogram.stellar.places import Earth
from photogram.stellar.skies import Exposure, SkyCalibration, calibrate_exposures
from photogram.stellar.sky import Site

__all__ = ["CalibratedNight", "Night", "calibrate_night"]


CORRELATED = 0.95
"""Correlations above this are named."""
SIGNIFICANT = 1.96
"""Distortion terms below this multiple of their mean error are named (5 % of error)."""
_ROUNDS = 20
_REACH = 3.0
"""Distance from a predicted image up to which a measured one is called its star at least, pixels."""
_FEWEST = 2
"""Stars that an attitude needs."""
DOUBTFUL = 5.0
"""Residuals that are larger than assumed by more than this make no camera."""


@dataclass(frozen=True, eq=False)
class Night:
    """Exposures of one camera, and what is known of it beforehand.

    Attributes
    ----------
    site, earth
        Where the camera stood; UT1 - UTC and the pole.
    catalogue
        The brightest stars first (`Catalogue.brighter`); at least as deep as the images.
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
class CalibratedNight(Judged):
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
    odds
        (E,) expected number of wrong attitudes under which as many images have a star, under the final
        camera. NaN where the images name their stars.
    messages
        Remarks.
    """

    night: Night
    exposures: tuple[Exposure, ...]
    names: tuple[str, ...]
    calibration: SkyCalibration
    identified: Indices
    rejected: Indices
    odds: Floats
    messages: tuple[Message, ...]

    @property
    def converged(self) -> bool:
        """Whether the last adjustment ended by its criterion."""
        return self.calibration.status == "converged"

    @cached_property
    def test(self) -> GlobalTest | None:
        """The global test of the residuals against `Night.pixel_sd`."""
        found = self.calibration
        return global_test(found.mean_error**2 * found.degrees_of_freedom, found.degrees_of_freedom)

    @property
    def usable(self) -> bool:
        """Whether the camera may be used.

        Not so when the adjustment has not converged, residuals are larger than assumed by a factor of
        `DOUBTFUL`, or more exposures are left out than take part.
        """
        test = self.test
        beyond = test is not None and test.rejected_high and test.factor > DOUBTFUL
        return self.converged and not beyond and not self.mostly_left_out

    @property
    def mostly_left_out(self) -> bool:
        """Whether more exposures are left out than take part."""
        return len(self.night.exposures) > 2 * len(self.exposures)

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
    odds
        Expected number of wrong attitudes that would do as well.
    """

    index: int
    stars: Indices
    kept: NDArray[np.bool_]
    odds: float = 0.0

    def exposure(self, night: Night, attitude: Floats | None = None) -> Exposure:
        """Return the exposure with the stars of the images that take part."""
        given = night.exposures[self.index]
        start = given.attitude if attitude is None else attitude
        return replace(given, attitude=start, stars=np.where(self.kept, self.stars, -1))


def calibrate_night(night: Night, threads: int | None = None) -> CalibratedNight:
    """Identify the stars of a night and calibrate the camera.

    An exposure takes part when chance would not have found its stars (`photogram.stellar.odds`), and stays
    when it fits the camera of the others (`photogram.stellar.comparison`). The others are named, with the
    mistake that explains them if there is one (`photogram.stellar.hints`).

    Raises
    ------
    InputError
        No exposure shows enough stars of the catalogue.
    AdjustmentError
        The stars do not determine the camera.
    """
    # The pole turns all attitudes alike: it waits for the last adjustment.
    still = replace(night, earth=Earth(night.earth.dut1))
    run = _Run(still, threads)
    run.compare()
    if run.identify_left_out():
        run.compare()
    if night.earth.pole != (0.0, 0.0):
        run.adjust(night)
    result = CalibratedNight(
        night=night,
        exposures=tuple(run.exposures()),
        names=tuple(night.names[each.index] for each in run.seen),
        calibration=run.found,
        identified=np.array([int((each.stars >= 0).sum()) for each in run.seen]),
        rejected=np.array([int(((each.stars >= 0) & ~each.kept).sum()) for each in run.seen]),
        odds=np.array([each.odds for each in run.seen]),
        messages=(),
    )
    return replace(result, messages=(*_failed(result), *run.messages(), *_doubtful(result)))


class _Run:
    """The exposures that take part, the camera they give, and those that are left out."""

    def __init__(self, night: Night, threads: int | None) -> None:
        self.night, self.threads = night, threads
        self.left_out: dict[int, str] = {}
        self.remarks: list[str] = []
        self.first: list[_Seen] = []
        self.seen: list[_Seen] = []
        self.found: SkyCalibration
        self.unsettled = False
        for index, exposure in enumerate(night.exposures):
            stars = exposure.stars
            if stars is None:
                sighting = _identify(night, index, night.camera, night.tolerance)
                stars = sighting.stars
                if not sighting.accepted:
                    self.left_out[index] = sighting.reason()
            if index not in self.left_out and (stars >= 0).sum() < _FEWEST:
                self.left_out[index] = f"{int((stars >= 0).sum())} of its {len(stars)} images have a star"
            if index not in self.left_out:
                self.first.append(_Seen(index, stars, stars >= 0))
        unknown = [index for index in self.left_out if night.exposures[index].stars is None]
        hint = find_hint(
            [night.exposures[index] for index in unknown], [night.names[i] for i in unknown], _setting(night)
        )
        if hint:
            named = f"exposure{'s' if len(hint.exposures) > 1 else ''} {listed(list(hint.exposures))}"
            self.remarks.append(f"as it seems, {hint.text}: stars of {named} are found then")
        if not self.first:
            reasons = [f"exposure {night.names[i]}: {reason}" for i, reason in self.left_out.items()]
            texts = ["no exposure shows stars of the catalogue where its attitude says they are"]
            raise InputError("; ".join([*texts, *self.remarks, listed(reasons, 3)]))
        self.settle()

    def exposures(self) -> list[Exposure]:
        pairs = zip(self.seen, self.found.attitudes, strict=True)
        return [each.exposure(self.night, attitude) for each, attitude in pairs]

    def adjust(self, night: Night) -> None:
        """Adjust once more from the values that were found."""
        self.found = _adjusted(night, self.exposures(), self.found.camera, self.threads)

    def settle(self) -> None:
        """Adjust from the first identification, until no image comes or goes."""
        night, self.seen = self.night, self.first
        exposures = [each.exposure(night) for each in self.seen]
        self.found = _adjusted(night, exposures, night.camera, self.threads)
        self.unsettled = True
        for _ in range(_ROUNDS):
            pairs = zip(self.seen, self.found.attitudes, strict=True)
            again = [_seen_again(night, each, self.found, attitude) for each, attitude in pairs]
            same = zip(again, self.seen, strict=True)
            self.unsettled = not all((a.kept == b.kept).all() and (a.stars == b.stars).all() for a, b in same)
            self.seen = again
            if not self.unsettled:
                break
            self.adjust(night)

    def compare(self) -> None:
        """Take out exposures that do not fit the others, the worst first, until all do."""
        while worst := self._worst():
            index, reason = worst
            self.left_out[index] = reason
            self.first = [each for each in self.first if each.index != index]
            if not self.first:
                name = self.night.names[index]
                raise InputError(f"no exposure is left; the last one, {name}, is left out: {reason}")
            self.settle()

    def _worst(self) -> tuple[int, str] | None:
        by_chance = max(self.seen, key=lambda each: np.nan_to_num(each.odds))
        if by_chance.odds >= ACCEPTED:
            count, images = int(by_chance.kept.sum()), len(by_chance.kept)
            return by_chance.index, (
                f"under the calibrated camera {count} of its {images} images have a star, which chance may do"
            )
        tests = held_out(
            self.exposures(),
            self.found,
            self.night.site,
            self.night.catalogue,
            pixel_sd=self.night.pixel_sd,
            earth=self.night.earth,
        )
        unlike = [(test.factor, k) for k, test in enumerate(tests) if test.unlike(len(tests))]
        if not unlike:
            return None
        factor, k = max(unlike)
        return self.seen[k].index, (
            f"under the camera of the other exposures its residuals are {factor:.3g} times larger than theirs"
        )

    def identify_left_out(self) -> bool:
        """Try exposures that are left out once more, with the calibrated camera; say whether any is found."""
        night, before = self.night, len(self.first)
        tolerance = min(night.tolerance, max(2 * night.rejection * _noise(night, self.found), _REACH))
        for index in [i for i in self.left_out if night.exposures[i].stars is None]:
            sighting = _identify(night, index, self.found.camera, tolerance)
            if sighting.accepted and (sighting.stars >= 0).sum() >= _FEWEST:
                del self.left_out[index]
                self.first.append(_Seen(index, sighting.stars, sighting.stars >= 0))
        self.first.sort(key=lambda each: each.index)
        if len(self.first) == before:
            return False
        self.settle()
        return True

    def messages(self) -> list[Message]:
        """Say what was left out, and why."""
        names = self.night.names
        texts = [
            *self.remarks,
            *(f"exposure {names[i]} is left out: {reason}" for i, reason in sorted(self.left_out.items())),
        ]
        if self.unsettled:
            texts.append(f"images still come and go after {_ROUNDS} rounds of rejection")
        return [Message(text) for text in texts]


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


def _setting(night: Night) -> Setting:
    return Setting(
        night.site,
        night.catalogue,
        night.frame,
        night.camera,
        night.attitude_error,
        night.tolerance,
        night.earth,
    )


def _identify(night: Night, index: int, camera: BrownCamera, tolerance: float) -> Sighting:
    return identify(
        night.exposures[index],
        camera,
        night.site,
        night.catalogue,
        frame=night.frame,
        radius=_setting(night).radius,
        tolerance=tolerance,
        earth=night.earth,
    )


def _noise(night: Night, found: SkyCalibration) -> float:
    """Return the robust standard deviation of the residuals, pixels."""
    return max(1.4826 * float(np.median(np.abs(found.residuals))), 1e-3 * night.pixel_sd)


def _seen_again(night: Night, seen: _Seen, found: SkyCalibration, attitude: Floats) -> _Seen:
    """Identify stars with the calibrated camera, and leave out images that are far from theirs."""
    given, noise = night.exposures[seen.index], _noise(night, found)
    limit = night.rejection * noise if night.rejection else math.inf
    again = identify_again(
        replace(given, attitude=attitude),
        found.camera,
        night.site,
        night.catalogue,
        frame=night.frame,
        reach=max(2 * night.rejection * noise, _REACH),
        earth=night.earth,
    )
    with np.errstate(invalid="ignore"):
        kept = again.off <= limit
    if kept.sum() < _FEWEST:
        return replace(seen, odds=math.inf)
    odds = math.nan if given.stars is not None else _odds(night, again, limit)
    return _Seen(seen.index, again.stars, kept, odds)


def _odds(night: Night, again: Found, limit: float) -> float:
    reach = limit if math.isfinite(limit) else _REACH
    return again.expected(reach, _setting(night).radius, night.frame)


def _failed(result: CalibratedNight) -> list[Message]:
    """Say what makes the camera unfit for use, and of which nature it is."""
    texts = []
    if not result.converged:
        texts.append(f"the adjustment has not converged: {result.calibration.status}: do not use this camera")
    if result.mostly_left_out:
        texts.append("more exposures are left out than take part: do not use this camera")
    test = result.test
    failed = test.problem() if test else None
    if test and failed:
        texts.append(f"{failed}: do not use this camera" if test.factor > DOUBTFUL else failed)
        texts.append(
            "the stars are found beyond doubt: sd_px is too small, or the terms of Brown do not describe this"
            " camera (a fisheye needs others)"
        )
    return [Message(text) for text in texts]


def _doubtful(result: CalibratedNight) -> list[Message]:
    """Name what the stars hardly determine."""
    texts = [f"correlation of {a} and {b}: {r:+.4f}" for a, b, r in result.correlated()]
    weak = [f"{name} ({t:.1f} mean errors)" for name, t in result.significance().items() if t < SIGNIFICANT]
    if weak:
        texts.append(f"distortion terms that are not significant: {', '.join(weak)}")
    return [Message(text) for text in texts]
