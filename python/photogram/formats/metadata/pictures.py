"""Metadata in image headers: EXIF and XMP (extra `photos`).

EXIF contains position (degrees, minutes, seconds), height and radial accuracy. XMP packets contain positions
and standard deviations of DJI, and accuracies of Pix4D. Some tools convert XMP attributes to nested elements
or back; both are read, by namespace.
"""

from __future__ import annotations

import math
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from photogram.errors import InputError
from photogram.formats.metadata.record import (
    ELLIPSOIDAL,
    SEA_LEVEL,
    UNSAID,
    UNSAID_SYSTEM,
    Said,
    Triple,
    geographic_position,
    usable_deviations,
)
from photogram.io.files import reading
from photogram.io.places import Place
from photogram.words import phrase

GPS = 0x8825  # The EXIF tag that points to the GPS tags
_EXIF, _TAKEN, _FRACTION = 0x8769, 0x9003, 0x9291
"""EXIF tags: pointer to the EXIF group, and in it DateTimeOriginal and SubSecTimeOriginal."""

LATITUDE, LONGITUDE, ALTITUDE_REFERENCE, ALTITUDE, STATUS, DOP, ERROR = 2, 4, 5, 6, 9, 11, 31
"""Tags by number (EXIF 2.32, table 15); the letter of a coordinate is the previous tag."""
RADIAL = (
    "GPSHPositioningError of EXIF is radial, and the standard does not say how sure: standard deviations of"
    " east and north are its value over the root of 2, of heights twice that"
)
DOP_ALONE = "GPSDOP of EXIF gives no metres: it is not taken"
DJI, PIX4D = "http://www.dji.com/drone-dji/1.0", "http://pix4d.com/camera/1.0"
_PROPERTIES = (
    (DJI, ("GpsLongitude", "GpsLatitude", "AbsoluteAltitude")),
    (DJI, ("RtkStdLon", "RtkStdLat", "RtkStdHgt")),
    (PIX4D, ("GPSXYAccuracy", "GPSXYAccuracy", "GPSZAccuracy")),
    (DJI, ("GimbalYawDegree", "GimbalPitchDegree", "GimbalRollDegree")),
)
"""Namespaces and names of numbers in XMP packets: position, standard deviations, accuracies and angles."""
LARGEST = 1 << 20  # Largest size of a packet in bytes; cameras write a few thousand
_SPELLINGS = {"GpsLongtitude": "GpsLongitude"}  # Spelling of older cameras


def said_by_picture(path: Path) -> list[Said]:
    """Return metadata of an image file: XMP, then EXIF."""
    packet, tags = _head(path, GPS)
    found = [None if packet is None else said_by_packet(packet, path), said_by_tags(tags, Place(path))]
    return [each for each in found if each is not None]


def time_of_picture(path: Path) -> float | None:
    """Return the EXIF time of exposure in seconds; None without."""
    tags = _head(path, _EXIF)[1]
    try:
        time = datetime.strptime(str(tags[_TAKEN]).strip("\0 "), "%Y:%m:%d %H:%M:%S")
        return (time - datetime.min).total_seconds() + float(f"0.{str(tags.get(_FRACTION, 0)).strip()}")
    except (KeyError, ValueError):
        return None


def _head(path: Path, group: int) -> tuple[bytes | None, Mapping[int, Any]]:
    """Return the XMP packet and a group of EXIF tags of an image file.

    The class of the format opens the file because Image.open rejects large images, which are not decoded
    here.
    """
    try:
        from PIL.JpegImagePlugin import JpegImageFile
        from PIL.TiffImagePlugin import TiffImageFile
    except ImportError:
        raise InputError(phrase("photos.pillow"), file=path) from None
    kind = JpegImageFile if path.suffix.lower() in (".jpg", ".jpeg") else TiffImageFile
    with reading(path):
        file = path.open("rb")
    with file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # About damaged tags that are not used
        try:
            with kind(file) as picture:
                packet = picture.info.get("xmp")
                tags = dict(picture.getexif().get_ifd(group))
        except Exception as error:  # A damaged file may raise any exception
            raise InputError(phrase("photos.picture", reason=str(error)), file=path) from None
    return (packet if isinstance(packet, bytes) else None), tags


