"""Apparent positions, sidereal time and camera attitudes at present, by `pyerfa` (extra `stars`)."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.fields import Checked
from photogram.arguments.objects import require
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.attitudes import Attitudes
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.sky import Effects, Site
from photogram.words import phrase

_ALL = Effects()
_UTC = re.compile(r"(\d{4})-(\d\d)-(\d\d)[T ](\d\d):(\d\d):(\d\d(?:\.\d*)?)Z?")


@dataclass(frozen=True)
class Earth(Checked):
    """Earth orientation parameters of the IERS.

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

        The given ones refer to the mean pole; the zenith is the same.
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
"""Terrestrial minus universal time in these years, seconds, before UTC.

Stephenson and Morrison 1984, Phil. Trans. R. Soc. A 313, 47. A second is 5e-5 arcsec of aberration, and less
of other effects.
"""

_Days = tuple[float, float]


def _times(text: str, dut1: float = 0.0) -> tuple[_Days, _Days]:
    """Return terrestrial and universal time (TT, UT1) as Julian dates in two parts.

    Before 1960, the given time is universal time, and `dut1` is the difference of UT1 from it.
    """
    import erfa

    match = _UTC.fullmatch(text.strip())
    if match is None:
        raise InputError(phrase("stars.utc", value=text))
    year, month, day, hour, minute = (int(part) for part in match.groups()[:5])
    old = _YEARS[0] <= year < _UTC_BEGINS
    with warnings.catch_warnings():
        warnings.simplefilter("error", erfa.ErfaWarning)
        try:
            first, second = erfa.dtf2d(
                "UT1" if old else "UTC", year, month, day, hour, minute, float(match[6])
            )
        except (erfa.ErfaError, erfa.ErfaWarning) as error:
            raise InputError(phrase("stars.utc-range", value=text, reason=str(error))) from None
        if not old:
            return erfa.taitt(*erfa.utctai(first, second)), erfa.utcut1(first, second, dut1)
    ut1 = float(first), float(second) + dut1 / erfa.DAYSEC
    return erfa.ut1tt(*ut1, float(np.interp(year, _YEARS, _TT_MINUS_UT))), ut1


def epoch(utc: str) -> float:
    """Return the Julian epoch of a UTC time, in years."""
    import erfa

    return float(erfa.epj(*_times(utc)[0]))


def apparent_places(catalogue: Catalogue, utc: str, effects: Effects = _ALL) -> Floats:
    """Compute geocentric apparent positions of a catalogue.

    They refer to the true equator and equinox of date, with proper motion, parallax, light deflection, annual
    aberration, precession and nutation (IAU 2006/2000A).

    Parameters
    ----------
    catalogue
        Star catalogue.
    utc
        UTC time, such as 2024-03-01T21:03:05.25.
    effects
        Whether to include light deflection and annual aberration.

    Returns
    -------
    (N, 2) right ascension and declination, radians.

    Raises
    ------
    InputError
        If proper motions or parallaxes are impossible.
    """
    import erfa

    tt, _ = _times(utc)
    ra, dec = catalogue.places.T
    pm_ra = catalogue.proper_motions[:, 0] / np.cos(dec)
    # erfa.atciq requires positions at 2000.0 and parallaxes in seconds of arc.
    epoch = erfa.epj2jd(catalogue.epoch)
    with warnings.catch_warnings():
        # Zero parallaxes mean distant stars; erfa warns about each.
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        # Overflows become an error of erfa.
        warnings.simplefilter("ignore", RuntimeWarning)
        motions = ra, dec, pm_ra, catalogue.proper_motions[:, 1], catalogue.parallaxes / ARCSEC
        try:
            moved = erfa.pmsafe(*motions, 0.0, *epoch, 2451545.0, 0.0)
        except erfa.ErfaError:
            raise _no_motion(catalogue) from None
    if not all(np.isfinite(part).all() for part in moved):
        raise _no_motion(catalogue)
    # Compute precession and nutation once for all stars.
    astrometry, origins = erfa.apci13(*tt)
    if effects.annual_aberration and effects.light_deflection:
        right, declination = erfa.atciq(*moved, astrometry)
    else:
        right, declination = _reduced(moved, astrometry, effects)
    return np.column_stack([erfa.anp(right - origins), declination])


def _reduced(places: Sequence[Floats], astrometry: Any, effects: Effects) -> tuple[Floats, Floats]:
    """Apply the steps of erfa.atciq: positions and motions at 2000.0 to date."""
    import erfa

    seen = erfa.pmpx(*places, astrometry["pmt"], astrometry["eb"])
    if effects.light_deflection:
        seen = erfa.ldsun(seen, astrometry["eh"], astrometry["em"])
    if effects.annual_aberration:
        seen = erfa.ab(seen, astrometry["v"], astrometry["em"], astrometry["bm1"])
    right, declination = erfa.c2s(erfa.rxp(astrometry["bpn"], seen))
    return right, declination


