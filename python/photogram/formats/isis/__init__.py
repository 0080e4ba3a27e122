"""Control networks of ISIS, the planetary mapping system of the U.S. Geological Survey."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from photogram.formats.format import Format, later
from photogram.formats.isis.reading import is_network
from photogram.io.files import reading
from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.formats.isis.network import POINT_TYPES, ControlNetwork, measures_of, points_of
    from photogram.formats.isis.reading import read_network
    from photogram.formats.isis.writing import binary_network, network_text

__all__ = [
    "POINT_TYPES",
    "ControlNetwork",
    "binary_network",
    "measures_of",
    "network_text",
    "points_of",
    "read_network",
]

_HOMES = {
    "binary_network": "writing",
    "ControlNetwork": "network",
    "measures_of": "network",
    "network_text": "writing",
    "POINT_TYPES": "network",
    "points_of": "network",
    "read_network": "reading",
}
"""The module of each name, loaded when it is first asked for."""

TITLE = "control network (ISIS)"
HEAD = 1 << 16
"""Bytes that tell a network."""


def _recognises(path: Path) -> bool:
    if not path.is_file():
        return False
    with reading(path), path.open("rb") as file:
        return is_network(file.read(HEAD))


FORMAT = Format(
    name="isis",
    title=TITLE,
    recognises=_recognises,
    read=later(f"{__name__}.assembling", "read"),
    results=later(f"{__name__}.writing", "results"),
    adjusting=later(f"{__name__}.rejection", "rejecting"),
)

__getattr__, __dir__ = on_demand(__name__, _HOMES)
