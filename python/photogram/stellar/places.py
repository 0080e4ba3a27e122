"""Apparent places and sidereal time of today's skies, by `pyerfa` (extra `stars`)."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.show.angles import ARCSEC
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.sky import Effects, Site
from photogram.stellar.transformation import pole_matrix, terrestrial

__all__ = ["Earth", "apparent_places", "epoch", "sidereal_time", "to_date"]


_ALL = Effects()
_UTC = re.compile(r"(\d{4})-(\d\d)-(\d\d)[T ](\d\d):(\d\d):(\d\d(?:\.\d*)?)Z?")


@dataclass(frozen=True)
class Earth:
    """How the Earth is turned, as the IERS publishes it.

    Attributes
    ----------
    dut1
        UT1 - UTC in seconds; one second is 15 arcsec of attitude, the same for all exposures of a night.
    pole
        x of the pole towards the prime meridian, y towards 90 degrees west, radians.
    """

    dut1: float = 0.0
    pole: tuple[float, float] = (0.0, 0.0)

    def site_of_date(self, site: Site) -> Site:
        """Return a station with its latitude and longitude from the instantaneous pole.

        The given ones are from the mean pole; its zenith is the same.
        """
        if self.pole == (0.0, 0.0):
            return site
        zenith = pole_matrix(self.pole).T @ terrestrial(site)[:, 2]
        return replace(
            site,
            latitude=math.atan2(zenith[2], math.hypot(zenith[0], zenith[1])),
            longitude_west=math.atan2(zenith[1], zenith[0]),
        )


_UTC_BEGINS = 1960
_YEARS = np.arange(1850, 1961, 10)
_TT_MINUS_UT = np.array([7, 8, 2, -5, -6, -3, 10, 21, 24, 24, 29, 33])
"""Terrestrial minus universal time in these years, seconds, before there was UTC (Stephenson and Morrison
1984, Phil. Trans. R. Soc. A 313, 47). A second is 5e-5 arcsec of aberration, and less of all else."""

_Days = tuple[float, float]


def _times(text: str, dut1: float = 0.0) -> tuple[_Days, _Days]:
    """Return terrestrial and universal time (TT, UT1) as Julian dates in two parts.

    Before 1960 there was no UTC: the time is universal time itself, and `dut1` what it lacks of UT1.
    """
    import erfa

    match = _UTC.fullmatch(text.strip())
    if match is None:
        raise InputError(f"{text!r} is not a UTC time such as 2024-03-01T21:03:05.25")
    year, month, day, hour, minute = (int(part) for part in match.groups()[:5])
    old = _YEARS[0] <= year < _UTC_BEGINS
    with warnings.catch_warnings():
        warnings.simplefilter("error", erfa.ErfaWarning)
        try:
            first, second = erfa.dtf2d(
                "UT1" if old else "UTC", year, month, day, hour, minute, float(match[6])
            )
        except (erfa.ErfaError, erfa.ErfaWarning) as error:
            raise InputError(f"{text!r}: {error}") from None
        if not old:
            return erfa.taitt(*erfa.utctai(first, second)), erfa.utcut1(first, second, dut1)
    ut1 = float(first), float(second) + dut1 / erfa.DAYSEC
    return erfa.ut1tt(*ut1, float(np.interp(year, _YEARS, _TT_MINUS_UT))), ut1


def epoch(utc: str) -> float:
    """Return the Julian epoch of a UTC time, in years."""
    import erfa

    return float(erfa.epj(*_times(utc)[0]))


def apparent_places(catalogue: Catalogue, utc: str, effects: Effects = _ALL) -> Floats:
    """Return geocentric apparent places of a catalogue (true equator and equinox of date).

    Proper motion, parallax, light deflection, annual aberration, precession and nutation (IAU 2006/2000A).

    Parameters
    ----------
    catalogue
        The stars.
    utc
        Such as 2024-03-01T21:03:05.25.
    effects
        Which of light deflection and annual aberration there are.

    Returns
    -------
    (N, 2) right ascension and declination, radians.

    Raises
    ------
    InputError
        Proper motions or parallaxes that cannot be.
    """
    import erfa

    tt, _ = _times(utc)
    ra, dec = catalogue.places.T
    pm_ra = catalogue.proper_motions[:, 0] / np.cos(dec)
    # erfa.atciq takes places of 2000.0 and parallaxes in seconds of arc.
    epoch = erfa.epj2jd(catalogue.epoch)
    with warnings.catch_warnings():
        # Parallaxes of zero stand for stars that are far; erfa remarks on each.
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        # What overflows ends as an error of erfa.
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            moved = erfa.pmsafe(
                ra,
                dec,
                pm_ra,
                catalogue.proper_motions[:, 1],
                catalogue.parallaxes / ARCSEC,
                0.0,
                *epoch,
                2451545.0,
                0.0,
            )
        except erfa.ErfaError:
            raise _no_motion(catalogue) from None
    if not all(np.isfinite(part).all() for part in moved):
        raise _no_motion(catalogue)
    # Precession and nutation once for all stars.
    astrometry, origins = erfa.apci13(*tt)
    if effects.annual_aberration and effects.light_deflection:
        right, declination = erfa.atciq(*moved, astrometry)
    else:
        right, declination = _reduced(moved, astrometry, effects)
    return np.column_stack([erfa.anp(right - origins), declination])


def _reduced(places: Sequence[Floats], astrometry: Any, effects: Effects) -> tuple[Floats, Floats]:
    """Take the steps of erfa.atciq one by one: places of 2000.0 with their motions to those of date."""
    import erfa

    right, declination, pm_right, pm_declination, parallax, velocity = places
    seen = erfa.pmpx(
        right,
        declination,
        pm_right,
        pm_declination,
        parallax,
        velocity,
        astrometry["pmt"],
        astrometry["eb"],
    )
    if effects.light_deflection:
        seen = erfa.ldsun(seen, astrometry["eh"], astrometry["em"])
    if effects.annual_aberration:
        seen = erfa.ab(seen, astrometry["v"], astrometry["em"], astrometry["bm1"])
    right, declination = erfa.c2s(erfa.rxp(astrometry["bpn"], seen))
    return right, declination


def to_date(utc: str) -> Floats:
    """Return the matrix (3, 3) from ICRS to the true equator and equinox of date (IAU 2006/2000A)."""
    import erfa

    return np.asarray(erfa.pnm06a(*_times(utc)[0]), float)


def sidereal_time(site: Site, utc: str, dut1: float = 0.0) -> float:
    """Return local apparent sidereal time in radians.

    Parameters
    ----------
    site
        The station; its west longitude counts.
    utc
        Such as 2024-03-01T21:03:05.25; before 1960 universal time.
    dut1
        UT1 - UTC in seconds; one second is 15 arcsec of attitude, the same for all exposures of a night.
    """
    import erfa

    tt, ut1 = _times(utc, dut1)
    return float(erfa.anp(erfa.gst06a(*ut1, *tt) - site.longitude_west))


def _no_motion(catalogue: Catalogue) -> InputError:
    """Name the star whose proper motion or parallax is largest."""
    with np.errstate(over="ignore"):
        size = np.abs(catalogue.proper_motions).max(axis=1) + np.abs(catalogue.parallaxes)
    return InputError(
        "stars cannot be taken to 2000.0: the proper motion or the parallax of star"
        f" {catalogue.ids[int(np.argmax(size))]} is none that a star can have"
    )
