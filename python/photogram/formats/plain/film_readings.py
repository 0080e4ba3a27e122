"""Fiducial readings: their marks, the scanned side of films, and mistakes in pitch, side or names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import ContradictionError, InputError, message_of
from photogram.film.interior import conformal, film_side, is_mirrored, true_places
from photogram.film.marks import DECIDED, which_mark
from photogram.formats.plain.film_tables import FilmKind, Machine
from photogram.formats.plain.photos import Photos
from photogram.formats.plain.schema import deviation_columns
from photogram.formats.plain.tables import Tables, indices_of
from photogram.io.column_table import ColumnTable
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.network.films import Mark
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film import Certificate


BETTER = 4.0  # Smallest ratio of distances between any other placement and the best one
NEAR = 0.1  # Largest distance in the best placement, relative to the format; poses and points are approximate
TIES = 4  # Smallest number of common points of two photos


@dataclass
class ScannedPhoto:
    """A photo on film: its row in the table of photos, its images, and readings of its marks."""

    name: str
    row: int
    camera: str
    kind: FilmKind  # Of its film
    machine: Machine
    fiducials: Mapping[str, Mark]  # Marks of its camera by name
    given_side: bool | None  # Whether the table marks the photo as mirrored; None: unknown
    images: Floats  # (m, 2) readings of its images
    image_sd: Floats  # (m,) the larger standard deviation of each reading
    points: Indices  # (m,) points of its images
    coordinates: Floats  # (m, 3) of these points, at least approximate; NaN where unknown
    pose: tuple[Floats, Floats, float]  # Centre, axes (columns) and principal distance; NaN if unknown
    marks: list[str] = field(default_factory=list)
    readings: list[Floats] = field(default_factory=list)
    sd: list[Floats] = field(default_factory=list)
    mirrored: bool = False
    start: Floats | None = None  # Initial values of t1, t2 and theta, from the table or its marks

    @property
    def true(self) -> Floats:
        """(n, 2) true scanner positions of its marks."""
        return self._true_places(np.array(self.readings))

    def _true_places(self, readings: Floats) -> Floats:
        own = self.machine
        return true_places(readings.reshape(-1, 2), own.readings, own.scanner, own.curves)

    @property
    def places(self) -> Floats:
        """(n, 2) positions of its marks in the camera frame."""
        return _positions(self.fiducials[name] for name in self.marks)

    def in_camera(self, places: Floats, *, mirrored: bool) -> Floats:
        """Return (m,) complex image positions in the camera frame by marks at (n, 2) positions."""
        t1, t2, theta, m = conformal(places, self.true, mirrored=mirrored)
        p = self._true_places(self.images) @ np.array([1.0, 1j])
        q = (p - (t1 + 1j * t2)) / ((1.0 + m) * np.exp(1j * theta))
        return np.asarray(-np.conj(q) if mirrored else q)

    def way_by_images(
        self, ways: Sequence[tuple[Floats, bool]], photos: Sequence[ScannedPhoto]
    ) -> int | None:
        """Return the placement that fits images of known points or tie points; None if not unique.

        Placements are positions of marks in the camera frame, and the side.
        """
        images = [self.in_camera(places, mirrored=mirrored) for places, mirrored in ways]
        for rows, expected, freedom in self._expected(photos):
            if len(rows) < 2:
                continue
            apart = [_apart(q[rows], expected, freedom) for q in images]
            order = np.argsort(apart)
            best = apart[order[0]]
            near = best <= NEAR * float(np.ptp(ways[0][0], axis=0).max())
            if near and (len(ways) == 1 or apart[order[1]] > BETTER * best):
                return int(order[0])
        return None

    def _expected(self, photos: Sequence[ScannedPhoto]) -> Iterator[tuple[Indices, Floats, str]]:
        """Yield rows of images, expected positions (complex, mm), and the unknown transformation.

        They follow from the pose, and from tie points of a photo whose film is placed.
        """
        centre, axes, c = self.pose
        places = _projected((self.coordinates - centre) @ axes, c)
        known = np.flatnonzero(np.isfinite(places))
        yield known, places[known], "none"
        ties = [(len(np.intersect1d(self.points, each.points)), each) for each in photos if each is not self]
        for count, other in sorted(ties, key=lambda tie: -tie[0]):
            if count < TIES or len(other.marks) < 2 or not all(other.marks):
                continue
            side = other.given_side
            if side is None and (side := is_mirrored(other.places, other.true)) is None:
                continue
            _, rows, there = np.intersect1d(self.points, other.points, return_indices=True)
            q = other.in_camera(other.places, mirrored=side)[there]
            _, turned, distance = other.pose
            rays = np.column_stack([q.real, q.imag, np.full(len(q), distance)])
            places = _projected(rays @ turned.T @ axes, c)
            yield (rows, places, "shift") if np.isfinite(places).all() else (rows, q, "rotation")
            return


def _positions(marks: Iterable[Mark]) -> Floats:
    return np.array([mark.position[:2] for mark in marks]).reshape(-1, 2)


def _apart(q: Floats, expected: Floats, freedom: str) -> float:
    """Return the root mean square distance of images from expectation.

    It ignores a translation and scale (`shift`), or these and a rotation (`rotation`).
    """
    left = q - expected
    if freedom != "none":
        own, other = q - q.mean(), expected - expected.mean()
        turned = np.vdot(other, own)
        by = turned if freedom == "rotation" else np.linalg.norm(own) * np.linalg.norm(other)
        left = own - by / np.vdot(other, other) * other
    return float(np.sqrt(np.mean(np.abs(left) ** 2)))


def _projected(rays: Floats, c: float) -> Floats:
    """Return (m,) complex positions of rays (m, 3) in the camera frame."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(c * (rays[:, 0] + 1j * rays[:, 1]) / rays[:, 2])


