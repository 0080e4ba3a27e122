"""Selection of the exposures of a night during identification and adjustment."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.point_sets import mutually_nearest
from photogram.stellar.comparison import LEVEL, NOTABLE, fewer_stars, held_out
from photogram.stellar.identification import (
    ACCEPTED,
    CERTAIN,
    DOUBTFUL,
    LOG_ODDS,
    STARS_OF_AN_ATTITUDE,
    STRETCH,
    Match,
    attitude_radius,
    expected_false,
    identify,
    log_odds,
    sky_share,
    star_probabilities,
    stars_near,
)
from photogram.stellar.night_result import Night
from photogram.stellar.places import (
    apparent_places,
    attitude_of,
    axis_of,
    roll_of,
    sidereal_time,
    turn_between,
)
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, SkyCalibration, calibrate_exposures, project_sky
from photogram.stellar.sky_cameras import SkyCamera
from photogram.words import Phrase, phrase

MAX_REJECTION_ROUNDS = 20
_REACH = 3.0  # Least search distance of the star of an image, pixels
_NOTABLE_ERROR = 2.0
"""Notable multiple of the error of approximate attitudes, for a warning."""


@dataclass(frozen=True, eq=False)
class Seen:
    index: int  # Index among the exposures of the night
    stars: Indices  # (k,) catalogue star of each image, -1 for none
    kept: Bools  # (k,) whether images are used
    attitude: Floats  # (3,) from the stars of the first identification
    # Expected number of chance matches as good as the first identification; NaN if images name their stars
    first: float = math.nan
    odds: float = 0.0  # Expected number of wrong attitudes with an equally good match under the camera
    log_odds: float = math.nan  # Logarithmic odds of the exposure against chance (Lang et al.)
    probabilities: Floats = field(default_factory=lambda: np.zeros(0))  # (k,) of the stars; NaN for none
    scale: float = 1.0  # Scale of predicted relative to measured images

    @property
    def expected(self) -> float:
        """Larger of the two expected numbers; NaN if the images name their stars."""
        return max(self.first, self.odds) if math.isfinite(self.first) else math.nan

    @property
    def count(self) -> int:
        return int(self.kept.sum())

    def exposure(self, night: Night, attitude: Floats) -> Exposure:
        stars = np.where(self.kept, self.stars, -1)
        return replace(night.exposures[self.index], attitude=attitude, stars=stars)


class Run:
    """Used exposures with their camera, and rejected ones."""

    def __init__(self, night: Night, threads: int | None) -> None:
        self.night, self.threads = night, threads
        self.rejected: dict[int, str | Phrase] = {}  # reasons
        self.doubtful: dict[int, float] = {}  # expected numbers of chance matches
        self.tried: dict[int, float] = {}  # numbers of hypotheses
        self.first: list[Seen] = []
        self.seen: list[Seen] = []
        self.found: SkyCalibration
        self.unsettled = False
        for index, exposure in enumerate(night.exposures):
            if index in night.nowhere:
                self.rejected[index] = night.nowhere[index]
            elif exposure.stars is None:
                self._sight(index, night.camera, night.tolerance, night.field_error)
            else:
                self._take(Seen(index, exposure.stars, exposure.stars >= 0, exposure.attitude))
        self.hint = find_hint(night, self._unidentified())
        if not self.first:
            reasons = [self._named("stars.exposure", i, reason=text) for i, text in self.rejected.items()]
            cause = self._cause() if self.hint else phrase("stars.unexplained")
            raise InputError(phrase("stars.no-exposure", cause=cause, reasons=reasons))
        self.settle()

    def _named(self, code: str, index: int, **fields: object) -> Phrase:
        return Phrase(code, {"name": self.night.names[index], **fields})

    def _sight(self, index: int, camera: SkyCamera, tolerance: float, stretch: float) -> None:
        """Identify an exposure; use it if it is significant or confirmed by the user."""
        night, tried = self.night, self.tried.get(index, 0.0)
        match, stars, attitude = identify(
            night.exposures[index], night, camera, tolerance=tolerance, stretch=stretch, tried=tried
        )
        self.tried[index] = match.hypotheses
        self.doubtful.pop(index, None)
        if match.accepted or (match.doubtful and night.names[index] in night.confirmed):
            self._take(Seen(index, stars, stars >= 0, attitude, match.expected, scale=match.scale))
            return
        self.rejected[index] = match.reason()
        if match.doubtful:
            self.doubtful[index] = match.expected

    def _unidentified(self) -> list[int]:
        """Return rejected exposures that another attitude or camera may identify."""
        night = self.night
        return [i for i in self.rejected if night.exposures[i].stars is None and i not in night.nowhere]

    def _take(self, seen: Seen) -> None:
        if seen.count < STARS_OF_AN_ATTITUDE:
            counts = {"matched": seen.count, "images": len(seen.stars), "least": STARS_OF_AN_ATTITUDE}
            self.rejected[seen.index] = Phrase("stars.few-named", counts)
        else:
            self.rejected.pop(seen.index, None)
            self.first.append(seen)

    def exposures(self) -> list[Exposure]:
        pairs = zip(self.seen, self.found.attitudes, strict=True)
        return [seen.exposure(self.night, attitude) for seen, attitude in pairs]

    def adjust(self, night: Night) -> None:
        self.found = adjusted(night, self.exposures(), self.found.camera, self.threads)

    def settle(self) -> None:
        """Adjust from the first identification until the used images do not change."""
        night, self.seen = self.night, self.first
        exposures = [seen.exposure(night, seen.attitude) for seen in self.seen]
        self.found = adjusted(night, exposures, self._start(), self.threads)
        for _ in range(MAX_REJECTION_ROUNDS):
            pairs = zip(self.seen, self.found.attitudes, strict=True)
            again = [_seen_again(night, seen, self.found, attitude) for seen, attitude in pairs]
            same = zip(again, self.seen, strict=True)
            self.unsettled = not all((a.kept == b.kept).all() and (a.stars == b.stars).all() for a, b in same)
            self.seen = again
            if not self.unsettled:
                break
            self.adjust(night)

    def _start(self) -> SkyCamera:
        camera, scales = self.night.camera, [seen.scale for seen in self.first]
        if self.night.prior is not None or camera.known.any():
            return camera
        values = camera.values.copy()
        values[:2] /= float(np.median(scales))
        return replace(camera, values=values)

    def compare(self) -> None:
        while worst := self._worst():
            index, reason = worst
            self.rejected[index] = reason
            self.first = [seen for seen in self.first if seen.index != index]
            if not self.first:
                raise InputError(self._named("stars.no-exposure-left", index, reason=reason))
            self.settle()

    def _worst(self) -> tuple[int, Phrase] | None:
        night, confirmed = self.night, set(self.night.confirmed)
        worst = max(self.seen, key=lambda seen: np.nan_to_num(seen.odds))
        if worst.odds >= (DOUBTFUL if night.names[worst.index] in confirmed else ACCEPTED):
            if worst.odds <= DOUBTFUL:
                self.doubtful[worst.index] = worst.odds
            return worst.index, _counted("stars.matches-by-chance", worst)
        unnamed = [
            seen
            for seen in self.seen
            if night.exposures[seen.index].stars is None and night.names[seen.index] not in confirmed
        ]
        images, matched = np.array([(len(seen.kept), seen.count) for seen in unnamed]).reshape(-1, 2).T
        if poor := fewer_stars(images, matched):
            return unnamed[poor[0]].index, _counted("stars.few-matches", unnamed[poor[0]])
        factors, probabilities = held_out(self.exposures(), self.found, night)
        unlike = (factors > NOTABLE) & (probabilities < LEVEL / len(factors))
        if not unlike.any():
            return None
        k = int(np.where(unlike, factors, 0.0).argmax())
        return self.seen[k].index, phrase("stars.unlike", factor=float(factors[k]))

    def identify_rejected(self) -> bool:
        """Identify rejected exposures with the calibrated camera; return success."""
        night, before = self.night, len(self.first)
        tolerance = min(night.tolerance, max(2 * night.rejection * _noise(night, self.found), _REACH))
        for index in self._unidentified():
            self._sight(index, self.found.camera, tolerance, STRETCH)
        self.first.sort(key=lambda seen: seen.index)
        if len(self.first) == before:
            return False
        self.settle()
        return True

    def messages(self) -> Iterator[Phrase]:
        """Yield messages on rejected exposures, attitudes and odds."""
        # An exposure that was identified later needs no explanation.
        if self.hint and {self.night.names[i] for i in self.rejected} & set(self.hint[1]):
            yield self._cause()
        yield from self._far()
        for index, reason in sorted(self.rejected.items()):
            yield self._named("stars.rejected", index, reason=reason)
        for seen in self.seen:
            if math.isfinite(seen.expected) and (seen.expected < ACCEPTED) != (seen.log_odds > LOG_ODDS):
                odds = {"expected": seen.expected, "odds": seen.log_odds, "limit": LOG_ODDS}
                yield self._named("stars.odds-disagree", seen.index, **odds)
        if self.unsettled:
            yield phrase("stars.unsettled", rounds=MAX_REJECTION_ROUNDS)

    def _cause(self) -> Phrase:
        assert self.hint is not None
        mistake, names = self.hint
        return phrase("stars.cause", mistake=mistake, n=len(names), names=names)

    def _far(self) -> Iterator[Phrase]:
        """Yield warnings on exposures far from their approximate attitude."""
        night, error = self.night, self.night.attitude_error
        width, height = night.frame
        corners = np.array([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]])
        rays = self.found.camera.rays(corners if night.roll_known else corners[3:] / 2)
        for seen, attitude in zip(self.seen, self.found.attitudes, strict=True):
            exposure = night.exposures[seen.index]
            turn = turn_between(exposure.attitude, attitude, rays)
            if exposure.stars is None and turn > _NOTABLE_ERROR * error:
                degrees = {"turn": math.degrees(turn), "error": math.degrees(error)}
                yield self._named("stars.far", seen.index, **degrees)


def _counted(code: str, seen: Seen) -> Phrase:
    return phrase(code, matched=seen.count, images=len(seen.kept))


def adjusted(
    night: Night, exposures: Sequence[Exposure], camera: SkyCamera, threads: int | None
) -> SkyCalibration:
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


def _noise(night: Night, found: SkyCalibration) -> float:
    """Return the robust standard deviation of the residuals, pixels."""
    return max(1.4826 * float(np.median(np.abs(found.residuals))), 1e-3 * night.pixel_sd)


def _seen_again(night: Night, seen: Seen, found: SkyCalibration, attitude: Floats) -> Seen:
    """Find the nearest star of each image with the calibrated camera; named stars are unchanged."""
    exposure, noise = replace(night.exposures[seen.index], attitude=attitude), _noise(night, found)
    frame, site, named = night.frame, night.site, exposure.stars
    limit = night.rejection * noise if night.rejection else math.inf
    reach = max(2 * night.rejection * noise, _REACH)
    near = stars_near(exposure, found.camera, site, night, 0.0)
    if named is not None:
        near = np.union1d(near, named[named >= 0])
    places = apparent_places(night.catalogue.take(near), exposure.utc, site.effects)
    time = sidereal_time(site, exposure.utc, night.earth.dut1)
    predicted = project_sky(found.camera, attitude, site, places, time)
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero(((predicted > -reach) & (predicted < np.array(frame) + reach)).all(axis=1))
        inside = int(((predicted >= 0) & (predicted <= frame)).all(axis=1).sum())
    density = inside / (frame[0] * frame[1] * sky_share(found.camera, attitude, frame))
    if named is None:
        nearest = mutually_nearest(exposure.xy, predicted[rows], reach)
        local = np.where(nearest >= 0, rows[nearest], -1) if len(rows) else nearest
        stars = np.where(local >= 0, near[local], -1)
        probabilities = star_probabilities(exposure.xy, predicted[rows], nearest, noise, density)
    else:
        stars, probabilities = named, np.full(len(named), np.nan)
        local = np.where(named >= 0, np.searchsorted(near, named), -1)
    has = local >= 0
    away = exposure.xy[has] - predicted[local[has]]
    off = np.full(len(local), np.nan)
    off[has] = np.abs(away).max(axis=1)
    with np.errstate(invalid="ignore"):
        kept = off <= limit
        if night.rejection:
            kept &= ~(probabilities < CERTAIN)
    if kept.sum() < STARS_OF_AN_ATTITUDE:
        return replace(seen, odds=math.inf)
    odds = of_exposure = math.nan
    if named is None:
        of_exposure = log_odds(np.linalg.norm(away, axis=1), len(stars), noise, density)
        # Attitudes are counted in steps of the limit. They cover the errors of the approximate attitude and,
        # at the corners, of its roll: a whole rotation moves the corners along their circle.
        step, radius = limit if night.rejection else _REACH, attitude_radius(night)
        roll = radius if night.roll_known else 0.5 * math.pi * math.hypot(*frame)
        attitudes = (1 + 2 * radius / step) ** 2 * (1 + 2 * roll / step)
        matched = int((off <= step).sum())
        odds = expected_false(len(stars), 2, density * (2 * step) ** 2, matched, attitudes)
    return replace(seen, stars=stars, kept=kept, odds=odds, log_odds=of_exposure, probabilities=probabilities)


_MAX_EXPOSURES = 3
_SCALES = tuple(1.1**k for k in range(-6, 7) if k)
"""Ratios of principal distances; each covers half of the distance to the next."""
_WIDE = 0.05
_HOUR = math.tau / 24 * 1.00273790935  # Hourly rotation of the Earth relative to the stars, radians


@dataclass(frozen=True, eq=False)
class _Mistake:
    name: Phrase
    xy: Callable[[Floats, Floats], Floats] | None = None  # Of the images in a frame
    angles: Callable[[float, float, float], tuple[float, float, float]] | None = (
        None  # Azimuth, elevation, roll
    )
    site: Mapping[str, Any] = field(default_factory=dict)
    scale: float = 1.0  # Of the principal distance

    def match(self, exposure: Exposure, night: Night) -> tuple[Match, float]:
        """Return the match of a corrected exposure, and its principal distance."""
        if self.xy is not None:
            xy = np.ascontiguousarray(self.xy(exposure.xy, np.array(night.frame)))
            exposure = replace(exposure, xy=xy)
        if self.angles is not None:
            angles = self.angles(*axis_of(exposure.attitude), roll_of(exposure.attitude))
            exposure = replace(exposure, attitude=attitude_of(*angles))
        values = night.camera.values.copy()
        values[:2] *= self.scale
        camera = replace(night.camera, values=values)
        night = replace(night, camera=camera, site=replace(night.site, **self.site))
        stretch = max(STRETCH if self.scale == 1.0 else _WIDE, night.field_error)
        matched, *_ = identify(exposure, night, camera, tolerance=night.tolerance, stretch=stretch)
        return matched, float(values[0]) / matched.scale


def find_hint(night: Night, unidentified: Sequence[int]) -> tuple[Phrase, tuple[str, ...]] | None:
    """Return the mistake that explains most exposures against chance, and their names.

    Unidentified exposures with the most images are tested. None if all tested mistakes fail.
    """
    order = sorted(unidentified, key=lambda index: -len(night.exposures[index].xy))[:_MAX_EXPOSURES]
    mistakes = [*_mistakes(night.site, roll_known=night.roll_known)]
    best: tuple[int, float] = (0, 0.0)
    hint = None
    for mistake in mistakes:
        explained, odds, distances = [], 0.0, []
        for index in order:
            matched, distance = mistake.match(night.exposures[index], night)
            if matched.expected * len(mistakes) < ACCEPTED:
                explained.append(index)
                odds += math.log(max(matched.expected, 1e-300))
                distances.append(distance)
        if explained and (len(explained), -odds) > best:
            best = len(explained), -odds
            width = 2 * math.degrees(math.atan(night.frame[0] / 2 / float(np.median(distances))))
            name = Phrase(mistake.name.code, {"field": width, **mistake.name.fields})
            hint = name, tuple(night.names[index] for index in unidentified if index in explained)
    return hint


def _mistakes(site: Site, *, roll_known: bool) -> Iterator[_Mistake]:
    """Yield mistakes of images, angles, station, fields of view, clocks, and a known roll.

    Clocks may show the zone time of the longitude, summer time, or an hour more or less. The sky some hours
    later is the sky of a station farther east by the same rotation.
    """
    west, half = site.longitude_west, math.pi / 2
    yield _Mistake(phrase("stars.hint.mirrored-x"), lambda xy, frame: xy * [-1, 1] + frame * [1, 0])
    yield _Mistake(phrase("stars.hint.mirrored-y"), lambda xy, frame: xy * [1, -1] + frame * [0, 1])
    yield _Mistake(phrase("stars.hint.exchanged"), lambda xy, _: xy[:, ::-1])
    north, north_west = phrase("stars.hint.azimuth-from-north"), phrase("stars.hint.azimuth-from-north-west")
    yield _Mistake(north, angles=lambda a, e, r: (a + math.pi, e, r))
    yield _Mistake(phrase("stars.hint.azimuth-east"), angles=lambda a, e, r: (-a, e, r))
    yield _Mistake(north_west, angles=lambda a, e, r: (math.pi - a, e, r))
    yield _Mistake(phrase("stars.hint.zenith-distance"), angles=lambda a, e, r: (a, half - e, r))
    yield _Mistake(phrase("stars.hint.longitude-east"), site={"longitude_west": -west})
    yield _Mistake(phrase("stars.hint.latitude-sign"), site={"latitude": -site.latitude})
    for scale in _SCALES:
        yield _Mistake(phrase("stars.hint.field-of-view"), scale=scale)
    zone = round(-west / _HOUR)
    for hours in sorted({-1, 1, -zone, -zone - 1} - {0}):
        later = {"longitude_west": west - hours * _HOUR}
        yield _Mistake(phrase("stars.hint.utc", hours=hours), site=later)
    if roll_known:
        yield _Mistake(phrase("stars.hint.roll-sign"), angles=lambda a, e, r: (a, e, -r))
    for turn in (90, 180, -90) if roll_known else ():
        yield _Mistake(phrase("stars.hint.roll", turn=turn), angles=partial(_rolled, turn=math.radians(turn)))


def _rolled(azimuth: float, elevation: float, roll: float, turn: float) -> tuple[float, float, float]:
    return azimuth, elevation, roll + turn
