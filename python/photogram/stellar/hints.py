"""Why no stars are found where an attitude says they are: mistakes that are tried one by one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from photogram.lazy_dataclasses import dataclass, replace
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.identification import identify
from photogram.stellar.matching import STRETCH
from photogram.stellar.odds import ACCEPTED
from photogram.stellar.places import Earth
from photogram.stellar.pointing import attitude_of, axis_of, roll_of
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure
from photogram.stellar.sky_cameras import SkyCamera

__all__ = ["Hint", "Setting", "find_hint"]


_TRIED = 3
"""Exposures on which the mistakes are tried, those with the most images."""
_SCALES = tuple(1.1**k for k in range(-6, 7) if k)
"""Principal distances that are tried, over the given one; each reaches half way to the next."""
_WIDE = 0.05
_HOUR = math.tau / 24 * 1.00273790935
"""Turn of the Earth against the stars, radians."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What an exposure is identified with."""

    site: Site  # As for `identify`
    catalogue: Catalogue
    frame: tuple[float, float]
    camera: SkyCamera
    attitude_error: float  # Radians; pixels
    tolerance: float
    earth: Earth
    field_error: float = STRETCH  # As for `photogram.stellar.Night`
    roll_known: bool = True

    @property
    def radius(self) -> float:
        """What the attitude may be off in the image, pixels."""
        return float(self.camera.values[0]) * math.tan(self.attitude_error)


@dataclass(frozen=True)
class Hint:
    """A mistake that explains why stars were not found."""

    text: str  # What the input seems to have
    exposures: tuple[str, ...]  # Those that show stars when it is mended


@dataclass(frozen=True)
class _Mistake:
    """A mistake: what it is called, and how an exposure and its setting look when it is mended."""

    text: str
    mend: Callable[[Exposure, Setting], tuple[Exposure, Setting]]
    stretch: float = STRETCH
    of_roll: bool = False


def find_hint(exposures: Sequence[Exposure], names: Sequence[str], setting: Setting) -> Hint | None:
    """Try mistakes that are often made on exposures that were not identified.

    Parameters
    ----------
    exposures, names
        The exposures and their names.
    setting
        What they were identified with.

    Returns
    -------
    The mistake that explains most of them, by the odds against chance; None where none does.
    """
    order = sorted(range(len(exposures)), key=lambda i: -len(exposures[i].xy))[:_TRIED]
    mistakes = [mistake for mistake in _mistakes() if setting.roll_known or not mistake.of_roll]
    mistakes += _other_times(setting.site)
    best: tuple[tuple[int, float], Hint] | None = None
    for mistake in mistakes:
        explained, odds, scales = [], 0.0, []
        for index in order:
            exposure, mended = mistake.mend(exposures[index], setting)
            sighting = identify(
                exposure,
                mended.camera,
                mended.site,
                mended.catalogue,
                frame=mended.frame,
                radius=mended.radius,
                tolerance=mended.tolerance,
                earth=mended.earth,
                stretch=max(mistake.stretch, mended.field_error),
                roll_known=mended.roll_known,
            )
            if sighting.match.expected * len(mistakes) < ACCEPTED:
                explained.append(names[index])
                odds += math.log(max(sighting.match.expected, 1e-300))
                scales.append(float(mended.camera.values[0]) / sighting.match.scale)
        rank = (len(explained), -odds)
        if explained and (best is None or rank > best[0]):
            width = 2 * math.degrees(math.atan(setting.frame[0] / 2 / float(np.median(scales))))
            best = (rank, Hint(mistake.text.format(field=width), tuple(n for n in names if n in explained)))
    return best and best[1]


