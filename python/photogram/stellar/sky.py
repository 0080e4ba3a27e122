"""The sky over a station: refraction, aberration, standard coordinates (NOAA TR NOS 55, equations 1 to 18).

Local coordinates are left-handed: xi north, eta east, zenith. Azimuths count from south, positive west; hour
angles are positive west; longitudes are positive west.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import shaped
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.show.angles import ARCSEC as ARCSEC
from photogram.words import phrase

TAU: tuple[float, float, float, float] = (1050.6103, 706.11502, 262.06086, 142.67293)
"""Coefficients of refraction in seconds of arc, the report's fit to Garfinkel's tables."""
ABERRATION = 0.320 * ARCSEC
"""Constant of diurnal aberration at the equator as the report has it, in radians; 0.3192 arcsec is nearer."""


TEMPERATURES = (150.0, 350.0)
"""Air on the ground in kelvin: -123 to 77 degrees Celsius."""
HIGHEST_PRESSURE = 850.0
"""Millimetres of mercury; 840 at the Dead Sea in a strong anticyclone."""
HECTOPASCAL = 1013.25 / 760.0
"""Of a millimetre of mercury."""


@dataclass(frozen=True)
class Air:
    """Air at the station.

    Attributes
    ----------
    temperature
        Kelvin.
    pressure
        Millimetres of mercury; 0 for no refraction.

    Raises
    ------
    InputError
        Air that cannot be, most often in other units.
    """

    temperature: float = 273.15
    pressure: float = 760.0

    def __post_init__(self) -> None:
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
    """Return refraction (true minus observed zenith distance; equations 7 to 11).

    Parameters
    ----------
    zenith_distances
        (n,) radians.
    air
        Of the station; 0 degrees Celsius and one atmosphere when None.
    tau
        (4,) coefficients in seconds of arc.
    observed
        Whether the zenith distances are observed ones; else they are true.

    Returns
    -------
    (n,) radians.

    Raises
    ------
    InputError
        Arrays of other shapes.
    """
    air = air or Air()
    return _photocore.refraction(
        np.atleast_1d(shaped("zenith_distances", zenith_distances, np.shape(zenith_distances)[:1])),
        air.temperature,
        air.pressure,
        shaped("tau", tau, (len(TAU),)),
        observed,
    )


@dataclass(frozen=True)
class Effects:
    """What apparent places are made of: an effect that is left out is taken for none.

    Attributes
    ----------
    annual_aberration
        Of the Earth's motion, up to 20.5 arcsec.
    light_deflection
        By the Sun, below 0.01 arcsec at night.
    diurnal_aberration
        Of the station's motion, up to 0.32 arcsec.
    refraction
        By the air: a minute of arc at 45 degrees.
    """

    annual_aberration: bool = True
    light_deflection: bool = True
    diurnal_aberration: bool = True
    refraction: bool = True

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the effects that are left out, as reports have them."""
        return tuple(name.replace("_", " ") for name, taken in vars(self).items() if not taken)


@dataclass(frozen=True)
class Site:
    """A station under the sky.

    Attributes
    ----------
    latitude
        Radians, positive north.
    longitude_west
        Radians, positive west.
    elevation
        Metres.
    air
        Its air.
    aberration
        Constant of diurnal aberration at the equator, radians.
    number, name
        As the station is called.
    effects
        Which effects places and standard coordinates have.
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
        """Latitude, aberration, temperature and pressure as the core takes them: 0 for what is left out."""
        aberration = self.aberration if self.effects.diurnal_aberration else 0.0
        pressure = self.air.pressure if self.effects.refraction else 0.0
        return (self.latitude, aberration, self.air.temperature, pressure)

    def standard_coordinates(
        self, places: ArrayLike, sidereal_times: ArrayLike, tau: ArrayLike = TAU
    ) -> Floats:
        """Return refracted standard coordinates xi, eta of apparent places.

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
        """Return apparent places of refracted standard coordinates, the inverse of `standard_coordinates`."""
        standard = np.asarray(standard, float)
        times = np.ascontiguousarray(np.broadcast_to(np.asarray(sidereal_times, float), len(standard)))
        return _photocore.star_places(standard, times, self.core, np.asarray(tau, float))
