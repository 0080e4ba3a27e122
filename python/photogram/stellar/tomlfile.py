"""Parts of TOML files of stellar calibrations: station, effects, pole, names of other files."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path

from photogram.io.angles import ARCSEC
from photogram.io.places import at_place
from photogram.io.toml import TomlTree, read_toml
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


def inputs(path: Path) -> list[Path]:
    """Return a file of a plate or night, and the files that it names: results must not replace them."""
    tables = [table for _, table in read_toml(path).items() if isinstance(table.value, dict)]
    keys = ("file", "prior", "start")
    return [path, *(table[key].named_file() for table in tables for key in keys if key in table)]


def effects(table: TomlTree) -> Effects:
    """Return the effects on apparent positions, except for disabled ones."""
    return Effects(**{one.name: table.get(one.name, True).switch() for one in fields(Effects)})


def site(table: TomlTree) -> Site:
    """Return the station of a table."""
    table.only(_STATION)
    latitude = table["latitude_deg"].number(-90, 90)
    temperature = table.get("temperature_K", 273.15).number()
    if table.says("pressure_hPa", "pressure_mmHg"):
        pressure = table["pressure_hPa"].number() / HECTOPASCAL
    else:
        pressure = table.get("pressure_mmHg", 760.0).number()
    if table.says("longitude_east_deg", "longitude_west_deg"):
        west = -table["longitude_east_deg"].number(-360, 360)
    else:
        west = table.get("longitude_west_deg", 0.0).number(-360, 360)
    with at_place(table):
        air = Air(temperature, pressure)
    return Site(
        latitude=math.radians(latitude),
        longitude_west=math.radians(west),
        elevation=table.get("elevation_m", 0.0).number(-500, 100_000),
        air=air,
        aberration=table["aberration_arcsec"].number(0, 1) * ARCSEC
        if "aberration_arcsec" in table
        else ABERRATION,
        number=table.get("number", "").word(),
        name=table.get("name", "").word(),
    )


def pole_arcsec(table: TomlTree, key: str) -> float:
    """Return a coordinate of the pole; zero if it is missing."""
    return table.get(key, 0.0).number(-2, 2)
