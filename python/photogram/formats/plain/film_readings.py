"""Fiducial readings: their marks, the scanned side of films, and mistakes in pitch, side or names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import ContradictionError, InputError
from photogram.film.interior import conformal, is_mirrored, mirror_message, side_residuals, true_places
from photogram.film.marks import DECIDED, which_mark
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.photos import Images, Photos
from photogram.formats.plain.scanners import Machine
from photogram.formats.plain.tables import Tables, indices_of
from photogram.io.column_table import FALSE, TRUE, ColumnTable
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film import Certificate


BETTER = 4.0  # Smallest ratio of distances between any other placement and the best one
NEAR = 0.1  # Largest distance in the best placement, relative to the format; poses and points are approximate
TIES = 4  # Smallest number of common points of two photos


@dataclass(frozen=True)
class Lying:
    """A placement of a film: positions of marks in the camera frame, and side."""

    places: Floats
    mirrored: bool

    def back(self, true: Floats, images: Floats) -> Floats:
        """Transform images to (m,) complex camera coordinates."""
        t1, t2, theta, m = conformal(self.places, true, mirrored=self.mirrored)
        q = (images @ np.array([1.0, 1j]) - (t1 + 1j * t2)) / ((1.0 + m) * np.exp(1j * theta))
        return np.asarray(-np.conj(q) if self.mirrored else q)


@dataclass(frozen=True)
class Expected:
    """Expected positions of images of a photo in the camera frame."""

    rows: np.ndarray  # (m,) rows of the image observations of the photo
    places: Floats  # (m,) complex, mm
    # Unknown transformation: none, translation and scale, or these and a rotation
    but: Literal["nothing", "shift", "rotation"] = "nothing"

    def apart(self, q: Floats) -> float:
        """Return the root mean square distance of images from expectation."""
        left = q - self.places
        if self.but != "nothing":
            own, other = q - q.mean(), self.places - self.places.mean()
            turned = np.vdot(other, own)
            by = turned if self.but == "rotation" else np.linalg.norm(own) * np.linalg.norm(other)
            left = own - by / np.vdot(other, other) * other
        return float(np.sqrt(np.mean(np.abs(left) ** 2)))


@dataclass(frozen=True)
class Seen:
    """Image observations, and points with at least approximate coordinates."""

    images: Images
    points: Floats  # (n, 3) coordinates; NaN where unknown
    photos: Photos
    cameras: Cameras

    def readings(self, photo: str) -> Floats:
        """Return (m, 2) readings of a photo."""
        found: Floats = self.images.xy[self._rows(photo)]
        return found

    def deviations(self, photo: str) -> Floats:
        """Return (m,) the larger standard deviation of each reading; 1 if unknown."""
        rows, sd = self._rows(photo), self.images.sd
        found: Floats = np.ones(len(rows)) if sd is None else sd[rows].max(axis=1)
        return found

    def expected(self, photo: str, placed: Callable[[str], Floats | None]) -> Iterator[Expected]:
        """Yield expected image positions: from pose, and from tie points of a photo whose film is placed."""
        own = self.images.points[self._rows(photo)]
        centre, axes, c = self._pose(photo)
        places = _projected((self.points[own] - centre) @ axes, c)
        known = np.flatnonzero(np.isfinite(places))
        yield Expected(known, places[known])
        found = ((other, q) for other in self._neighbours(photo, own) if (q := placed(other)) is not None)
        other, film = next(found, (None, None))
        if other is None or film is None:
            return
        theirs = self.images.points[self._rows(other)]
        rows, there = (
            np.array([np.flatnonzero(each == point)[0] for point in np.intersect1d(own, theirs)])
            for each in (own, theirs)
        )
        q = film[there]
        _, turned, distance = self._pose(other)
        rays = np.column_stack([q.real, q.imag, np.full(len(q), distance)])
        places = _projected(rays @ turned.T @ axes, c)
        if np.isfinite(places).all():
            yield Expected(rows, places, "shift")
        else:
            yield Expected(rows, q, "rotation")

    def _neighbours(self, photo: str, points: np.ndarray) -> list[str]:
        """Return other photos with enough of some points, in descending order of number."""
        images = np.unique(
            np.column_stack([self.images.photos, self.images.points])[np.isin(self.images.points, points)],
            axis=0,
        )
        counts = np.bincount(images[:, 0], minlength=len(self.photos.names))
        order = np.argsort(-counts, kind="stable")
        names = [self.photos.names[row] for row in order.tolist() if counts[row] >= TIES]
        return [name for name in names if name != photo]

    def _rows(self, photo: str) -> np.ndarray:
        return np.flatnonzero(self.images.photos == self.photos.names.index(photo))

    def _pose(self, photo: str) -> tuple[Floats, Floats, float]:
        """Return centre, axes (columns) and principal distance; NaN if unknown."""
        row = self.photos.names.index(photo)
        c = -abs(self.cameras.cameras[self.photos.cameras[row]].parameters.get("c", np.nan))
        centres, matrices = np.asarray(self.photos.centres), np.asarray(self.photos.matrices)
        return centres[row], matrices[row], c


def _projected(rays: Floats, c: float) -> Floats:
    """Return (m,) complex positions of rays (m, 3) in the camera frame."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(c * (rays[:, 0] + 1j * rays[:, 1]) / rays[:, 2])


