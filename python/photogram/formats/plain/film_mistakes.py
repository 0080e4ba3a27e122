"""Mistakes in marks of films: pitch, side, names, resampled scans."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.interior import conformal
from photogram.film.marks import DECIDED, which_mark
from photogram.formats.plain.film_readings import ScannedPhoto
from photogram.network.cameras import Camera
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film import Certificate

SHRUNK = 0.01  # Largest change of film size, relative
INCH = 25.4  # Millimetres
SAME = 0.5  # Largest difference (pixels) of the marks of all photos of a resampled scan
SHORTEST = 4  # Smallest number of angles of a distortion table with a curve
FEWEST = 4  # Smallest number of marks that detects names rotated by a quarter


def scale_message(photo: ScannedPhoto, places: Floats, *, mirrored: bool) -> Phrase | None:
    """Return an error of the scanner pitch; `places` are (n, 2) camera marks."""
    if len(places) < 2:
        return None
    *_, m = conformal(places, photo.true, mirrored=mirrored)
    if abs(m) <= SHRUNK or m <= -1.0:
        return None
    pitch = photo.machine.readings.pitch
    meant = pitch / (1.0 + m)
    fields = {"photo": photo.name, "factor": 1.0 + m, "meant": meant, "pitch": pitch}
    return phrase("plain.scale-of-scan", dpi=round(INCH / meant, -1), **fields)


def beyond_message(camera: Camera, own: Certificate, places: Floats, sd: Floats) -> Phrase | None:
    """Return a remark on images beyond a distortion table with an inaccurate curve.

    `places` are (m,) complex, in the camera frame, and `sd` (m,) their standard deviations, mm.
    """
    if own.radial is None or own.c is None or len(own.radial.angle) < SHORTEST:
        return None
    if camera.parameters != own.camera(camera.model).parameters:  # type: ignore[arg-type]
        return None
    radius = np.abs(places - complex(camera.parameters["xp"], camera.parameters["yp"]))
    last, curve = own.c * float(np.tan(own.radial.angle.max())), own.curve()
    beyond = radius[(radius > last) & (curve.sd_at(radius) > sd)]
    if not len(beyond):
        return None
    farthest = beyond.max(keepdims=True)
    sd_um = 1e3 * float(curve.sd_at(farthest)[0])
    fields = {"camera": camera.name, "n": len(beyond), "all": len(places), "last": last, "sd_um": sd_um}
    return phrase("plain.beyond-distortion", farthest=float(farthest[0]), **fields)


def mark_remarks(
    photos: Sequence[ScannedPhoto], places: Mapping[str, Mapping[str, Floats]], found: Sequence[bool | None]
) -> list[Phrase]:
    """Return remarks on marks that are probably mistakes of the input."""
    said: list[Phrase] = []
    mirrored = [photo.name for photo, side in zip(photos, found, strict=True) if side]
    if len(mirrored) > max(1.0, len(photos) / 2):
        said.append(phrase("plain.mirrored-photos", n=len(mirrored), all=len(photos)))
    elif mirrored:
        said.append(phrase("plain.mirrored-films", names=mirrored))
    said += _resampled(photos)
    return said + list(_round(photos, places))


def _resampled(photos: Sequence[ScannedPhoto]) -> list[Phrase]:
    """Return a remark on resampled scans: marks of all photos are at the same pixels."""
    readings: dict[tuple[str, str], list[Floats]] = {}
    pixels = [photo for photo in photos if photo.machine.readings.pitch != 1.0]
    for photo in pixels:
        for mark, reading in zip(photo.marks, photo.readings, strict=True):
            readings.setdefault((photo.camera, mark), []).append(reading)
    several = [np.ptp(each, axis=0).max() for each in readings.values() if len(each) > 1]
    if len(pixels) < 3 or len(several) < 2 or max(several) > SAME:
        return []
    return [phrase("plain.resampled")]


def _round(photos: Sequence[ScannedPhoto], places: Mapping[str, Mapping[str, Floats]]) -> Iterator[Phrase]:
    """Yield remarks on marks that fit better with names rotated by a quarter."""
    sums: dict[str, Floats] = {}
    counts: dict[str, int] = {}
    for photo in photos:
        if len(photo.marks) < FEWEST:
            continue
        names = list(places[photo.camera])
        try:
            found = which_mark(np.array([*places[photo.camera].values()]), photo.true)
        except InputError:
            continue
        own = [names.index(mark) for mark in photo.marks]
        way = next((each for each in found.ways if each is not None and each.marks.tolist() == own), None)
        if way is None:
            continue
        # On a film scanned from the other side, the same names are in reverse order.
        turns = (way.quarter_turns + (-1 if way.mirrored else 1) * np.arange(4)) % 4
        sums[photo.camera] = sums.get(photo.camera, np.zeros(4)) + found.omega[4 * way.mirrored + turns]
        counts[photo.camera] = counts.get(photo.camera, 0) + 2 * len(own) - 6
    for camera, omega in sums.items():
        best = int(np.argmin(omega))
        if omega[0] - omega[best] > DECIDED * max(1.0, omega[best] / max(counts[camera], 1)):
            yield phrase("plain.turned-marks", camera=camera, degrees=90 * best)