def read_marks(tables: Tables, photos: Photos, scanned: Sequence[ScannedPhoto]) -> None:
    """Add the readings of marks to scanned photos, with names by position if the table has none."""
    table = tables.rows("fiducial_images")
    names = ("column", "row") if "column" in table else ("x", "y")
    xy, own = table.given(names), deviation_columns(names)
    sd = tables.deviations(table, "fiducial_images", own)
    table.check_given(sd, own, "fiducial_images")
    known = [*photos.names, *photos.unused]
    of = indices_of(table, "photo", {name: row for row, name in enumerate(known)}, "photo").tolist()
    by_name = {each.name: each for each in scanned}
    use, marks = table.flags("use"), table.texts("fiducial")
    for row, place in enumerate(of):
        name, mark = known[place], marks[row]
        if not use[row] or name in photos.unused:
            continue
        if name not in by_name:
            raise table.error(row, phrase("plain.photo-without-film", photo=name))
        photo = by_name[name]
        if mark and mark not in photo.fiducials:
            raise table.unknown_error(row, "fiducial", f"fiducial of {photo.camera}", mark, photo.fiducials)
        if mark and mark in photo.marks:
            raise table.error(row, phrase("error.repeated", kind=f"fiducial of {name}", name=mark))
        photo.marks.append(mark)
        photo.readings.append(xy[row])
        photo.sd.append(sd[row])
    waiting = [photo for photo in scanned if not all(photo.marks)]
    for photo in waiting:
        if any(photo.marks):
            raise table.head.error(phrase("plain.some-fiducials", photo=photo.name))
    while waiting:
        # Films that depend on the tie points of others are placed last.
        errors = [(photo, _name_marks(tables, photo, scanned)) for photo in waiting]
        left = [photo for photo, error in errors if error is not None]
        if len(left) == len(waiting) and errors[0][1] is not None:
            raise errors[0][1]
        waiting = left


def _name_marks(tables: Tables, photo: ScannedPhoto, photos: Sequence[ScannedPhoto]) -> InputError | None:
    """Identify the marks of a photo; return an error if ambiguous."""
    head, names = tables.rows("fiducial_images").head, list(photo.fiducials)
    places = _positions(photo.fiducials.values())
    with at_place(head, f"photo {photo.name}"):
        found = which_mark(places, photo.true)
    ways = [each for each in found.alike if photo.given_side in (None, each.mirrored)]
    if len(ways) != 1:
        chosen = photo.way_by_images([(places[way.marks], way.mirrored) for way in ways], photos)
        if chosen is None:
            return head.error(phrase("plain.film-pose", photo=photo.name, reason=str(found)))
        ways = [ways[chosen]]
    photo.marks[:] = [names[k] for k in ways[0].marks.tolist()]
    tables.remark("plain.film-lies", head.file, photo=photo.name, way=str(ways[0]))
    return None


