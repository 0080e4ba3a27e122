"""TOML files of calibrations: tables and keys that are not known are refused, and errors name the file."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from photogram.angles import ARCSEC
from photogram.errors import InputError
from photogram.files import read_bytes
from photogram.messages import listed
from photogram.stellar.sky import ABERRATION, Air, Site

__all__ = ["read_document", "site", "usable"]

_STATION = {
    "latitude_deg",
    "longitude_west_deg",
    "elevation_m",
    "temperature_K",
    "pressure_mmHg",
    "aberration_arcsec",
    "number",
    "name",
}


def read_document(path: Path, tables: Mapping[str, Collection[str] | None]) -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    path
        The file.
    tables
        What it may hold: the keys of each table, None where the reader of the table checks them.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or has tables or keys besides these.
    """
    try:
        document = tomllib.loads(read_bytes(path).decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(str(error), file=path) from None
    unknown = sorted(set(document) - set(tables))
    if unknown:
        raise InputError(f"there is no table {listed(unknown)}", file=path)
    for name, content in document.items():
        keys, single = tables[name], isinstance(content, dict)
        if not single and not (isinstance(content, list) and all(isinstance(c, dict) for c in content)):
            raise InputError(f"{name} is not a table", file=path)
        for table in [content] if single else content:
            if keys is not None and set(table) - set(keys):
                raise InputError(f"[{name}] has no {listed(sorted(set(table) - set(keys)))}", file=path)
    return document


@contextmanager
def usable(path: Path) -> Iterator[None]:
    """Turn what is missing or of a wrong kind in a document into an error that names its file."""
    try:
        yield
    except InputError as error:
        raise error if error.file else InputError(error.message, file=path) from None
    except KeyError as error:
        raise InputError(f"{error.args[0]} is missing", file=path) from None
    except (AttributeError, TypeError, ValueError, IndexError) as error:
        raise InputError(str(error), file=path) from None


def site(table: dict[str, Any]) -> Site:
    """Return the station of a table.

    Raises
    ------
    InputError
        A key that is not known, a latitude beyond the poles, air that cannot be.
    KeyError, TypeError
        The latitude is missing, or something is not a number.
    """
    unknown = sorted(set(table) - _STATION)
    if unknown:
        raise InputError(f"a station has no {listed(unknown)}")
    latitude, air = (
        table["latitude_deg"],
        Air(table.get("temperature_K", 273.15), table.get("pressure_mmHg", 760.0)),
    )
    if not abs(latitude) <= 90:
        raise InputError(f"the latitude {latitude} is not between -90 and 90 degrees")
    if not (air.temperature > 0 and air.pressure >= 0):
        raise InputError("the temperature in kelvin must be positive, the pressure not negative")
    return Site(
        latitude=math.radians(latitude),
        longitude_west=math.radians(table.get("longitude_west_deg", 0.0)),
        elevation=table.get("elevation_m", 0.0),
        air=air,
        aberration=table["aberration_arcsec"] * ARCSEC if "aberration_arcsec" in table else ABERRATION,
        number=str(table.get("number", "")),
        name=str(table.get("name", "")),
    )