def to_date(utc: str) -> Floats:
    """Return the matrix (3, 3) from ICRS to true equator and equinox of date."""
    import erfa

    return np.asarray(erfa.pnm06a(*_times(utc)[0]), float)


def sidereal_time(site: Site, utc: str, dut1: float = 0.0) -> float:
    """Compute local apparent sidereal time in radians.

    Parameters
    ----------
    site
        Station; only its west longitude is used.
    utc
        UTC time, such as 2024-03-01T21:03:05.25; before 1960 universal time.
    dut1
        UT1 - UTC in seconds; one second is 15 arcsec of attitude, the same for all exposures of a night.
    """
    import erfa

    tt, ut1 = _times(utc, dut1)
    return float(erfa.anp(erfa.gst06a(*ut1, *tt) - site.longitude_west))


def _no_motion(catalogue: Catalogue) -> InputError:
    """Return the error of the star with the largest proper motion or parallax."""
    with np.errstate(over="ignore"):
        size = np.abs(catalogue.proper_motions).max(axis=1) + np.abs(catalogue.parallaxes)
    return InputError(phrase("stars.no-motion", star=catalogue.ids[int(np.argmax(size))]))


VISION = np.outer([1.0, -1.0, -1.0], [1.0, -1.0, -1.0])
"""Signs of covariances of rotations about vision axes (x right, y down) in terms of photo axes."""


def inertial_attitudes(
    angles: Floats, covariances: Floats, site: Site, utcs: Sequence[str], earth: Earth | None = None
) -> Attitudes:
    """Return attitudes in ICRS from alpha, omega, kappa (E, 3) with covariances (E, 3, 3).

    Angles and station refer to the mean pole; without `earth` UT1 - UTC and the pole are zero. Aberration and
    refraction are ignored.

    Notes
    -----
    The transposed matrix of the report rotates camera axes to north, east, zenith. The latitude gives hour
    angle and declination, apparent sidereal time the true equator and equinox. The transposed matrix of bias,
    precession and nutation (IAU 2006/2000A) rotates to ICRS.
    """
    earth = earth or Earth()
    place = earth.site_of_date(site)
    to_date_pole = terrestrial(place).T @ pole_matrix(earth.pole).T @ terrestrial(site)
    matrices, steps = [], []
    for own, covariance, utc in zip(angles, covariances, utcs, strict=True):
        matrix = _photocore.pointing_matrix(np.asarray(own, float))
        equatorial = equatorial_axes(place.latitude, sidereal_time(place, utc, earth.dut1))
        matrices.append(matrix @ to_date_pole.T @ equatorial.T @ to_date(utc))
        local = _local_axes(matrix)
        steps.append(VISION * (local @ covariance @ local.T))
    return Attitudes.of("matrix_to_vision", np.array(matrices), np.array(steps))


def station_attitude(matrix: Floats, site: Site, utc: str, earth: Earth) -> Floats:
    """Return alpha, omega, kappa at a station from a rotation matrix (ICRS to camera).

    Camera axes are x right, y down, z along the axis. Aberration and refraction are ignored.
    """
    place = earth.site_of_date(site)
    local = equatorial_axes(place.latitude, sidereal_time(place, utc, earth.dut1))
    return _photocore.pointing_of_matrix(np.ascontiguousarray(matrix @ to_date(utc).T @ local))


def pointing_matrix(ra: float, dec: float, position_angle: float = 0.0) -> Floats:
    """Return the rotation matrix (ICRS to camera) that points to a star position.

    The position angle of the upper edge counts from north through east; all angles are in radians.
    """
    (sr, cr), (sd, cd) = (np.sin(ra), np.cos(ra)), (np.sin(dec), np.cos(dec))
    axis, north = np.array([cd * cr, cd * sr, sd]), np.array([-sd * cr, -sd * sr, cd])
    east = np.array([-sr, cr, 0.0])
    down = -(np.cos(position_angle) * north + np.sin(position_angle) * east)
    return np.array([np.cross(down, axis), down, axis])


def _local_axes(m: Floats) -> Floats:
    """Return the rotations about the camera axes (columns) by alpha, omega, kappa."""
    alpha = [
        m[2, 2] * m[1, 0] - m[2, 0] * m[1, 2],
        m[0, 2] * m[2, 0] - m[0, 0] * m[2, 2],
        m[1, 2] * m[0, 0] - m[1, 0] * m[0, 2],
    ]
    # -cos omega sin kappa and cos omega cos kappa are in the second column.
    cosine = np.hypot(m[0, 1], m[1, 1])
    omega = [m[1, 1] / cosine, -m[0, 1] / cosine, 0.0] if cosine > 0 else [1.0, 0.0, 0.0]
    return np.column_stack([alpha, omega, [0.0, 0.0, 1.0]])


