"""Fiducial marks: what they are called by the sides of the picture, and where they usually are.

Sides are those of the positive with the data strip (clock, level, number) at the left: `ll, ul, ur, lr` in
the corners, `ml, mt, mr, mb` amid the sides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass

__all__ = ["SIDES", "DataStrip", "UsualPlaces", "by_side", "turned", "turned_name", "usual_places"]

DataStrip = Literal["left", "top"]

SIDES = ("ll", "ur", "ul", "lr", "ml", "mr", "mt", "mb")
"""The marks in the order of their numbers in USGS certificates, 1 to 8."""
_LETTERS = {"a": "ml", "b": "mr", "c": "mb", "d": "mt"}
_TURNED = {"ul": "ll", "ll": "lr", "lr": "ur", "ur": "ul", "mt": "ml", "ml": "mb", "mb": "mr", "mr": "mt"}
"""What the sides of a frame with the strip on top are when the strip lies at the left."""


def by_side(name: str) -> str:
    """Return the side of a mark that a certificate calls by its number or letter; other names as they are."""
    plain = name.strip()
    if plain in {str(number) for number in range(1, len(SIDES) + 1)}:
        return SIDES[int(plain) - 1]
    low = plain.lower()
    return low if low in SIDES else _LETTERS.get(low, plain)


def turned_name(name: str, data_strip: DataStrip) -> str:
    """Return what a side is called once the data strip lies at the left; own names as they are."""
    return _TURNED.get(name, name) if data_strip == "top" else name


def turned(xy: Floats, data_strip: DataStrip) -> Floats:
    """Return places (..., 2) once the data strip lies at the left: from the top (x, y) -> (-y, x)."""
    return np.stack([-xy[..., 1], xy[..., 0]], axis=-1) if data_strip == "top" else xy


_SIGNS = {
    "ll": (-1, -1),
    "ur": (1, 1),
    "ul": (-1, 1),
    "lr": (1, -1),
    "ml": (-1, 0),
    "mr": (1, 0),
    "mt": (0, 1),
    "mb": (0, -1),
}
"""In which direction marks lie from the centre."""


@dataclass(frozen=True)
class UsualPlaces:
    """Where the marks of a type of camera are.

    Attributes
    ----------
    corner, middle
        Distance of the marks from the axes (mm): corners at (corner, corner), middles at (middle, 0).
    sd_corner, sd_middle
        What single marks differ from that (mm): robust standard deviations of public reports.
    """

    corner: float
    middle: float
    sd_corner: float
    sd_middle: float

    def places(self, names: Sequence[str]) -> dict[str, tuple[float, float]]:
        """Return the places of marks by their sides; own names have none."""
        found = {}
        for name in names:
            if name in _SIGNS:
                (x, y), away = _SIGNS[name], self.middle if name.startswith("m") else self.corner
                found[name] = (x * away, y * away)
        return found

    def sd(self, name: str) -> float:
        """Return the standard deviation of a mark."""
        return self.sd_middle if name.startswith("m") else self.sd_corner


_WILD = UsualPlaces(106.0, 110.0, 0.013, 0.013)
_TYPES: Mapping[str, UsualPlaces] = {
    "rc8": _WILD,
    "rc10": _WILD,
    "rmka15/23": UsualPlaces(103.96, 113.0, 0.04, 0.015),
}
"""By type, from USGS reports (docs/certificates.md)."""


def usual_places(camera_type: str) -> UsualPlaces | None:
    """Return the usual places of a type of camera, whatever is written before it; None of one not known."""
    plain = "".join(camera_type.lower().split())
    return next((found for name, found in _TYPES.items() if plain.endswith(name)), None)
