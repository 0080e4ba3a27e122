"""Assignment of fiducial readings to marks, and the scanned side of films."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import ContradictionError, InputError, message_of
from photogram.film.interior import conformal, is_mirrored, mirror_message, side_residuals, true_places
from photogram.film.marks import which_mark
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.photos import Images, Photos
from photogram.formats.plain.scanners import Machine
from photogram.formats.plain.tables import Tables, indices_of
from photogram.io.column_table import FALSE, TRUE, ColumnTable
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase

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
class Laid:
    """A placed film, with true scanner positions of marks and images."""

    way: Lying
    marks: Floats
    images: Floats

    def places(self) -> Floats:
        """Return (m,) complex positions of its images in the camera frame."""
        return self.way.back(self.marks, self.images)


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

    def expected(self, photo: str, laid: Callable[[str], Laid | None]) -> Iterator[Expected]:
        """Yield expected image positions: from pose, and from tie points."""
        own = self.images.points[self._rows(photo)]
        centre, axes, c = self._pose(photo)
        places = _projected((self.points[own] - centre) @ axes, c)
        known = np.flatnonzero(np.isfinite(places))
        yield Expected(known, places[known])
        found = ((other, lies) for other in self._neighbours(photo, own) if (lies := laid(other)) is not None)
        other, lies = next(found, (None, None))
        if other is None or lies is None:
            return
        theirs = self.images.points[self._rows(other)]
        rows, there = (
            np.array([np.flatnonzero(each == point)[0] for point in np.intersect1d(own, theirs)])
            for each in (own, theirs)
        )
        q = lies.places()[there]
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
        try:
            found = which_mark(np.array(list(places.values())).reshape(-1, 2), photo.true)
        except InputError as error:
            message = phrase("error.at", what=f"photo {photo.name}", message=message_of(error))
            raise table.head.error(message) from None
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
            way_by_images(ways, true, images, each) for each in self.seen.expected(photo.name, self._laid)
        )
        return next((each for each in found if each is not None), None)

    def _laid(self, name: str) -> Laid | None:
        """Return the placement of a film if its marks or the given side determine it."""
        photo = next((each for each in self.photos if each.name == name), None)
        if photo is None or len(photo.marks) < 2 or not all(photo.marks):
            return None
        q, true = self.places_of(photo), photo.true
        side = self.given_side(photo)
        side = is_mirrored(q, true) if side is None else side
        if side is None:
            return None
        return Laid(Lying(q, side), true, photo.true_places(self.seen.readings(photo.name)))

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