def way_by_images(ways: Sequence[Lying], true: Floats, images: Floats, expected: Expected) -> int | None:
    """Return the placement that fits expected positions; None if not unique.

    `true` are (n, 2) true positions of the marks on the scanner, `images` (m, 2) of all images of the photo.
    """
    if len(expected.rows) < 2:
        return None
    apart = [expected.apart(way.back(true, images[expected.rows])) for way in ways]
    order = np.argsort(apart)
    best = apart[order[0]]
    if best > NEAR * float(np.ptp(ways[0].places, axis=0).max()):
        return None
    return int(order[0]) if len(ways) == 1 or apart[order[1]] > BETTER * best else None


@dataclass
class ScannedPhoto:
    """A photo on film: its row in the table of photos, and readings of its marks."""

    name: str
    row: int
    camera: str
    film: str
    machine: Machine
    marks: list[str] = field(default_factory=list)
    readings: list[Floats] = field(default_factory=list)
    sd: list[Floats] = field(default_factory=list)

    @property
    def true(self) -> Floats:
        """(n, 2) true scanner positions of its marks."""
        return self.true_places(np.array(self.readings))

    def true_places(self, readings: Floats) -> Floats:
        """Return (m, 2) true scanner positions of readings."""
        own = self.machine
        return true_places(readings.reshape(-1, 2), own.readings, own.scanner, own.curves)