def _mistakes() -> list[_Mistake]:
    found = [
        _Mistake("the images are mirrored: x counts to the left", _flipped(0)),
        _Mistake("y of the images counts up, not down", _flipped(1)),
        _Mistake("x and y of the images are exchanged", _exchanged),
        _Mistake(
            "azimuth_deg counts from north, not from south", _pointed(lambda a, e, r: (a + math.pi, e, r))
        ),
        _Mistake("azimuth_deg counts to the east, not to the west", _pointed(lambda a, e, r: (-a, e, r))),
        _Mistake(
            "azimuth_deg counts from north to the west, not from south",
            _pointed(lambda a, e, r: (math.pi - a, e, r)),
        ),
        _Mistake("elevation_deg is the zenith distance", _pointed(lambda a, e, r: (a, math.pi / 2 - e, r))),
        _Mistake("roll_deg counts counterclockwise", _pointed(lambda a, e, r: (a, e, -r)), of_roll=True),
        _Mistake(
            "the longitude counts to the east, not to the west",
            _moved(lambda site: replace(site, longitude_west=-site.longitude_west)),
        ),
        _Mistake(
            "the latitude has the other sign", _moved(lambda site: replace(site, latitude=-site.latitude))
        ),
    ]
    found += [
        _Mistake(f"roll_deg has to be changed by {turn:+d} degrees", _rolled(turn), of_roll=True)
        for turn in (90, 180, -90)
    ]
    found += [
        _Mistake("the horizontal field of view is about {field:.1f} degrees", _scaled(scale), _WIDE)
        for scale in _SCALES
    ]
    return found


def _flipped(axis: int) -> Callable[[Exposure, Setting], tuple[Exposure, Setting]]:
    def mend(exposure: Exposure, setting: Setting) -> tuple[Exposure, Setting]:
        xy = exposure.xy.copy()
        xy[:, axis] = setting.frame[axis] - xy[:, axis]
        return replace(exposure, xy=xy), setting

    return mend


def _exchanged(exposure: Exposure, setting: Setting) -> tuple[Exposure, Setting]:
    return replace(exposure, xy=np.ascontiguousarray(exposure.xy[:, ::-1])), setting


def _pointed(
    change: Callable[[float, float, float], tuple[float, float, float]],
) -> Callable[[Exposure, Setting], tuple[Exposure, Setting]]:
    def mend(exposure: Exposure, setting: Setting) -> tuple[Exposure, Setting]:
        angles = change(*axis_of(exposure.attitude), roll_of(exposure.attitude))
        return replace(exposure, attitude=attitude_of(*angles)), setting

    return mend


def _rolled(degrees: float) -> Callable[[Exposure, Setting], tuple[Exposure, Setting]]:
    return _pointed(lambda a, e, r: (a, e, r + math.radians(degrees)))


def _moved(change: Callable[[Site], Site]) -> Callable[[Exposure, Setting], tuple[Exposure, Setting]]:
    def mend(exposure: Exposure, setting: Setting) -> tuple[Exposure, Setting]:
        return exposure, replace(setting, site=change(setting.site))

    return mend


def _turned(hours: int, site: Site) -> Site:
    """Return the station that has a sky some hours later.

    That is the sky of a station so many hours of the Earth's turn farther east.
    """
    return replace(site, longitude_west=site.longitude_west - hours * _HOUR)


def _other_times(site: Site) -> list[_Mistake]:
    """Return times that are those of a clock: of the zone of the longitude, in summer, and an hour off."""
    zone = round(-site.longitude_west / _HOUR)
    return [
        _Mistake(
            f"utc has to be changed by {hours:+d} h: it is the time of a clock, not UTC",
            _moved(partial(_turned, hours)),
        )
        for hours in sorted({-1, 1, -zone, -zone - 1} - {0})
    ]


def _scaled(scale: float) -> Callable[[Exposure, Setting], tuple[Exposure, Setting]]:
    def mend(exposure: Exposure, setting: Setting) -> tuple[Exposure, Setting]:
        values = setting.camera.values.copy()
        values[:2] *= scale
        return exposure, replace(setting, camera=replace(setting.camera, values=values))

    return mend
