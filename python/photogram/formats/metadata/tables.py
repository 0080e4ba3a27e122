"""Positions that files of photographs carry, as tables of a plain project."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from photogram.errors import InputError
from photogram.formats.metadata.merged import Metadata
from photogram.formats.metadata.record import ELLIPSOIDAL
from photogram.formats.metadata.systems import LEVER_SD, SHIFT_SD, Located, located
from photogram.formats.plain.schema import AXES, deviation_columns
from photogram.io.csv_text import csv_text

__all__ = ["GROUPS", "gnss_files"]

GROUPS = "gnss_groups.csv"
_COMMENT = (
    "longitude and latitude (degrees), height above the ellipsoid (metres) of WGS 84, standard deviations of"
    f' east, north, height (metres); project.toml: [gnss] crs = "{ELLIPSOIDAL}"'
)


def gnss_files(
    metadata: Metadata, path: Path, crs: str | None = None, sd: Sequence[float] | None = None
) -> dict[Path, bytes]:
    """Return a table `gnss` of a plain project, and `gnss_groups` beside it where positions need it.

    Parameters
    ----------
    metadata
        What files of photographs say.
    path
        Of the table.
    crs, sd
        As :func:`photogram.formats.metadata.systems.located` takes them.

    Raises
    ------
    InputError
        No positions, heights of two kinds or of a kind that nobody says, positions beyond their system.
    """
    known = located(list(metadata.photos.values()), crs, sd)
    if not known.records:
        raise InputError("holds no positions of photos", file=metadata.directory)
    files = {path: csv_text(_positions(known), [_COMMENT])}
    flights = list(dict.fromkeys(each for each in known.flights if each))
    if flights:
        files[path.with_name(GROUPS)] = csv_text(_groups(flights))
    return files


def _positions(known: Located) -> dict[str, Any]:
    """Return the columns: names of photos without their folders, where that is enough."""
    xyz, sd = known.geographic()
    names = [PurePosixPath(each.photo).name for each in known.records]
    often = Counter(names)
    return {
        "photo": [
            each.photo if often[name] > 1 else name for name, each in zip(names, known.records, strict=True)
        ],
        **dict(zip(("longitude", "latitude", "height"), xyz.T, strict=True)),
        **dict(zip(deviation_columns(AXES), sd.T, strict=True)),
        "group": known.flights,
        "source": [each.position.source if each.position else "" for each in known.records],
        "sd_source": [each.deviations.source if each.deviations else "" for each in known.records],
    }


def _groups(flights: Sequence[str]) -> dict[str, Any]:
    """Return the columns of what positions of a flight have in common: see the module `located`."""
    count = len(flights)
    columns: dict[str, Any] = {"group": list(flights), "shift": ["true"] * count}
    for kind, deviation in (("lever", LEVER_SD), ("shift", SHIFT_SD)):
        columns |= {f"sd_{kind}_{axis}": [deviation] * count for axis in AXES}
    return columns
