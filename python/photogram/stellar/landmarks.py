"""Terrestrial directions as control beside stars (NOAA TR NOS 55, section 2.A)."""

from __future__ import annotations

import numpy as np

from photogram.arguments.arrays import shaped
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.stellar.sky import Site
from photogram.words import phrase

HOUR = 0.0
"""Sidereal time of all images of a landmark, radians: it does not turn with the sky."""
_STEP = 1e-6
"""Of the differences that transform weights, radians."""


def landmark(site: Site, azimuth: float, elevation: float, weight: Floats) -> tuple[Floats, Floats]:
    """Return the place of a star that is seen where a landmark is, at the sidereal time `HOUR`.

    The direction is the observed one, with the refraction that the program applies to stars and without their
    aberration: the place is what program and station turn into it.

    Parameters
    ----------
    site
        The station.
    azimuth
        From north through east, radians.
    elevation
        Observed, above the horizon, radians.
    weight
        (2, 2) of azimuth and elevation; infinite or zero on the diagonal for a direction that is held, or not
        known.

    Returns
    -------
    (2,) right ascension and declination, radians, and their (2, 2) weight.

    Raises
    ------
    InputError
        An elevation that is not between the horizon and the zenith, an azimuth that is not finite, a weight
        of another shape.
    """
    weight = shaped("weight", weight, (2, 2))
    if not 0 < elevation < np.pi / 2:
        raise InputError(phrase("stars.elevation", value=float(np.degrees(elevation))))
    if not np.isfinite(azimuth):
        message = phrase("error.finite", value=float(azimuth))
        raise InputError(phrase("error.at", what="azimuth", message=message))
    azimuth = np.remainder(azimuth, 2 * np.pi)
    steps = _STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    azimuths, elevations = (np.array([azimuth, elevation]) + steps).T
    standard = np.column_stack([np.cos(azimuths), np.sin(azimuths)]) / np.tan(elevations)[:, None]
    places = site.places(standard, HOUR)
    turns = np.remainder(places - places[0] + np.pi, 2 * np.pi) - np.pi
    back = np.linalg.inv((turns[1::2] - turns[2::2]).T / (2 * _STEP))
    diagonal = np.diag(weight)
    if np.isinf(diagonal).any() or not diagonal.any():
        return places[0], np.diag(diagonal)
    return places[0], back.T @ weight @ back
