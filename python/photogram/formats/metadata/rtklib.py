"""Event files of RTKLIB (`*_events.pos`): one antenna position per exposure, ordered by time."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import datetime
from itertools import islice
from pathlib import Path

import numpy as np

from photogram.formats.metadata.record import (
    ELLIPSOIDAL,
    SEA_LEVEL,
    Said,
    Triple,
    geographic_position,
    usable_deviations,
)
from photogram.io.files import read_lines
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import quoted
from photogram.network.geometry import Spheroid, geocentric_to_geographic, local_frames

SOURCE = "RTKLIB"
SECONDS_OF_WEEK = 604_800
HEADER_LINES = 60
_COMMENT = "%"
_FLAGS = {1: 50, 2: 34, 5: 16}
"""Quality of RTKLIB as the flag of DJI: fixed, float, single."""
_WORDS = re.compile(r"[,;\s]+")
_EPOCH = datetime(1980, 1, 6)


@dataclass(frozen=True)
class Event:
    """The time of an exposure in seconds since the first GPS week, and its position."""

    seconds: float
    said: Said


def is_events(path: Path) -> bool:
    """Whether a text file has the header of RTKLIB's solutions."""
    return any(_is_header(line) for line in islice(read_lines(path), HEADER_LINES))


def _is_header(line: str) -> bool:
    return line.startswith(_COMMENT) and ("latitude(" in line or "x-ecef(" in line or "e-baseline(" in line)


def read_events(path: Path) -> list[Event]:
    """Read the events of a file in order of time."""
    head, heights, events = Place(path), "", list[Event]()
    for record, line in enumerate(read_lines(path), 1):
        if line.startswith(_COMMENT):
            heights = SEA_LEVEL if "/geodetic" in line else heights
            head = Place(path, record, line) if _is_header(line) else head
        elif line.strip():
            events.append(_event(Place(path, record, line), head, heights))
    if not events:
        raise head.error("has no events; RTKLIB writes *_events.pos if the receiver recorded exposures")
    return sorted(events, key=lambda event: event.seconds)


def _event(place: Place, head: Place, heights: str) -> Event:
    columns = head.text or ""
    if "e-baseline(" in columns:
        raise head.error(
            "has baselines from the base station; required are positions: set the solution format of RTKLIB"
            " to Lat/Lon/Height or X/Y/Z-ECEF"
        )
    geocentric = "x-ecef(" in columns
    words = _WORDS.split((place.text or "").strip())
    size = 3 if "latitude(d'" in columns else 1
    least, names = 2 * size + 8, "latitude, longitude, height, Q, ns, sdn, sde, sdu"
    if geocentric:
        least, names = 13, "x, y, z, Q, ns, sdx, sdy, sdz, sdxy, sdyz, sdzx"
    if len(words) < least:
        raise place.error(f"has {len(words)} words; an event has at least {least}: time (2 words), {names}")
    count = 3 if geocentric else 2 * size + 1
    *first, last = words[2 : 2 + count]
    quality, _, *rest = words[2 + count :]
    deviations = [place.number(word, "standard deviation") for word in rest[: 6 if geocentric else 3]]
    if geocentric:
        xyz = [place.number(word, "coordinate") for word in (*first, last)]
        position, (east, north, up) = _geographic(xyz, deviations)
    else:
        latitude, longitude = (_degrees(first[k : k + size], place) for k in (0, size))
        position = longitude, latitude, place.number(last, "height")
        north, east, up = deviations
    return Event(
        _seconds(words[:2], place),
        Said(
            SOURCE,
            place,
            ELLIPSOIDAL,
            "" if geocentric else heights,
            geographic_position(place, position),
            usable_deviations(east, north, up),
            rtk=True,
            flag=_FLAGS.get(place.whole(quality, "Q", highest=9)),
        ),
    )


def _geographic(xyz: Sequence[float], deviations: Sequence[float]) -> tuple[Triple, Triple]:
    """Return longitude, latitude, height and standard deviations of east, north, up; 0, 0, 0 stays.

    `deviations` are those of X, Y, Z, and the roots of the covariances XY, YZ, ZX with their signs.
    """
    if not any(xyz):
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    [place] = geocentric_to_geographic([xyz], Spheroid.wgs84())
    xx, yy, zz, xy, yz, zx = (value * abs(value) for value in deviations)
    [axes] = local_frames([place])
    turned = axes @ np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) @ axes.T
    longitude, latitude = np.degrees(place[:2]).tolist()
    east, north, up = np.sqrt(np.maximum(np.diagonal(turned), 0.0)).tolist()
    return (longitude, latitude, float(place[2])), (east, north, up)


def _degrees(words: Sequence[str], place: Place) -> float:
    """Return an angle in degrees from one word, or from degrees, minutes and seconds."""
    size = sum(abs(place.number(word, "angle")) / 60.0**k for k, word in enumerate(words))
    return math.copysign(size, -1.0 if words[0].startswith("-") else 1.0)


def _seconds(words: Sequence[str], place: Place) -> float:
    """Return seconds since the first GPS week from a date and a time, or from a week and its seconds."""
    if "/" not in words[0]:
        return place.whole(words[0], "week", highest=10**5) * SECONDS_OF_WEEK + place.number(
            words[1], "seconds"
        )
    try:
        time = datetime.strptime(f"{words[0]} {words[1].partition('.')[0]}", "%Y/%m/%d %H:%M:%S")
    except ValueError:
        text = quoted(" ".join(words))
        raise place.error(
            f"{text} must be a time such as 2024/05/17 10:07:45.123, or week and seconds"
        ) from None
    return (time - _EPOCH).total_seconds() + place.number(f"0.{words[1].partition('.')[2] or 0}", "time")
