"""Support data of images (ISDs of the Community Sensor Model), labels of ISIS cubes, as photos that move."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.formats.csm.isd import Isd
    from photogram.formats.csm.lists import read_list, read_support
    from photogram.formats.csm.photos import SupportedImage

__all__ = [
    "Isd",
    "SupportedImage",
    "read_list",
    "read_support",
]

_HOMES = {
    "Isd": "isd",
    "read_list": "lists",
    "read_support": "lists",
    "SupportedImage": "photos",
}
"""The module of each name, loaded when it is first asked for."""

__getattr__, __dir__ = on_demand(__name__, _HOMES)
