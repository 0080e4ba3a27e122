"""Parts of TOML files of stellar calibrations: station, effects, pole, names of other files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path

from photogram.io.angles import ARCSEC
from photogram.io.places import at_place
from photogram.io.toml import KeyPlace, Table, read_document
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


def named_files(
    path: Path, tables: Mapping[str, Sequence[str] | None], keys: Sequence[tuple[str, str]]
) -> list[Path]:
    """Return a file and the files named in its tables, which results must not replace."""
    document = read_document(path, tables)
    named = [(document.optional(table), key) for table, key in keys]
    return [path, *(table.path(key) for table, key in named if key in table)]


def effects(table: Table) -> Effects:
    """Return the effects on apparent positions, except for disabled ones."""
    return Effects(**{one.name: table.switch(one.name, True) for one in fields(Effects)})


def site(table: Table) -> Site:
    """Return the station of a table."""
    table.only(_STATION)
    latitude = table.number("latitude_deg", low=-90, high=90)
    temperature = table.number("temperature_K", 273.15)
    if table.says("pressure_hPa", "pressure_mmHg"):
        pressure = table.number("pressure_hPa") / HECTOPASCAL
    else:
        pressure = table.number("pressure_mmHg", 760.0)
    if table.says("longitude_east_deg", "longitude_west_deg"):
        west = -table.number("longitude_east_deg", low=-360, high=360)
    else:
        west = table.number("longitude_west_deg", 0.0, low=-360, high=360)
    with at_place(KeyPlace(table)):
        air = Air(temperature, pressure)
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
    """Return a coordinate of the pole; zero if it is missing."""
    return table.number(key, 0.0, low=-2, high=2)
