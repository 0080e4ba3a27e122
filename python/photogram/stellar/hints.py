"""Probable causes of exposures without identified stars, tested one by one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.lazy_dataclasses import dataclass, replace
from photogram.stellar.identification import identify
from photogram.stellar.matching import STRETCH
from photogram.stellar.odds import ACCEPTED
from photogram.stellar.pointing import attitude_of, axis_of, roll_of
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.stellar import Night

_MAX_EXPOSURES = 3
_SCALES = tuple(1.1**k for k in range(-6, 7) if k)
"""Ratios of principal distances; each covers half of the distance to the next."""
_WIDE = 0.05
_HOUR = math.tau / 24 * 1.00273790935  # Hourly rotation of the Earth relative to the stars, radians

Mend = Callable[[Exposure, "Night"], tuple[Exposure, "Night"]]


@dataclass(frozen=True)
class _Mistake:
    name: Phrase
    mend: Mend
    stretch: float = STRETCH


def find_hint(night: Night, unidentified: Sequence[int]) -> tuple[Phrase, tuple[str, ...]] | None:
    """Return the mistake that explains most exposures against chance, and their names.

    Unidentified exposures with the most images are tested. None if all tested mistakes fail.
    """
    order = sorted(unidentified, key=lambda index: -len(night.exposures[index].xy))[:_MAX_EXPOSURES]
    mistakes = [*_mistakes(night.site), *(_roll_mistakes() if night.roll_known else ())]
    best: tuple[int, float] = (0, 0.0)
    hint = None
    for mistake in mistakes:
        explained, odds, scales = [], 0.0, []
        for index in order:
            exposure, mended = mistake.mend(night.exposures[index], night)
            stretch = max(mistake.stretch, night.field_error)
            matched = identify(
                exposure, mended, mended.camera, tolerance=night.tolerance, stretch=stretch
            ).match
            if matched.expected * len(mistakes) < ACCEPTED:
                explained.append(index)
                odds += math.log(max(matched.expected, 1e-300))
                scales.append(float(mended.camera.values[0]) / matched.scale)
        if explained and (len(explained), -odds) > best:
            best = len(explained), -odds
            width = 2 * math.degrees(math.atan(night.frame[0] / 2 / float(np.median(scales))))
            name = Phrase(mistake.name.code, {"field": width, **mistake.name.fields})
            hint = name, tuple(night.names[index] for index in unidentified if index in explained)
    return hint


def _mistakes(site: Site) -> Iterator[_Mistake]:
    """Yield mistakes of images, angles, station, fields of view and clocks.

    Clocks may show the zone time of the longitude, summer time, or an hour more or less. The sky some hours
    later is the sky of a station farther east by the same rotation.
    """
    west, half = site.longitude_west, math.pi / 2
    pointings: dict[str, Callable[[float, float, float], tuple[float, float, float]]] = {
        "azimuth-from-north": lambda a, e, r: (a + math.pi, e, r),
        "azimuth-east": lambda a, e, r: (-a, e, r),
        "azimuth-from-north-west": lambda a, e, r: (math.pi - a, e, r),
        "zenith-distance": lambda a, e, r: (a, half - e, r),
    }
    yield _Mistake(phrase("stars.hint.mirrored-x"), _flipped(0))
    yield _Mistake(phrase("stars.hint.mirrored-y"), _flipped(1))
    yield _Mistake(phrase("stars.hint.exchanged"), _exchanged)
    for code, change in pointings.items():
        yield _Mistake(phrase(f"stars.hint.{code}"), _pointed(change))
    yield _Mistake(phrase("stars.hint.longitude-east"), _moved(longitude_west=-west))
    yield _Mistake(phrase("stars.hint.latitude-sign"), _moved(latitude=-site.latitude))
    for scale in _SCALES:
        yield _Mistake(phrase("stars.hint.field-of-view"), _scaled(scale), _WIDE)
    zone = round(-west / _HOUR)
    for hours in sorted({-1, 1, -zone, -zone - 1} - {0}):
        later = _moved(longitude_west=west - hours * _HOUR)
        yield _Mistake(phrase("stars.hint.utc", hours=hours), later)


def _roll_mistakes() -> Iterator[_Mistake]:
    yield _Mistake(phrase("stars.hint.roll-sign"), _pointed(lambda a, e, r: (a, e, -r)))
    for turn in (90, 180, -90):
        mend = _pointed(lambda a, e, r, turn=turn: (a, e, r + math.radians(turn)))  # type: ignore[misc]
        yield _Mistake(phrase("stars.hint.roll", turn=turn), mend)


def _flipped(axis: int) -> Mend:
    def mend(exposure: Exposure, night: Night) -> tuple[Exposure, Night]:
        xy = exposure.xy.copy()
        xy[:, axis] = night.frame[axis] - xy[:, axis]
        return replace(exposure, xy=xy), night

    return mend


def _exchanged(exposure: Exposure, night: Night) -> tuple[Exposure, Night]:
    return replace(exposure, xy=np.ascontiguousarray(exposure.xy[:, ::-1])), night


def _pointed(change: Callable[[float, float, float], tuple[float, float, float]]) -> Mend:
    def mend(exposure: Exposure, night: Night) -> tuple[Exposure, Night]:
        angles = change(*axis_of(exposure.attitude), roll_of(exposure.attitude))
        return replace(exposure, attitude=attitude_of(*angles)), night

    return mend


def _moved(**station: Any) -> Mend:
    return lambda exposure, night: (exposure, replace(night, site=replace(night.site, **station)))


def _scaled(scale: float) -> Mend:
    def mend(exposure: Exposure, night: Night) -> tuple[Exposure, Night]:
        values = night.camera.values.copy()
        values[:2] *= scale
        return exposure, replace(night, camera=replace(night.camera, values=values))

    return mend
