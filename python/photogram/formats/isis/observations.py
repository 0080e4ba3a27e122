"""Images of one observation, which were taken in one flight and share the coefficients of its poses."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.csm.isd import Isd, Positions, Turns
from photogram.formats.csm.photos import trajectory_of
from photogram.messages import quoted
from photogram.network.motion import given_poses

_KEYWORDS: Mapping[str, int | None] = {
    r"LO[345]/[HM]RC/": 3,
    r"MRO/HIRISE/": 3,
    r"TGO/CaSSIS/": 3,
    r"JUNO/JNC/": 4,
    r"LRO/.*/NAC[LR]$": None,
    r"APOLLO1[567]/METRIC/": None,
    r"MRO/CTX/": None,
    r"MGS/MOC": None,
}
"""How serial numbers begin, and how many of their keywords, between slashes, name the observation, as in ISIS
(`ObservationKeys` of `appdata/serialnumbers`); None: all, so that every image is an observation itself."""
APART = 5.0
"""Pixels by which poses of one flight may differ from image to image, where their tables overlap."""
COMPARED = 16
"""Times at which they are compared."""


def observation_number(serial: str) -> str:
    """Return the observation of an image by its serial number; an error where no rule is known."""
    count = next((count for begin, count in _KEYWORDS.items() if re.match(begin, serial)), 0)
    if count == 0:
        raise InputError(
            f"OBSERVATIONS=yes: of which observation the image {quoted(serial)} is, no rule is known here"
        )
    return serial if count is None else "/".join(serial.split("/")[:count])


def observations_of(serials: Sequence[str], *, shared: bool) -> dict[str, list[str]]:
    """Return the images of each observation by its number: where none is shared, every image by itself."""
    found: dict[str, list[str]] = {}
    for serial in serials:
        found.setdefault(observation_number(serial) if shared else serial, []).append(serial)
    return found


def one_flight(isds: Sequence[Isd]) -> Isd:
    """Return the support data of the first of several images with the tables of all, which have to agree."""
    first, *others = isds
    for each in others:
        _check(first, each)
    positions = [each.position for each in isds]
    times, rows = _once([each.times for each in positions])
    speeds = [each.velocities for each in positions if each.velocities is not None]
    return replace(
        first,
        position=Positions(
            times,
            np.concatenate([each.places for each in positions])[rows],
            np.concatenate(speeds)[rows] if len(speeds) == len(isds) else None,
            first.position.interpolation,
        ),
        pointing=_joined([each.pointing for each in isds]),
        body=_joined([each.body for each in isds]),
    )


def _once(times: Sequence[Floats]) -> tuple[Floats, Indices]:
    """Return the different times of tables, ascending, and which record of all has each first."""
    own, rows = np.unique(np.concatenate(times), return_index=True)
    return own, rows


def _joined(tables: Sequence[Turns]) -> Turns:
    """Return one table of all records, one of each time."""
    times, rows = _once([each.times for each in tables])
    return Turns(times, np.concatenate([each.matrices for each in tables])[rows], tables[0].interpolation)


def _check(first: Isd, other: Isd) -> None:
    """Refuse an image whose tables say another place or attitude at the times of the first."""
    one, two = (trajectory_of(each, "flight", interpolation="isis") for each in (first, other))
    begin, end = max(one.reach[0], two.reach[0]), min(one.reach[1], two.reach[1])
    if not begin < end:
        return
    # Of single records all times are alike.
    times = np.linspace(begin, end, COMPARED) if np.isfinite(end - begin) else np.array([first.time])
    (places, axes), (others, turned) = (given_poses(each, times) for each in (one, two))
    (x, y), _ = first.detector.planes["isis"].matrix.T
    pixel = float(np.hypot(x, y)) / abs(first.focal_length)
    heights = np.linalg.norm(places, axis=1) - max(first.radii)
    shift = float((np.linalg.norm(places - others, axis=1) / heights).max()) / pixel
    turn = float(np.linalg.norm(axes - turned, axis=(1, 2)).max()) / np.sqrt(2.0) / pixel
    if not max(shift, turn) < APART:
        raise InputError(
            f"is of one observation with {first.path}, but its tables are not of the same flight: places are"
            f" {shift:.3g} pixels apart, attitudes {turn:.3g}",
            file=other.path,
        )
