"""What TOML files of calibrations by stars have alike: the station, the effects on places, the pole."""

from __future__ import annotations

import math
from dataclasses import fields

from photogram.errors import InputError
from photogram.io.toml import Table
from photogram.show.angles import ARCSEC
from photogram.stellar.sky import ABERRATION, HECTOPASCAL, Air, Effects, Site

_STATION = {
    "latitude_deg",
    "longitude_east_deg",
    "longitude_west_deg",
    "elevation_m",
    "temperature_K",
    "pressure_hPa",
    "pressure_mmHg",
    "aberration_arcsec",
    "number",
    "name",
}


def effects(table: Table) -> Effects:
    """Return which effects apparent places have, all that the table does not switch off.

    Raises
    ------
    InputError
        A value that is neither true nor false.
    """
    return Effects(**{one.name: table.switch(one.name, True) for one in fields(Effects)})


def site(table: Table) -> Site:
    """Return the station of a table.

    Raises
    ------
    InputError
        A key that is not known, a value of another kind, a latitude beyond the poles, air that cannot be.
    """
    table.only(_STATION)
    latitude = table.number("latitude_deg")
    if not abs(latitude) <= 90:
        raise table.error("latitude_deg", f"is {latitude:g}; it is not between -90 and 90 degrees")
    temperature = table.number("temperature_K", 273.15)
    if table.says("pressure_hPa", "pressure_mmHg"):
        pressure = table.number("pressure_hPa") / HECTOPASCAL
    else:
        pressure = table.number("pressure_mmHg", 760.0)
    if table.says("longitude_east_deg", "longitude_west_deg"):
        west = -table.number("longitude_east_deg", low=-360, high=360)
    else:
        west = table.number("longitude_west_deg", 0.0, low=-360, high=360)
    try:
        air = Air(temperature, pressure)
    except InputError as error:
        raise InputError(f"[{table.name}] {error.message}", file=table.file) from None
    return Site(
        latitude=math.radians(latitude),
        longitude_west=math.radians(west),
        elevation=table.number("elevation_m", 0.0, low=-500, high=100_000),
        air=air,
        aberration=table.number("aberration_arcsec", low=0, high=1) * ARCSEC
        if "aberration_arcsec" in table
        else ABERRATION,
        number=table.word("number", ""),
        name=table.word("name", ""),
    )


def pole_arcsec(table: Table, key: str) -> float:
    """Return a coordinate of the pole, never a second of arc from the mean one; zero where it is missing.

    Raises InputError: it is something else.
    """
    return table.number(key, 0.0, low=-2, high=2)
