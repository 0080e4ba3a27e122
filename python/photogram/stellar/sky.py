"""Refraction, aberration and standard coordinates at a station (NOAA TR NOS 55, equations 1 to 18).

Local coordinates are left-handed: xi north, eta east, zenith. Azimuths count from south, positive west; hour
angles are positive west; longitudes are positive west.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import shaped, truth_value
from photogram.arguments.fields import Checked, check_fields
from photogram.arguments.objects import require
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.numbers import ARCSEC as ARCSEC
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase

TAU: tuple[float, float, float, float] = (1050.6103, 706.11502, 262.06086, 142.67293)
"""Refraction coefficients (arcsec), a fit of the report to Garfinkel's tables."""
ABERRATION = 0.320 * ARCSEC
"""Diurnal aberration at the equator in the report, radians; better 0.3192 arcsec."""


TEMPERATURES = (150.0, 350.0)  # Ground temperature in kelvin: -123 to 77 degrees Celsius
HIGHEST_PRESSURE = 850.0  # Millimetres of mercury; 840 at the Dead Sea in a strong anticyclone
HECTOPASCAL = 1013.25 / 760.0  # One millimetre of mercury in hectopascals
HOUR = 0.0  # Sidereal time of all images of a landmark, radians: it does not rotate with the sky
_STEP = 1e-6  # Step of the numerical weight transformation, radians


@dataclass(frozen=True)
class Air:
    """Air at the station.

    Attributes
    ----------
    temperature
        Kelvin.
    pressure
        Millimetres of mercury; 0 disables refraction.

    Raises
    ------
    InputError
        If values are impossible, usually because of other units.
    """

    temperature: float = 273.15
    pressure: float = 760.0

    def __post_init__(self) -> None:
        check_fields(self)
        low, high = TEMPERATURES
        if not low <= self.temperature <= high:
            raise InputError(phrase("stars.temperature", value=self.temperature, low=low, high=high))
        if not 0 <= self.pressure <= HIGHEST_PRESSURE:
            hint = []
            if HIGHEST_PRESSURE < self.pressure <= HIGHEST_PRESSURE * HECTOPASCAL:
                hint = [phrase("stars.hectopascals", mercury=self.pressure / HECTOPASCAL)]
            fields = {"value": self.pressure, "most": HIGHEST_PRESSURE}
            raise InputError(phrase("stars.pressure", hint=hint, **fields))


def refraction(
    zenith_distances: ArrayLike, air: Air | None = None, *, tau: ArrayLike = TAU, observed: bool = False
) -> Floats:
    """Compute refraction as true minus observed zenith distance (equations 7 to 11).

    Parameters
    ----------
    zenith_distances
        (n,) zenith distances, radians.
    air
        Air of the station; None: 0 degrees Celsius and one atmosphere.
    tau
        (4,) coefficients in seconds of arc.
    observed
        Whether the zenith distances are observed or true.

    Returns
    -------
    (n,) radians.

    Raises
    ------
    InputError
        If arrays have other shapes.
    """
    truth_value("observed", observed)
    air = air or Air()
    return _photocore.refraction(
        np.atleast_1d(shaped("zenith_distances", zenith_distances, np.shape(zenith_distances)[:1])),
        air.temperature,
        air.pressure,
        shaped("tau", tau, (len(TAU),)),
        observed,
    )


@dataclass(frozen=True)
class Effects(Checked):
    """Effects included in apparent positions; others are neglected.

    Attributes
    ----------
    annual_aberration
        Effect of the Earth's motion, up to 20.5 arcsec.
    light_deflection
        Deflection by the Sun, below 0.01 arcsec at night.
    diurnal_aberration
        Effect of the station's motion, up to 0.32 arcsec.
    refraction
        Refraction by the air: a minute of arc at 45 degrees.
    """

    annual_aberration: bool = True
    light_deflection: bool = True
    diurnal_aberration: bool = True
    refraction: bool = True

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the neglected effects in reports."""
        return tuple(name.replace("_", " ") for name, taken in vars(self).items() if not taken)


@dataclass(frozen=True)
class Site(Checked):
    """Station for sky observations.

    Attributes
    ----------
    latitude
        Radians, positive north.
    longitude_west
        Radians, positive west.
    elevation
        Metres.
    air
        Air at the station.
    aberration
        Constant of diurnal aberration at the equator, radians.
    number, name
        Number and name of the station.
    effects
        Effects included in positions and standard coordinates.
    """

    latitude: float
    longitude_west: float = 0.0
    elevation: float = 0.0
    air: Air = field(default_factory=Air)
    aberration: float = ABERRATION
    number: str = ""
    name: str = ""
    effects: Effects = field(default_factory=Effects)

    @property
    def core(self) -> tuple[float, float, float, float]:
        """Latitude, aberration, temperature and pressure of the core, 0 if neglected."""
        aberration = self.aberration if self.effects.diurnal_aberration else 0.0
        pressure = self.air.pressure if self.effects.refraction else 0.0
        return (self.latitude, aberration, self.air.temperature, pressure)

    def standard_coordinates(
        self, places: ArrayLike, sidereal_times: ArrayLike, tau: ArrayLike = TAU
    ) -> Floats:
        """Compute refracted standard coordinates xi, eta of apparent positions.

        Parameters
        ----------
        places
            (n, 2) right ascension and declination, radians.
        sidereal_times
            (n,) local apparent sidereal time, radians.
        tau
            (4,) coefficients of refraction in seconds of arc.

        Returns
        -------
        (n, 2) xi (north), eta (east); NaN at and below the horizon.
        """
        places = np.asarray(places, float)
        times = np.ascontiguousarray(np.broadcast_to(np.asarray(sidereal_times, float), len(places)))
        return _photocore.standard_coordinates(places, times, self.core, np.asarray(tau, float))

    def places(self, standard: ArrayLike, sidereal_times: ArrayLike, tau: ArrayLike = TAU) -> Floats:
        """Compute apparent positions, the inverse of `standard_coordinates`."""
        standard = np.asarray(standard, float)
        times = np.ascontiguousarray(np.broadcast_to(np.asarray(sidereal_times, float), len(standard)))
        return _photocore.star_places(standard, times, self.core, np.asarray(tau, float))


def landmark(site: Site, azimuth: float, elevation: float, weight: Floats) -> tuple[Floats, Floats]:
    """Return the star position equivalent to a landmark at the sidereal time `HOUR`.

    The direction is observed, with the refraction of the program for stars and without their aberration.
    Program and station transform the position to this direction.

    Parameters
    ----------
    site
        The station.
    azimuth
        Azimuth from north through east, radians.
    elevation
        Observed elevation above the horizon, radians.
    weight
        (2, 2) weight of azimuth and elevation. An infinite diagonal fixes the direction, a zero diagonal
        makes it unknown.

    Returns
    -------
    (2,) right ascension and declination, radians, and their (2, 2) weight.

    Raises
    ------
    InputError
        If the elevation is not between the horizon and the zenith, if the azimuth is not finite, or if the
        weight has another shape.
    """
    weight = shaped("weight", weight, (2, 2))
    if not 0 < elevation < np.pi / 2:
        raise InputError(phrase("stars.elevation", value=float(np.degrees(elevation))))
    require(np.isfinite(azimuth), "azimuth", "finite", value=float(azimuth))
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
