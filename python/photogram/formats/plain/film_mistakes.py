"""Mistakes that marks of films show before anything is adjusted: pitch, side, names, resampled scans."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.interior import conformal
from photogram.film.marks import DECIDED, which_mark
from photogram.formats.plain.film_readings import ScannedPhoto
from photogram.messages import listed
from photogram.network.cameras import Camera

if TYPE_CHECKING:
    from photogram.film import Certificate

SHRUNK = 0.01
"""No film has changed its size by more."""
INCH = 25.4
"""Millimetres."""
SAME = 0.5
"""Pixels within which the marks of all photos of a resampled scan lie."""
SHORTEST = 4
"""Angles of a table of distortion that has a curve."""
FEWEST = 4
"""Marks of a photo that tell whether they are named a quarter turn round."""


def scale_message(photo: ScannedPhoto, places: Floats, *, mirrored: bool) -> str:
    """Return an error of the pitch of a scanner; `places` are (n, 2) of the marks in the camera's frame."""
    if len(places) < 2:
        return ""
    *_, m = conformal(places, photo.true, mirrored=mirrored)
    if abs(m) <= SHRUNK or m <= -1.0:
        return ""
    pitch = photo.machine.readings.pitch
    meant = pitch / (1.0 + m)
    return (
        f"photo {photo.name}: its marks are {1.0 + m:.5g} times as far apart as they should be: pitch_mm"
        f" would be {meant:.5g} (about {round(INCH / meant, -1):.0f} dpi), not {pitch:.6g}; or they are those"
        " of another camera"
    )


def beyond_message(camera: Camera, own: Certificate, places: Floats, sd: Floats) -> str:
    """Return a remark on images beyond a table of distortion if the curve is less accurate than they are.

    `places` are (m,) complex, in the camera's frame, and `sd` (m,) their standard deviations, mm.
    """
    if own.radial is None or own.c is None or len(own.radial.angle) < SHORTEST:
        return ""
    if camera.parameters != own.camera(camera.model).parameters:  # type: ignore[arg-type]
        return ""
    radius = np.abs(places - complex(camera.parameters["xp"], camera.parameters["yp"]))
    last, curve = own.c * float(np.tan(own.radial.angle.max())), own.curve()
    beyond = radius[(radius > last) & (curve.sd_at(radius) > sd)]
    if not len(beyond):
        return ""
    farthest = beyond.max(keepdims=True)
    return (
        f"camera {camera.name}: {len(beyond)} of {len(places)} images lie beyond the table of distortion of"
        f" its certificate, which ends at {last:.0f} mm; at {farthest[0]:.0f} mm it is extrapolated, sd"
        f" {1e3 * float(curve.sd_at(farthest)[0]):.2g} um"
    )


def mark_remarks(
    photos: Sequence[ScannedPhoto], places: Mapping[str, Mapping[str, Floats]], found: Sequence[bool | None]
) -> list[str]:
    """Return sentences on what marks show that is hardly what was meant."""
    said = []
    mirrored = [photo.name for photo, side in zip(photos, found, strict=True) if side]
    if len(mirrored) > max(1.0, len(photos) / 2):
        said.append(
            f"{len(mirrored)} of {len(photos)} photos are mirrored, and nobody has said so: scanned from the"
            " other side, or negatives; or rows count the other way than rows_down of the scanner says"
        )
    elif mirrored:
        said.append(
            f"the film of {listed(mirrored, 5)} was seen from the other side, as marks or images show:"
            " mirrored is not said there"
        )
    said += _resampled(photos)
    return said + list(_round(photos, places))


def _resampled(photos: Sequence[ScannedPhoto]) -> list[str]:
    """Tell scans that were resampled: their marks lie at the same pixels."""
    readings: dict[tuple[str, str], list[Floats]] = {}
    pixels = [photo for photo in photos if photo.machine.readings.pitch != 1.0]
    for photo in pixels:
        for mark, reading in zip(photo.marks, photo.readings, strict=True):
            readings.setdefault((photo.camera, mark), []).append(reading)
    several = [np.ptp(each, axis=0).max() for each in readings.values() if len(each) > 1]
    if len(pixels) < 3 or len(several) < 2 or max(several) > SAME:
        return []
    return [
        "marks lie at the same pixels on all photos, as of scans that were resampled to their marks: such"
        " films have changed in nothing any more: sd_m, sd_photo_m, sd_b1 and sd_b2 are 0"
    ]


def _round(photos: Sequence[ScannedPhoto], places: Mapping[str, Mapping[str, Floats]]) -> Iterator[str]:
    """Tell cameras whose marks fit far better where all photos have them named a quarter turn round."""
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
        # The same names go the other way round on a film that is seen from the other side.
        turns = (way.quarter_turns + (-1 if way.mirrored else 1) * np.arange(4)) % 4
        sums[photo.camera] = sums.get(photo.camera, np.zeros(4)) + found.omega[4 * way.mirrored + turns]
        counts[photo.camera] = counts.get(photo.camera, 0) + 2 * len(own) - 6
    for camera, omega in sums.items():
        best = int(np.argmin(omega))
        if omega[0] - omega[best] > DECIDED * max(1.0, omega[best] / max(counts[camera], 1)):
            yield (
                f"camera {camera}: its marks fit far better if those of all photos are named {90 * best}"
                " degrees round: is data_strip of its certificate left or top, and are they named with the"
                " strip at the left?"
            )
