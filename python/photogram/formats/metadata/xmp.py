"""Packets of XMP: positions and standard deviations of DJI, accuracies of Pix4D.

Metadata tools rewrite attributes as nested elements and the other way: both are read, by their namespaces.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path

from photogram.formats.metadata.record import (
    ELLIPSOIDAL,
    UNSAID,
    UNSAID_SYSTEM,
    Said,
    Triple,
    geographic_position,
    usable_deviations,
)
from photogram.io.places import Place
from photogram.messages import quoted

__all__ = ["read_packet", "said_by_packet"]

DJI, PIX4D = "http://www.dji.com/drone-dji/1.0", "http://pix4d.com/camera/1.0"
LARGEST = 1 << 20
"""Bytes of a packet at most; those of cameras have a few thousand."""
_SPELLINGS = {"GpsLongtitude": "GpsLongitude"}
"""What older cameras write."""


class _WithoutDoctype(ElementTree.TreeBuilder):
    """A tree of a document that declares nothing: what entities could do is not begun."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise ValueError("has a <!DOCTYPE, which no packet needs: it is not read")


def read_packet(data: bytes, path: Path) -> dict[tuple[str, str], str]:
    """Return the simple properties of a packet by namespace (without a slash at its end) and name.

    Parameters
    ----------
    data
        The packet, with or without its wrapper.
    path
        For errors.

    Raises
    ------
    InputError
        What is no XML, declares a document type or is too large; a property that has two values.
    """
    place = Place(path)
    if len(data) > LARGEST:
        raise place.error(f"a packet of XMP of {len(data)} bytes: {LARGEST} are the most")
    try:
        root = ElementTree.fromstring(
            data.strip(b"\0 \t\r\n"), ElementTree.XMLParser(target=_WithoutDoctype())
        )
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise place.error(f"its XMP cannot be read: {error}") from None
    found: dict[tuple[str, str], str] = {}
    for element in root.iter():
        for name, value in (*element.attrib.items(), (element.tag, element.text or "")):
            space, _, own = name.removeprefix("{").rpartition("}")
            key = space.rstrip("/"), _SPELLINGS.get(own, own)
            text = value.strip()
            if key[0] in (DJI, PIX4D) and text and found.setdefault(key, text) != text:
                raise place.error(f"its XMP has {own} twice: {quoted(found[key])} and {quoted(text)}")
    return found


def said_by_packet(data: bytes, path: Path) -> Said | None:
    """Return what a packet of XMP says of its photo; None where it says nothing of its position.

    Parameters
    ----------
    data
        The packet.
    path
        The file that holds it.

    Raises
    ------
    InputError
        A packet that cannot be read, a value that is no number.

    Notes
    -----
    Section 6 of the specification: `RtkStdLon`, `RtkStdLat` and `RtkStdHgt` are the standard deviations of
    east, north and height; without a solution they are not taken. Heights are above the ellipsoid where the
    camera has had corrections, else nothing says what they are above.
    """
    properties = read_packet(data, path)
    dji = {name: text for (space, name), text in properties.items() if space == DJI}
    accuracies = {name: text for (space, name), text in properties.items() if space == PIX4D}
    if not properties:
        return None
    place = Place(path)
    flag = _flag(dji, place)
    sd = None if flag == 0 else _triple(dji, ("RtkStdLon", "RtkStdLat", "RtkStdHgt"), place)
    rtk = sd is not None or flag not in (None, 0)
    position = _position(dji, place)
    if sd is None:
        sd = _triple(accuracies, ("GPSXYAccuracy", "GPSXYAccuracy", "GPSZAccuracy"), place)
    return Said(
        "XMP",
        place,
        crs=ELLIPSOIDAL if rtk else UNSAID_SYSTEM,
        heights="" if rtk else UNSAID,
        position=position,
        sd=sd,
        rtk=rtk,
        flag=flag,
        angles=_angles(dji, place),
    )


def _flag(dji: Mapping[str, str], place: Place) -> int | None:
    if "RtkFlag" not in dji:
        return None
    return place.whole(dji["RtkFlag"], "RtkFlag", highest=1000)


def _number(properties: Mapping[str, str], name: str, place: Place) -> float:
    """Return a property as a number; NaN where it is not there."""
    if name not in properties:
        return math.nan
    return Place(place.file, text=f"{name} {properties[name]}").number(properties[name], name)


def _triple(properties: Mapping[str, str], names: tuple[str, str, str], place: Place) -> Triple | None:
    return usable_deviations(*(_number(properties, name, place) for name in names))


def _angles(dji: Mapping[str, str], place: Place) -> Triple | None:
    yaw, pitch, roll = (_number(dji, f"Gimbal{each}Degree", place) for each in ("Yaw", "Pitch", "Roll"))
    return None if math.isnan(yaw + pitch + roll) else (yaw, pitch, roll)


def _position(dji: Mapping[str, str], place: Place) -> Triple | None:
    longitude, latitude, height = (
        _number(dji, name, place) for name in ("GpsLongitude", "GpsLatitude", "AbsoluteAltitude")
    )
    if math.isnan(longitude) or math.isnan(latitude):
        return None
    return geographic_position(place, (longitude, latitude, height))