def equatorial_axes(latitude: float, time: float) -> Floats:
    """Return the matrix from north, east, zenith to equator and equinox of date."""
    (sp, cp), (sl, cl) = (np.sin(latitude), np.cos(latitude)), (np.sin(time), np.cos(time))
    # cos(dec) cos H, cos(dec) sin H, sin(dec); then the hour angle becomes right ascension.
    hour = np.array([[-sp, 0.0, cp], [0.0, -1.0, 0.0], [cp, 0.0, sp]])
    turn = np.array([[cl, sl, 0.0], [sl, -cl, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ hour, float)


def attitude_of(azimuth: float, elevation: float, roll: float = 0.0) -> Floats:
    """Return alpha, omega, kappa of a camera with pixels to the right and down.

    Parameters
    ----------
    azimuth
        Azimuth of the axis, from south, positive west; radians.
    elevation
        Elevation of the axis, radians. At 90 degrees exactly, the upper edge points north for zero roll.
    roll
        Clockwise rotation of the camera, as seen by its user, from a level horizon; radians.

    Raises
    ------
    InputError
        If an angle is infinite.
    """
    for name, angle in (("azimuth", azimuth), ("elevation", elevation), ("roll", roll)):
        require(not math.isinf(angle), name, "finite", value=angle)
    north, east = -math.cos(elevation) * math.cos(azimuth), -math.cos(elevation) * math.sin(azimuth)
    zenith = math.sin(elevation)
    alpha, omega = math.atan2(north, zenith), math.asin(max(-1.0, min(1.0, east)))
    # The third column of the matrix at kappa = 0 is the image of the zenith, or of north if the axis is
    # vertical.
    up = complex(math.sin(alpha), -math.cos(alpha) * math.sin(omega))
    if math.hypot(north, east) < 1e-9:
        up = complex(-math.cos(alpha), 0.0)
    # Up is minus y; a clockwise rotation of the camera rotates it counterclockwise.
    kappa = -math.pi / 2 - roll - math.atan2(up.imag, up.real)
    return np.array([alpha, omega, math.remainder(kappa, math.tau)])


def turn_between(first: Floats, second: Floats, rays: Floats) -> float:
    """Return the largest angle of camera rays (n, 3) between two attitudes, radians.

    Rays have x right, y down and z along the axis; rows that are not finite are ignored.
    """
    seen = rays[np.isfinite(rays).all(axis=1)]
    a, b = (seen @ _photocore.pointing_matrix(np.asarray(each, float)) for each in (first, second))
    sine, cosine = np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)
    return float(np.arctan2(sine, cosine).max(initial=0.0))


def axis_of(attitude: Floats) -> tuple[float, float]:
    """Return azimuth (from south, positive west) and elevation of the axis, radians."""
    alpha, omega = float(attitude[0]), float(attitude[1])
    north, east = math.sin(alpha) * math.cos(omega), math.sin(omega)
    zenith = math.cos(alpha) * math.cos(omega)
    return math.atan2(-east, -north) % math.tau, math.atan2(zenith, math.hypot(north, east))


def roll_of(attitude: Floats) -> float:
    """Return the roll for `attitude_of` with the angles of `axis_of`, radians."""
    level = attitude_of(*axis_of(attitude))
    return math.remainder(float(level[2] - attitude[2]), math.tau)


def transformed_angles(
    angles: Floats, station: Site, reference: Site, pole: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Return alpha, omega, kappa (3,) in the local system of another station, radians.

    x of the pole is towards the prime meridian, y towards 90 degrees west. Alpha and kappa are in [0, 2 pi),
    omega in [-pi/2, pi/2].
    """
    matrix = _photocore.pointing_matrix(np.asarray(angles, float))
    turned = terrestrial(reference).T @ pole_matrix(pole) @ terrestrial(station) @ matrix.T
    found = _photocore.pointing_of_matrix(np.ascontiguousarray(turned.T))
    # The small rotation of the pole is not exactly orthogonal; the report computes omega from its sine.
    omega = np.arcsin(np.clip(turned[1, 2], -1.0, 1.0))
    return np.array([found[0] % (2 * np.pi), omega, found[2] % (2 * np.pi)])


def pole_matrix(pole: tuple[float, float]) -> Floats:
    """Return the matrix from the instantaneous to the mean pole."""
    x, y = pole
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [-x, -y, 1.0]])


def terrestrial(site: Site) -> Floats:
    """Return the left-handed matrix from north, east, zenith to meridian, west, pole."""
    (sp, cp), (sl, cl) = ((np.sin(angle), np.cos(angle)) for angle in (site.latitude, site.longitude_west))
    return np.array([[-cl * sp, sl, cl * cp], [-sl * sp, -cl, sl * cp], [cp, 0.0, sp]])
