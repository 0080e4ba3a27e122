"""A file with the positions of photos: tables, geo.txt, .MRK files of DJI, events of RTKLIB."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path, PurePosixPath

import numpy as np

from photogram.arguments.arrays import natural_order
from photogram.errors import InputError
from photogram.formats.cards import filled_lines
from photogram.formats.control_lists import SYSTEMS
from photogram.formats.metadata.merged import Metadata, metadata_of
from photogram.formats.metadata.mrk import number_of, read_exposures
from photogram.formats.metadata.pictures import ENDINGS, time_of_picture
from photogram.formats.metadata.record import Said
from photogram.formats.metadata.reference import is_reference, read_geo_txt, read_reference
from photogram.formats.metadata.rtklib import Event, is_events, read_events
from photogram.formats.metadata.search import EXPOSURES, files_of
from photogram.messages import Message, counted, listed

MAX_INTERVAL_DIFFERENCE = 2.0
"""Seconds between two pictures by their EXIF, which has whole seconds, and by the events."""


def read_gnss_file(
    path: Path, photos: Sequence[str], directory: Path | None = None, *, mrk_antenna: bool = False
) -> Metadata:
    """Read the positions of a file by the names of photos.

    `directory`: folder of all photographs; None: those of the project are all. Events belong to photos in
    their order; `mrk_antenna`: whether positions of .MRK files are antenna positions.
    """
    messages: list[Message] = []
    first = next((place.text or "" for place in filled_lines(path)), "").strip()
    if path.suffix.lower() == EXPOSURES:
        said = _of_exposures(path, photos, messages, antenna=mrk_antenna)
    elif is_events(path):
        said = _of_events(path, photos, directory)
    elif first.upper().startswith(SYSTEMS):
        said = read_geo_txt(path)
    elif is_reference(path):
        said = read_reference(path, messages)
    else:
        raise InputError(
            "has no positions of photos; required are columns photo, x, y, z (or latitude, longitude,"
            " height), a geolocation file of Pix4D, a reference of Metashape, geo.txt, .MRK, or events of"
            " RTKLIB; each photo has one row",
            file=path,
        )
    flights = dict.fromkeys(said, path.stem)
    return metadata_of(path, {name: [one] for name, one in said.items()}, flights, [path], [], messages)


def _of_exposures(
    path: Path, photos: Sequence[str], messages: list[Message], *, antenna: bool
) -> Mapping[str, Said]:
    """Return exposures of an .MRK file by the photos whose names contain their numbers."""
    exposures = read_exposures(path)
    if not exposures:
        raise InputError("has no exposures; DJI writes one row for each photo of a flight", file=path)
    names: dict[int, str] = {}
    for photo in photos:
        number = number_of(PurePosixPath(photo).stem)
        if number is None or number not in exposures:
            continue
        if number in names:
            raise InputError(
                f"the exposure {number} belongs to {names[number]} and to {photo}; each flight needs a folder"
                " of its own (--photos-dir)",
                file=path,
            )
        names[number] = photo
    if not names:
        raise InputError(
            f"has the exposures {listed([str(number) for number in exposures], 3)}; names of photos must"
            f" contain four digits with the number of the exposure, got {listed(list(photos), 3)}",
            file=path,
        )
    if left := len(exposures) - len(names):
        messages.append(Message(f"{left} of {counted(len(exposures), 'exposure')} have no photo here", path))
    return {photo: exposures[number].said(antenna) for number, photo in names.items()}


def _of_events(path: Path, photos: Sequence[str], directory: Path | None) -> Mapping[str, Said]:
    """Return events by photos: both in order of time, or photos in order of their names."""
    events = read_events(path)
    names, times = _in_order(photos, directory)
    if len(names) != len(events):
        source = "the project" if directory is None else f"the folder {directory.name}"
        raise InputError(
            f"has {counted(len(events), 'event')}, and {source} has {counted(len(names), 'photo')}; events"
            " belong to photos in their order, and both numbers must be equal: --photos-dir DIR names the"
            " folder of all photographs, or a table photo, latitude, longitude, height names each photo",
            file=path,
        )
    if times:
        _check_intervals(path, events, names, times)
    return {name: event.said for name, event in zip(names, events, strict=True)}


def _in_order(photos: Sequence[str], directory: Path | None) -> tuple[list[str], list[float]]:
    """Return photos in the order of their exposures, and their times in seconds; none without EXIF."""
    if directory is None:
        return sorted(photos, key=natural_order), []
    pictures = {
        path.relative_to(directory).as_posix(): path
        for path in files_of(directory)
        if path.suffix.lower() in ENDINGS
    }
    names = sorted(pictures, key=natural_order)
    times = [time_of_picture(pictures[name]) for name in names]
    known = [time for time in times if time is not None]
    if len(known) < len(times):
        return names, []
    order = np.argsort(known, kind="stable").tolist()
    return [names[row] for row in order], [known[row] for row in order]


def _check_intervals(
    path: Path, events: Sequence[Event], names: Sequence[str], times: Sequence[float]
) -> None:
    """Reject events whose intervals are not the intervals between the pictures."""
    for (first, second), (before, after), name in zip(
        pairwise(events), pairwise(times), names[1:], strict=True
    ):
        elapsed, taken = second.seconds - first.seconds, after - before
        if abs(elapsed - taken) > MAX_INTERVAL_DIFFERENCE:
            raise second.said.place.error(
                f"this event is {elapsed:.1f} s after the event before, and {name} was taken {taken:.1f} s"
                " after the photo before by its EXIF: remove the event without a photo, or the photo without"
                " an event"
            )