def said_by_tags(tags: Mapping[int, Any], place: Place) -> Said | None:
    """Return the position and accuracy in GPS tags; None without both.

    Section 6 of the specification. `GPSHPositioningError` is horizontal and radial: the standard deviation of
    east and north is its value divided by the root of 2, of heights twice that. `GPSAltitudeRef` 0 and 1 mean
    sea level up to EXIF 2.32 and the ellipsoid from EXIF 3.0, which has 2 and 3 for sea level. The reference
    of heights with 0 and 1 is therefore unknown, and the user must specify it.
    """
    error = _number_of_tag(tags, ERROR, place)
    each = error / math.sqrt(2)
    sd = usable_deviations(each, each, 2 * each)
    reference = tags.get(ALTITUDE_REFERENCE, 0)
    if isinstance(reference, bytes) and len(reference) == 1:
        reference = reference[0]
    position: Triple | None = None
    if _word_of_tag(tags, STATUS) != "V":  # V: the receiver had no solution
        latitude = _angle_of_tag(tags, LATITUDE, "NS", place)
        longitude = _angle_of_tag(tags, LONGITUDE, "EW", place)
        if not math.isnan(latitude + longitude):
            height = _number_of_tag(tags, ALTITUDE, place)
            height = -height if reference in (1, 3) else height
            position = geographic_position(place, (longitude, latitude, height))
    if position is None and sd is None:
        return None
    if reference not in (0, 1, 2, 3):
        raise place.error(phrase("photos.altitude-reference", value=str(reference)))
    without = math.isnan(_number_of_tag(tags, DOP, place))
    remark = RADIAL if sd is not None else "" if without else DOP_ALONE
    heights = UNSAID if reference < 2 else SEA_LEVEL
    return Said("EXIF", place, UNSAID_SYSTEM, heights, position, sd, remark=remark)


def _number_of_tag(tags: Mapping[int, Any], tag: int, place: Place) -> float:
    """Return a tag as a number; NaN if it is missing or its denominator is 0."""
    value = tags.get(tag)
    try:
        found = math.nan if value is None else float(value)
    except (TypeError, ValueError, OverflowError, ZeroDivisionError):
        found = math.inf
    if math.isinf(found):
        raise place.error(phrase("photos.tag", tag=tag, value=str(value)))
    return found


def _word_of_tag(tags: Mapping[int, Any], tag: int) -> str:
    return str(tags.get(tag, "")).strip("\0 ").upper()


def _angle_of_tag(tags: Mapping[int, Any], tag: int, letters: str, place: Place) -> float:
    """Return a latitude or longitude in degrees; NaN if it is missing."""
    value = tags.get(tag)
    if value is None:
        return math.nan
    if not isinstance(value, Sequence) or isinstance(value, str | bytes) or len(value) != 3:
        raise place.error(phrase("photos.angle", tag=tag, value=str(value)))
    degrees, minutes, seconds = (_number_of_tag({tag: each}, tag, place) for each in value)
    letter = _word_of_tag(tags, tag - 1)
    if letter not in tuple(letters):
        raise place.error(phrase("photos.letter", tag=tag - 1, value=letter, names=list(letters)))
    size = degrees + minutes / 60 + seconds / 3600
    return -size if letter == letters[1] else size


class _WithoutDoctype(ElementTree.TreeBuilder):
    """An XML tree builder that rejects document types, and so entities."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise ValueError("the <!DOCTYPE must be removed")


def _properties(data: bytes, path: Path) -> dict[tuple[str, str], str]:
    """Return simple properties of a packet by namespace and name."""
    place = Place(path)
    if len(data) > LARGEST:
        raise place.error(phrase("photos.packet", n=len(data), most=LARGEST))
    try:
        parser = ElementTree.XMLParser(target=_WithoutDoctype())
        root = ElementTree.fromstring(data.strip(b"\0 \t\r\n"), parser)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise place.error(phrase("photos.xmp", reason=str(error))) from None
    found: dict[tuple[str, str], str] = {}
    for element in root.iter():
        for name, value in (*element.attrib.items(), (element.tag, element.text or "")):
            space, _, own = name.removeprefix("{").rpartition("}")
            key = space.rstrip("/"), _SPELLINGS.get(own, own)
            text = value.strip()
            if key[0] in (DJI, PIX4D) and text and found.setdefault(key, text) != text:
                raise place.error(phrase("photos.repeated", name=own, first=found[key], second=text))
    return found


def said_by_packet(data: bytes, path: Path) -> Said | None:
    """Return the position and accuracy in an XMP packet; None without both.

    Section 6 of the specification: `RtkStdLon`, `RtkStdLat` and `RtkStdHgt` are the standard deviations of
    east, north and height, unused without a solution. Heights are ellipsoidal if the receiver had
    corrections; otherwise their reference is unknown.
    """
    properties, place = _properties(data, path), Place(path)
    if not properties:
        return None

    def number(space: str, name: str) -> float:
        text = properties.get((space, name))
        return math.nan if text is None else Place(path, text=f"{name} {text}").number(text, name)

    values = [[number(space, name) for name in names] for space, names in _PROPERTIES]
    position, deviations, accuracies, (yaw, pitch, roll) = values
    text = properties.get((DJI, "RtkFlag"))
    flag = None if text is None else place.whole(text, "RtkFlag", highest=1000)
    sd = None if flag == 0 else usable_deviations(*deviations)
    rtk = sd is not None or flag not in (None, 0)
    system = (ELLIPSOIDAL, "") if rtk else (UNSAID_SYSTEM, UNSAID)
    known = None if math.isnan(sum(position[:2])) else geographic_position(place, position)
    angles = None if math.isnan(yaw + pitch + roll) else (yaw, pitch, roll)
    return Said("XMP", place, *system, known, sd or usable_deviations(*accuracies), rtk, flag, angles)
