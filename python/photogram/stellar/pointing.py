"""Pointing of a camera: azimuth, elevation and roll, and alpha, omega, kappa, at one or more stations."""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.objects import require
from photogram.arguments.types import Floats
from photogram.stellar.sky import Site


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
