"""Attitudes transformed to a reference station and the mean pole (NOAA TR NOS 55, equations 88 to 98)."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.stellar.sky import Site

__all__ = ["pole_matrix", "terrestrial", "transformed_angles"]


def transformed_angles(
    angles: Floats, station: Site, reference: Site, pole: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Return alpha, omega, kappa in the local system of another station.

    Parameters
    ----------
    angles
        (3,) in the system of `station`, radians.
    station, reference
        Their latitudes and west longitudes.
    pole
        x of the pole towards the prime meridian, y towards 90 degrees west, radians.

    Returns
    -------
    (3,) alpha and kappa in [0, 2 pi), omega in [-pi/2, pi/2].
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
