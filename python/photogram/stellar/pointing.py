"""Where a camera points: azimuth, elevation and roll, alpha, omega, kappa, and these at other stations."""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.stellar.sky import Site
from photogram.words import phrase


def attitude_of(azimuth: float, elevation: float, roll: float = 0.0) -> Floats:
    """Return alpha, omega, kappa of a camera whose pixels count right and down.

    Parameters
    ----------
    azimuth
        Of the axis, from south, positive west; radians.
    elevation
        Of the axis, radians. At 90 degrees exactly, the upper edge points north when the roll is zero.
    roll
        By which the camera is turned clockwise, as its user sees it, from a level horizon; radians.

    Raises
    ------
    InputError
        An angle that is infinite.
    """
    for name, angle in (("azimuth", azimuth), ("elevation", elevation), ("roll", roll)):
        if math.isinf(angle):
            raise InputError(phrase("error.at", what=name, message=phrase("error.finite", value=angle)))
    north, east = -math.cos(elevation) * math.cos(azimuth), -math.cos(elevation) * math.sin(azimuth)
    zenith = math.sin(elevation)
    alpha, omega = math.atan2(north, zenith), math.asin(max(-1.0, min(1.0, east)))
    # The third column of the matrix at kappa = 0 is the image of the zenith; of north when that is the axis.
    up = complex(math.sin(alpha), -math.cos(alpha) * math.sin(omega))
    if math.hypot(north, east) < 1e-9:
        up = complex(-math.cos(alpha), 0.0)
    # Up is minus y; a camera turned clockwise shows it turned counterclockwise.
    kappa = -math.pi / 2 - roll - math.atan2(up.imag, up.real)
    return np.array([alpha, omega, math.remainder(kappa, math.tau)])


def turn_between(first: Floats, second: Floats, rays: Floats) -> float:
    """Return the largest angle between rays (n, 3) of a camera under two attitudes, radians.

    Rays have x right, y down and z along the axis; what is not finite does not count.
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
    """Return the roll that `attitude_of` takes with the azimuth and elevation of `axis_of`, radians."""
    level = attitude_of(*axis_of(attitude))
    return math.remainder(float(level[2] - attitude[2]), math.tau)


def transformed_angles(
    angles: Floats, station: Site, reference: Site, pole: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Return alpha, omega, kappa (3,) in the local system of another station, in radians.

    x of the pole is towards the prime meridian, y towards 90 degrees west. Alpha and kappa are in [0, 2 pi),
    omega in [-pi/2, pi/2].
    """
    matrix = _photocore.pointing_matrix(np.asarray(angles, float))
    turned = terrestrial(reference).T @ pole_matrix(pole) @ terrestrial(station) @ matrix.T
    found = _photocore.pointing_of_matrix(np.ascontiguousarray(turned.T))
    # The pole's small rotation is not quite orthogonal; the report takes omega from its sine.
    omega = np.arcsin(np.clip(turned[1, 2], -1.0, 1.0))
    return np.array([found[0] % (2 * np.pi), omega, found[2] % (2 * np.pi)])


def pole_matrix(pole: tuple[float, float]) -> Floats:
    """Return the matrix from the instantaneous to the mean pole."""
    x, y = pole
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [-x, -y, 1.0]])


def terrestrial(site: Site) -> Floats:
    """Return the matrix from north, east, zenith to prime meridian, 90 degrees west, pole (left-handed)."""
    (sp, cp), (sl, cl) = ((np.sin(angle), np.cos(angle)) for angle in (site.latitude, site.longitude_west))
    return np.array([[-cl * sp, sl, cl * cp], [-sl * sp, -cl, sl * cp], [cp, 0.0, sp]])