def side_of(tables: Tables, table: ColumnTable, photo: ScannedPhoto, photos: Sequence[ScannedPhoto]) -> bool:
    """Return whether a photo is mirrored: given, by marks, or by images."""
    q = photo.places
    try:
        side = film_side(q, photo.true if len(q) else q, photo.given_side)
    except ContradictionError as error:
        message = phrase("error.at", what=f"photo {photo.name}", message=message_of(error))
        raise ContradictionError.of(table.error(photo.row, message)) from None
    if side is None and len(q) > 1:
        chosen = photo.way_by_images([(q, False), (q, True)], photos)
        side = None if chosen is None else bool(chosen)
    if side is None:
        tables.remark("plain.side-unknown", photo=photo.name)
    return bool(side)


SHRUNK = 0.01  # Largest change of film size, relative
INCH = 25.4  # Millimetres
SAME = 0.5  # Largest difference (pixels) of the marks of all photos of a resampled scan
SHORTEST = 4  # Smallest number of angles of a distortion table with a curve
FEWEST = 4  # Smallest number of marks that detects names rotated by a quarter


def scale_message(photo: ScannedPhoto) -> Phrase | None:
    """Return an error of the scanner pitch."""
    if len(photo.marks) < 2:
        return None
    *_, m = conformal(photo.places, photo.true, mirrored=photo.mirrored)
    if abs(m) <= SHRUNK or m <= -1.0:
        return None
    pitch = photo.machine.readings.pitch
    meant = pitch / (1.0 + m)
    fields = {"photo": photo.name, "factor": 1.0 + m, "meant": meant, "pitch": pitch}
    return phrase("plain.scale-of-scan", dpi=round(INCH / meant, -1), **fields)


def beyond_message(camera: Camera, own: Certificate, photos: Sequence[ScannedPhoto]) -> Phrase | None:
    """Return a remark on images of a camera beyond a distortion table with an inaccurate curve."""
    if own.radial is None or own.c is None or len(own.radial.angle) < SHORTEST:
        return None
    if camera.parameters != own.camera(camera.model).parameters:  # type: ignore[arg-type]
        return None
    photos = [photo for photo in photos if photo.camera == camera.name and len(photo.marks) > 1]
    places = [photo.in_camera(photo.places, mirrored=photo.mirrored) for photo in photos]
    point = complex(camera.parameters["xp"], camera.parameters["yp"])
    radius = np.abs(np.concatenate([np.zeros(0), *places]) - point)
    sd = np.concatenate([np.zeros(0), *(photo.machine.readings.pitch * photo.image_sd for photo in photos)])
    last, curve = own.c * float(np.tan(own.radial.angle.max())), own.curve()
    beyond = radius[(radius > last) & (curve.sd_at(radius) > sd)]
    if not len(beyond):
        return None
    farthest = beyond.max(keepdims=True)
    sd_um = 1e3 * float(curve.sd_at(farthest)[0])
    fields = {"camera": camera.name, "n": len(beyond), "all": len(radius), "last": last, "sd_um": sd_um}
    return phrase("plain.beyond-distortion", farthest=float(farthest[0]), **fields)


def mark_remarks(photos: Sequence[ScannedPhoto], mirrored: Sequence[str]) -> list[Phrase]:
    """Return remarks on marks, and photos that they show as mirrored, that are probably mistakes."""
    said: list[Phrase] = []
    if len(mirrored) > max(1.0, len(photos) / 2):
        said.append(phrase("plain.mirrored-photos", n=len(mirrored), all=len(photos)))
    elif mirrored:
        said.append(phrase("plain.mirrored-films", names=mirrored))
    readings: dict[tuple[str, str], list[Floats]] = {}
    pixels = [photo for photo in photos if photo.machine.readings.pitch != 1.0]
    for photo in pixels:
        for mark, reading in zip(photo.marks, photo.readings, strict=True):
            readings.setdefault((photo.camera, mark), []).append(reading)
    several = [np.ptp(each, axis=0).max() for each in readings.values() if len(each) > 1]
    # Marks of all photos are at the same pixels if the scans were resampled to them.
    if len(pixels) > 2 and len(several) > 1 and max(several) <= SAME:
        said.append(phrase("plain.resampled"))
    return said + list(_round(photos))


def _round(photos: Sequence[ScannedPhoto]) -> Iterator[Phrase]:
    """Yield remarks on marks that fit better with names rotated by a quarter."""
    sums: dict[str, Floats] = {}
    counts: dict[str, int] = {}
    for photo in photos:
        if len(photo.marks) < FEWEST:
            continue
        names = list(photo.fiducials)
        try:
            found = which_mark(_positions(photo.fiducials.values()), photo.true)
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