@dataclass(frozen=True)
class MarkReadings:
    """The readings of the marks of scanned photos."""

    tables: Tables
    seen: Seen  # The image observations of all photos
    photos: Sequence[ScannedPhoto]  # Scanned photos, which receive their readings
    # (2,) of marks in camera frames, by camera name and mark name
    places: Mapping[str, Mapping[str, Floats]]

    def read(self, photos: Photos) -> None:
        """Read the readings of marks."""
        table = self.tables.rows("fiducial_images")
        names = ("column", "row") if "column" in table else ("x", "y")
        xy = table.given(names)
        own = ["sd_column", "sd_row"] if "column" in table else ["sd_x", "sd_y"]
        sd = self.tables.deviations(table, "fiducial_images", own)
        table.check_given(sd, own, "fiducial_images")
        known = {name: row for row, name in enumerate([*photos.names, *photos.unused])}
        listed_photos = list(known)
        of = indices_of(table, "photo", known, "photo").tolist()
        by_name = {each.name: each for each in self.photos}
        use, marks = table.flags("use"), table.texts("fiducial")
        for row, place in enumerate(of):
            name = listed_photos[place]
            if not use[row] or name in photos.unused:
                continue
            if name not in by_name:
                raise table.error(row, phrase("plain.photo-without-film", photo=name))
            photo = by_name[name]
            if marks[row] and marks[row] not in self.places.get(photo.camera, {}):
                fiducials = self.places.get(photo.camera, {})
                raise table.unknown_error(
                    row, "fiducial", f"fiducial of {photo.camera}", marks[row], fiducials
                )
            if marks[row] and marks[row] in photo.marks:
                raise table.error(row, phrase("error.repeated", kind=f"fiducial of {name}", name=marks[row]))
            photo.marks.append(marks[row])
            photo.readings.append(xy[row])
            photo.sd.append(sd[row])
        self._name_marks(table)

    def _name_marks(self, table: ColumnTable) -> None:
        """Identify marks of unnamed readings, dependent photos last."""
        waiting = [photo for photo in self.photos if not all(photo.marks)]
        for photo in waiting:
            if any(photo.marks):
                raise table.head.error(phrase("plain.some-fiducials", photo=photo.name))
        while waiting:
            errors = [(photo, self._named(table, photo)) for photo in waiting]
            left = [photo for photo, error in errors if error is not None]
            if len(left) == len(waiting) and errors[0][1] is not None:
                raise errors[0][1]
            waiting = left

    def _named(self, table: ColumnTable, photo: ScannedPhoto) -> InputError | None:
        """Identify the marks of a photo; return an error if ambiguous."""
        places = self.places.get(photo.camera, {})
        with at_place(table.head, f"photo {photo.name}"):
            found = which_mark(np.array(list(places.values())).reshape(-1, 2), photo.true)
        given = self.given_side(photo)
        ways = [each for each in found.alike if given in (None, each.mirrored)]
        if len(ways) != 1:
            lying = [Lying(np.array([*places.values()])[way.marks], way.mirrored) for way in ways]
            chosen = self._by_images(photo, lying)
            if chosen is None:
                return table.head.error(phrase("plain.film-pose", photo=photo.name, reason=str(found)))
            ways = [ways[chosen]]
        photo.marks[:] = [list(places)[k] for k in ways[0].marks.tolist()]
        self.tables.remark("plain.film-lies", table.path, photo=photo.name, way=str(ways[0]))
        return None

    def _by_images(self, photo: ScannedPhoto, ways: Sequence[Lying]) -> int | None:
        """Return the placement index of a film from known points or tie points."""
        images, true = photo.true_places(self.seen.readings(photo.name)), photo.true
        found = (
            way_by_images(ways, true, images, each)
            for each in self.seen.expected(photo.name, self._places_of_images)
        )
        return next((each for each in found if each is not None), None)

    def _places_of_images(self, name: str) -> Floats | None:
        """Return (m,) complex image positions in the camera frame, if marks or side define the placement."""
        photo = next((each for each in self.photos if each.name == name), None)
        if photo is None or len(photo.marks) < 2 or not all(photo.marks):
            return None
        q, true = self.places_of(photo), photo.true
        side = self.given_side(photo)
        side = is_mirrored(q, true) if side is None else side
        if side is None:
            return None
        return Lying(q, side).back(true, photo.true_places(self.seen.readings(photo.name)))

    def places_of(self, photo: ScannedPhoto) -> Floats:
        """Return (n, 2) positions of the marks of a photo in the camera frame."""
        return np.array([self.places[photo.camera][name] for name in photo.marks]).reshape(-1, 2)

    @cached_property
    def _sides(self) -> list[str]:
        return self.seen.photos.table.texts("mirrored")

    def given_side(self, photo: ScannedPhoto) -> bool | None:
        """Return whether the table marks a photo as mirrored; None: unknown."""
        word = self._sides[photo.row].lower()
        if word and word not in TRUE | FALSE:
            raise self.seen.photos.table.cell_error(photo.row, "mirrored", "error.flag", value=word)
        return None if not word else word in TRUE

    def side(self, photo: ScannedPhoto) -> bool:
        """Return whether a photo is mirrored: given, by marks, or by images."""
        given = self.given_side(photo)
        q = self.places_of(photo)
        true = photo.true if len(q) else q
        found = is_mirrored(q, true)
        if given is not None and found is not None and found != given:
            sides = mirror_message(given, side_residuals(q, true))
            message = phrase("error.at", what=f"photo {photo.name}", message=sides)
            raise ContradictionError.of(self.seen.photos.table.error(photo.row, message))
        if found is None and given is None and len(q) > 1:
            chosen = self._by_images(photo, [Lying(q, False), Lying(q, True)])
            found = None if chosen is None else bool(chosen)
        if given is None and found is None:
            self.tables.remark("plain.side-unknown", photo=photo.name)
        return bool(found if given is None else given)


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
