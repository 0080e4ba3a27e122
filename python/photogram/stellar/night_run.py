"""The exposures of a night that take part, the camera they give, and those that are left out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message, listed
from photogram.stellar.comparison import fewer_stars, held_out
from photogram.stellar.hints import Hint, Setting, find_hint
from photogram.stellar.identification import STARS_OF_AN_ATTITUDE, Found, identify, identify_again
from photogram.stellar.matching import STRETCH
from photogram.stellar.night_result import Night
from photogram.stellar.odds import ACCEPTED, CERTAIN, DOUBTFUL, LOG_ODDS
from photogram.stellar.pointing import turn_between
from photogram.stellar.sky_calibration import Exposure, SkyCalibration, calibrate_exposures
from photogram.stellar.sky_cameras import SkyCamera

_ROUNDS = 20
_REACH = 3.0
"""Distance from a predicted image up to which a measured one is called its star at least, pixels."""
_FAR = 2.0
"""Errors of the approximate attitudes from which an exposure is named: the lens was not known, either."""
_UNEXPLAINED = (
    "none of the mistakes that are often made explains it (angles, mirrored images, place, time, field of"
    " view): compare attitudes, attitude_error_deg and field of view with the exposures, and the catalogue"
    " with the images"
)


@dataclass(frozen=True, eq=False)
class Seen:
    """An exposure that takes part."""

    index: int  # Among those of the night
    stars: Indices  # (k,) catalogue star of each image, -1 for none
    kept: Bools  # (k,) which images take part
    attitude: Floats  # (3,) that the stars of the first identification give
    # Expected number of chance matches as good as the first identification; NaN where images name their
    # stars
    first: float = math.nan
    odds: float = 0.0  # Expected number of wrong attitudes that would do as well under the camera
    log_odds: float = math.nan  # Of the exposure against chance, as Lang et al. have them
    probabilities: Floats = field(default_factory=lambda: np.zeros(0))  # (k,) of the stars; NaN for none
    scale: float = 1.0  # Of predicted images over measured ones

    @property
    def expected(self) -> float:
        """The larger of the two expected numbers; NaN where the images name their stars."""
        return max(self.first, self.odds) if math.isfinite(self.first) else math.nan

    def exposure(self, night: Night, attitude: Floats | None = None) -> Exposure:
        """Return the exposure with the stars of the images that take part."""
        given = night.exposures[self.index]
        start = self.attitude if attitude is None else attitude
        return replace(given, attitude=start, stars=np.where(self.kept, self.stars, -1))


class Run:
    """The exposures that take part, the camera they give, and those that are left out."""

    def __init__(self, night: Night, threads: int | None) -> None:
        self.night, self.threads = night, threads
        self.left_out: dict[int, str] = {}
        self.doubtful: dict[int, float] = {}
        self.tried: dict[int, float] = {}
        self.first: list[Seen] = []
        self.seen: list[Seen] = []
        self.found: SkyCalibration
        self.unsettled = False
        for index, exposure in enumerate(night.exposures):
            if index in night.nowhere:
                self.left_out[index] = night.nowhere[index]
            elif exposure.stars is None:
                self._sight(index, night.camera, night.tolerance, night.field_error)
            else:
                self._take(Seen(index, exposure.stars, exposure.stars >= 0, exposure.attitude))
        unknown = self._unidentified()
        hint = find_hint(
            [night.exposures[index] for index in unknown],
            [night.names[i] for i in unknown],
            setting_of(night),
        )
        self.hint = hint
        if not self.first:
            reasons = [f"exposure {night.names[i]}: {reason}" for i, reason in self.left_out.items()]
            texts = ["no exposure shows stars of the catalogue where its attitude says they are"]
            explained = [_said(hint) if hint else _UNEXPLAINED]
            raise InputError("; ".join([*texts, *explained, listed(reasons, 3)]))
        self.settle()

    def _sight(self, index: int, camera: SkyCamera, tolerance: float, field_error: float) -> None:
        """Identify an exposure: it takes part when chance would not have done so, or the user says so."""
        night = self.night
        sighting = identify(
            night.exposures[index],
            camera,
            night.site,
            night.catalogue,
            frame=night.frame,
            radius=setting_of(night).radius,
            tolerance=tolerance,
            earth=night.earth,
            stretch=field_error,
            roll_known=night.roll_known,
            tried=self.tried.get(index, 0.0),
        )
        made = sighting.match
        self.tried[index] = made.hypotheses
        self.doubtful.pop(index, None)
        confirmed = sighting.doubtful and night.names[index] in night.confirmed
        if not (sighting.accepted or confirmed):
            self.left_out[index] = sighting.reason()
            if sighting.doubtful:
                self.doubtful[index] = made.expected
            return
        stars = sighting.found
        self._take(Seen(index, stars, stars >= 0, sighting.attitude, first=made.expected, scale=made.scale))

    def _unidentified(self) -> list[int]:
        """Return the exposures that are left out and may be found otherwise."""
        night = self.night
        return [i for i in self.left_out if night.exposures[i].stars is None and i not in night.nowhere]

    def _take(self, seen: Seen) -> None:
        """Let an exposure take part if it has stars enough."""
        count = int((seen.stars >= 0).sum())
        if count < STARS_OF_AN_ATTITUDE:
            self.left_out[seen.index] = f"{count} of its {len(seen.stars)} images have a star"
        else:
            self.left_out.pop(seen.index, None)
            self.first.append(seen)

    def exposures(self) -> list[Exposure]:
        """Return the exposures that take part, with their stars and attitudes."""
        pairs = zip(self.seen, self.found.attitudes, strict=True)
        return [each.exposure(self.night, attitude) for each, attitude in pairs]

    def adjust(self, night: Night) -> None:
        """Adjust once more from the values that were found."""
        self.found = adjusted(night, self.exposures(), self.found.camera, self.threads)

    def settle(self) -> None:
        """Adjust from the first identification, until no image comes or goes."""
        night, self.seen = self.night, self.first
        exposures = [each.exposure(night) for each in self.seen]
        self.found = adjusted(night, exposures, self._start(), self.threads)
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

    def _start(self) -> SkyCamera:
        """Return the camera to begin with: of the scale that its exposures have."""
        camera, scales = self.night.camera, [each.scale for each in self.first]
        if self.night.prior is not None or camera.known.any():
            return camera
        values = camera.values.copy()
        values[:2] /= float(np.median(scales))
        return replace(camera, values=values)

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
        name = self.night.names[by_chance.index]
        allowed = DOUBTFUL if name in self.night.confirmed else ACCEPTED
        if by_chance.odds >= allowed:
            if by_chance.odds <= DOUBTFUL:
                self.doubtful[by_chance.index] = by_chance.odds
            count, images = int(by_chance.kept.sum()), len(by_chance.kept)
            return by_chance.index, (
                f"under the calibrated camera {count} of its {images} images have a star, which chance may do"
            )
        unnamed = [
            each
            for each in self.seen
            if self.night.exposures[each.index].stars is None
            and self.night.names[each.index] not in self.night.confirmed
        ]
        poor = fewer_stars(
            np.array([len(each.kept) for each in unnamed]), np.array([each.kept.sum() for each in unnamed])
        )
        if poor:
            each = unnamed[poor[0]]
            return each.index, (
                f"under the calibrated camera {int(each.kept.sum())} of its {len(each.kept)} images have a"
                " star, less than half of what the other exposures have"
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

    def _far(self) -> list[str]:
        """Name exposures whose stars turn them farther from the given attitude than it may be wrong."""
        night, texts = self.night, []
        width, height = night.frame
        corners = np.array([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]])
        looked = corners if night.roll_known else np.array([[0.5 * width, 0.5 * height]])
        rays = self.found.camera.rays(looked)
        for each, attitude in zip(self.seen, self.found.attitudes, strict=True):
            given = night.exposures[each.index]
            turn = turn_between(given.attitude, attitude, rays)
            if given.stars is None and turn > _FAR * night.attitude_error:
                texts.append(
                    f"exposure {night.names[each.index]}: its stars are up to {math.degrees(turn):.1f}"
                    " degrees from where its attitude says, which is said to be wrong by"
                    f" {math.degrees(night.attitude_error):g}: look at its time, its angles and the station"
                )
        return texts

    def identify_left_out(self) -> bool:
        """Try exposures that are left out once more, with the calibrated camera; say whether any is found."""
        night, before = self.night, len(self.first)
        tolerance = min(night.tolerance, max(2 * night.rejection * _noise(night, self.found), _REACH))
        for index in self._unidentified():
            self._sight(index, self.found.camera, tolerance, STRETCH)
        self.first.sort(key=lambda each: each.index)
        if len(self.first) == before:
            return False
        self.settle()
        return True

    def messages(self) -> list[Message]:
        """Say what was left out, and why."""
        names = self.night.names
        # What was found after all needs no explanation.
        explains = self.hint and {names[i] for i in self.left_out} & set(self.hint.exposures)
        texts = [
            *([_said(self.hint)] if self.hint and explains else []),
            *self._far(),
            *(f"exposure {names[i]} is left out: {reason}" for i, reason in sorted(self.left_out.items())),
        ]
        texts += [
            f"exposure {names[each.index]}: the count of its stars and the odds of their distances disagree"
            f" (by chance {each.expected:.2g}, log odds {each.log_odds:.1f}, accepted from {LOG_ODDS:.1f})"
            for each in self.seen
            if math.isfinite(each.expected) and (each.expected < ACCEPTED) != (each.log_odds > LOG_ODDS)
        ]
        if self.unsettled:
            texts.append(f"images still come and go after {_ROUNDS} rounds of rejection")
        return [Message(text) for text in texts]


def _said(hint: Hint) -> str:
    named = f"exposure{'s' if len(hint.exposures) > 1 else ''} {listed(list(hint.exposures))}"
    return f"as it seems, {hint.text}: stars of {named} are found then"


def adjusted(
    night: Night, exposures: Sequence[Exposure], camera: SkyCamera, threads: int | None
) -> SkyCalibration:
    """Adjust exposures of a night with their stars."""
    return calibrate_exposures(
        exposures,
        camera,
        night.site,
        night.catalogue,
        pixel_sd=night.pixel_sd,
        fixed=sorted({*night.fixed, *camera.facts.held}),
        common_scale=night.common_scale,
        prior=night.prior,
        weigh_stars=night.weigh_stars,
        earth=night.earth,
        threads=threads,
    )


def setting_of(night: Night) -> Setting:
    """Return what exposures of a night are identified with."""
    return Setting(
        night.site,
        night.catalogue,
        night.frame,
        night.camera,
        night.attitude_error,
        night.tolerance,
        night.earth,
        night.field_error,
        night.roll_known,
    )


def _noise(night: Night, found: SkyCalibration) -> float:
    """Return the robust standard deviation of the residuals, pixels."""
    return max(1.4826 * float(np.median(np.abs(found.residuals))), 1e-3 * night.pixel_sd)


def _seen_again(night: Night, seen: Seen, found: SkyCalibration, attitude: Floats) -> Seen:
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
    probabilities = again.probabilities(noise)
    with np.errstate(invalid="ignore"):
        kept = again.off <= limit
        if night.rejection:
            kept &= ~(probabilities < CERTAIN)
    if kept.sum() < STARS_OF_AN_ATTITUDE:
        return replace(seen, odds=math.inf)
    odds = log_odds = math.nan
    if given.stars is None:
        odds, log_odds = _odds(night, again, limit), again.log_odds(noise)
    return replace(
        seen, stars=again.stars, kept=kept, odds=odds, log_odds=log_odds, probabilities=probabilities
    )


def _odds(night: Night, again: Found, limit: float) -> float:
    """Return the expected number of wrong attitudes with as many stars under the camera."""
    reach = limit if math.isfinite(limit) else _REACH
    radius = setting_of(night).radius
    # A whole turn moves the corners by their circle.
    roll = radius if night.roll_known else 0.5 * math.pi * math.hypot(*night.frame)
    return again.expected(reach, radius, roll)
