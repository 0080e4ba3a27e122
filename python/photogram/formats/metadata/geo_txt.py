"""`geo.txt` of OpenDroneMap: positions of photos by their names, in the system of the first line."""

from __future__ import annotations

import math
from pathlib import Path

from photogram.formats.control_lists import system_of
from photogram.formats.metadata.record import (
    ELLIPSOIDAL,
    UNSAID_SYSTEM,
    Said,
    Triple,
    geographic_position,
    usable_deviations,
)
from photogram.io.files import read_lines
from photogram.io.places import Place

__all__ = ["NAME", "read_geo_txt"]

NAME = "geo.txt"
WORDS = (3, 4, 7, 9)
"""How many a line may have; what follows the ninth is of no use here."""


def read_geo_txt(path: Path) -> dict[str, Said]:
    """Read a file; return what it says by the names of photos.

    Raises
    ------
    InputError
        The file cannot be read, its first line is no system, a line at fault, a name that is there twice.

    Notes
    -----
    Section 6 of the specification: `name x y [z [yaw pitch roll [sd_h sd_v]]]`; east and north have sd_h
    each. Without the two columns nothing is said of standard deviations: those of another source stay.
    """
    places = [
        Place(path, record, line)
        for record, line in enumerate(read_lines(path), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not places:
        raise Place(path).error("names no system of coordinates in its first line")
    head, *rest = places
    crs = system_of((head.text or "").strip(), head)
    found: dict[str, Said] = {}
    for place in rest:
        name, *words = (place.text or "").split()
        if name in found:
            raise place.error(f"the photo {name} is there already, in record {found[name].place.record}")
        found[name] = _line(words, crs, place)
    return found


def _line(words: list[str], crs: str, place: Place) -> Said:
    count = len(words) + 1
    if count not in WORDS and count < WORDS[-1]:
        raise place.error(f"has {count} words: name x y [z [yaw pitch roll [sd_h sd_v]]]")
    values = [place.number(word) for word in words[:8]] + [math.nan] * (8 - len(words))
    x, y, z, yaw, pitch, roll, horizontal, vertical = values
    position: Triple | None = (x, y, z)
    if crs in (ELLIPSOIDAL, UNSAID_SYSTEM):
        position = geographic_position(place, (x, y, z))
    return Said(
        NAME,
        place,
        crs,
        position=position,
        sd=usable_deviations(horizontal, horizontal, vertical),
        angles=None if count < 7 else (yaw, pitch, roll),
    )
