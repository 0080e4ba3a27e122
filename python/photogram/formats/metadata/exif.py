"""The GPS tags of EXIF: a position in degrees, minutes and seconds, a height, a radial accuracy."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from photogram.formats.metadata.record import (
    SEA_LEVEL,
    UNSAID,
    UNSAID_SYSTEM,
    Said,
    Triple,
    geographic_position,
    usable_deviations,
)
from photogram.io.places import Place
from photogram.messages import quoted

__all__ = ["said_by_tags"]

LATITUDE, LONGITUDE, ALTITUDE_REFERENCE, ALTITUDE, STATUS, DOP, ERROR = 2, 4, 5, 6, 9, 11, 31
"""Tags by their numbers (EXIF 2.32, table 15); the letter of a coordinate is the tag before it."""
RADIAL = (
    "GPSHPositioningError of EXIF is radial, and the standard does not say how sure: standard deviations of"
    " east and north are its value over the root of 2, of heights twice that"
)
DOP_ALONE = "GPSDOP of EXIF gives no metres: it is not taken"


def said_by_tags(tags: Mapping[int, Any], place: Place) -> Said | None:
    """Return what the GPS tags of a picture say; None where there is neither a position nor an accuracy.

    Parameters
    ----------
    tags
        By their numbers, as pillow gives them: rational numbers, letters, bytes.
    place
        For errors.

    Raises
    ------
    InputError
        A latitude or longitude without its letter, angles beyond the earth, values of another kind.

    Notes
    -----
    Section 6 of the specification. `GPSHPositioningError` is horizontal and radial: east and north have its
    value over the root of 2, heights twice that. `GPSAltitudeRef` 0 and 1 were sea level up to EXIF 2.32, and
    are the ellipsoid from EXIF 3.0 on, which has 2 and 3 for sea level: what heights of 0 and 1 are above is
    not certain, and who reads them says it.
    """
    error = _number(tags, ERROR, place)
    each = error / math.sqrt(2)
    sd = usable_deviations(each, each, 2 * each)
    position = _position(tags, place)
    if position is None and sd is None:
        return None
    remark = RADIAL if sd is not None else DOP_ALONE if not math.isnan(_number(tags, DOP, place)) else ""
    heights = UNSAID if _reference(tags, place) < 2 else SEA_LEVEL
    return Said("EXIF", place, UNSAID_SYSTEM, heights, position, sd, remark=remark)


def _number(tags: Mapping[int, Any], tag: int, place: Place) -> float:
    """Return a tag as a number; NaN where it is not there, or has no denominator."""
    value = tags.get(tag)
    return math.nan if value is None else _as_number(value, place, tag)


def _as_number(value: Any, place: Place, tag: int) -> float:
    try:
        found = float(value)
    except (TypeError, ValueError, OverflowError, ZeroDivisionError):
        raise place.error(f"GPS tag {tag} of its EXIF is no number: {quoted(str(value))}") from None
    if math.isinf(found):
        raise place.error(f"GPS tag {tag} of its EXIF is no finite number")
    return found


def _reference(tags: Mapping[int, Any], place: Place) -> int:
    """Return the altitude reference: 0, 1, 2 or 3; 0 where there is none."""
    value = tags.get(ALTITUDE_REFERENCE, 0)
    if isinstance(value, bytes) and len(value) == 1:
        value = value[0]
    if value not in (0, 1, 2, 3):
        raise place.error(f"its EXIF has the altitude reference {quoted(str(value))}: 0 to 3 are known")
    return int(value)


def _position(tags: Mapping[int, Any], place: Place) -> Triple | None:
    if str(tags.get(STATUS, "")).strip("\0 ").upper() == "V":  # the receiver had no fix
        return None
    latitude = _angle(tags, LATITUDE, "NS", place)
    longitude = _angle(tags, LONGITUDE, "EW", place)
    if math.isnan(latitude) or math.isnan(longitude):
        return None
    height = _number(tags, ALTITUDE, place)
    signed = -height if _reference(tags, place) in (1, 3) else height
    return geographic_position(place, (longitude, latitude, signed))


def _angle(tags: Mapping[int, Any], tag: int, letters: str, place: Place) -> float:
    """Return a latitude or longitude in degrees; NaN where it is not there."""
    value = tags.get(tag)
    if value is None:
        return math.nan
    if not isinstance(value, Sequence) or isinstance(value, str | bytes) or len(value) != 3:
        raise place.error(f"GPS tag {tag} of its EXIF is not degrees, minutes and seconds")
    degrees, minutes, seconds = (_as_number(each, place, tag) for each in value)
    letter = str(tags.get(tag - 1, "")).strip("\0 ").upper()
    if letter not in tuple(letters):
        raise place.error(f"GPS tag {tag - 1} of its EXIF is {quoted(letter)}: {' or '.join(letters)} is")
    size = degrees + minutes / 60 + seconds / 3600
    return -size if letter == letters[1] else size
