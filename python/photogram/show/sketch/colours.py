"""Colours of values without matplotlib: the maps of the house as a few colours and what lies between."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.show.sketch.marks import Shades
from photogram.show.style import BLUE, VERMILION

MAPS = {
    # Of the 256 colours of cividis (Nunez, Anderton and Renslow, PLoS ONE 13, 2018); straight lines between
    # these are within 4 of 255 of all of them.
    "ordered": (
        (0, 21, 34, 52, 147, 179, 205, 232, 251, 255),
        "00224e 003170 1e3a6f 36466c 8f8a78 aea371 c9b965 e7d150 fde334 fee838",
    ),
    "signed": ((0, 127.5, 255), f"{BLUE[1:]} ffffff {VERMILION[1:]}"),
}


def stops(name: str) -> tuple[Floats, Floats]:
    """Return (n,) places from 0 to 1 and (n, 3) colours, 0 to 255, of a map."""
    places, colours = MAPS[name]
    return np.array(places) / 255.0, np.array([list(bytes.fromhex(each)) for each in colours.split()], float)


def rgb(shades: Shades, values: Floats) -> Indices:
    """Return (..., 3) red, green and blue, 0 to 255, of values; those beyond have the colours of the ends."""
    places, colours = stops(shades.map)
    parts = shades.parts(values)
    return np.stack([np.interp(parts, places, own) for own in colours.T], axis=-1).round().astype(np.int64)


def hexadecimal(colour: Indices) -> str:
    """Return red, green and blue as the pages write them."""
    return "#{:02x}{:02x}{:02x}".format(*colour.tolist())
