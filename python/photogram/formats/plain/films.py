"""Photos on film and plates: scanned photos, their marks, and prior information; read and written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import ContradictionError, InputError
from photogram.film.interior import (
    FilmModel,
    conformal,
    interior_orientation,
)
from photogram.formats.images import scaled_camera
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.certificates import marks_of, read_fiducials
from photogram.formats.plain.film_readings import (
    Lying,
    ScannedPhoto,
    beyond_message,
    mark_remarks,
    read_marks,
    scale_message,
    side_of,
)
from photogram.formats.plain.photos import Images, Photos
from photogram.formats.plain.scanners import (
    Machine,
    film_cells,
    machines_of,
    read_films,
    read_scanners,
    scanner_cells,
)
from photogram.formats.plain.schema import deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, columns_of_records, made, signs_in_files
from photogram.formats.plain.unknowns import Covariances
from photogram.formats.project import Project
from photogram.io.column_table import FALSE, TRUE
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.network.films import (
    Film,
    FilmBend,
    FilmPlacement,
    FilmSize,
    Readings,
    Reseau,
    Scan,
    Scanner,
)
from photogram.network.observations import FILM, Fiducial, KnownFilm, KnownTogether, Observation
from photogram.words import phrase

LEAST = {"conformal": 2, "affine": 3, "bilinear": 4, "projective": 4}  # Required marks of a film
_START = ("start_t1", "start_t2", "start_theta")
INSIDE = "films inside"
"""Key of a detail of a project with fixed films: the complete contents of their tables."""


@dataclass(frozen=True)
class Scanned:
    """Scanned photos with the transformations of their images and their observations."""

    photos: Bools  # (P,) whether photos are scanned
    scans: list[Scan] = field(default_factory=list)  # Transformations of image coordinates
    observations: list[Observation] = field(default_factory=list)
    # If films are fitted in advance: the complete scans and observations for the details of the project, from
    # which tables are written
    inside: dict[str, tuple[list[Scan], list[Observation]]] = field(default_factory=dict)


def read_scanned(
    tables: Tables, images: Images, points: Floats, photos: Photos, cameras: Cameras, covariances: Covariances
) -> Scanned:
    """Read which photos are scanned films or plates, and their films and marks.

    `points` are the (n, 3) coordinates of all points of the images; NaN where unknown.
    """
    films = photos.table.texts("film")
    scanned = np.array([bool(name) for name in films], dtype=bool)
    for table in ("fiducial_images", "fiducials", "films", "scanners"):
        if table in tables.settings.tables and not scanned.any():
            path = tables.settings.tables[table]
            raise InputError(phrase("plain.no-film", table=table), file=path)
    found = Scanned(scanned)
    if scanned.any():
        if tables.settings.image == "um":
            raise InputError(phrase("plain.film-unit"), file=tables.settings.path)
        reader = _Reader(tables, photos, cameras, covariances)
        reader.photos = reader.scanned_photos(images, points)
        read_marks(tables, photos, reader.photos)
        reader.read(found)
        if tables.settings.interior == "before":
            inside = {INSIDE: (found.scans, found.observations)}
            return Scanned(scanned, reader.fitted(found.scans), inside=inside)
    return found


class _Reader:
    def __init__(self, tables: Tables, photos: Photos, cameras: Cameras, covariances: Covariances) -> None:
        self.tables, self.table, self.covariances = tables, photos.table, covariances
        self.all_photos, self.cameras = photos, cameras
        self.machines = read_scanners(tables, covariances)
        self.films = photos.table.texts("film")
        self.kinds = read_films(tables, list(dict.fromkeys(filter(None, self.films))), tables.settings.film)
        self.fiducials = read_fiducials(tables, set(photos.taken), cameras.certificates)
        self.photos: list[ScannedPhoto] = []

    def scanned_photos(self, images: Images, points: Floats) -> list[ScannedPhoto]:
        """Return the photos on film with their images."""
        photos, table = self.all_photos, self.table
        comparator = Machine(Scanner("comparator", sd=0.0), (), Readings(), None)
        scanners, sides = table.texts("scanner"), table.texts("mirrored")
        sd = np.ones(len(images.xy)) if images.sd is None else images.sd.max(axis=1)
        places = {
            camera: {name: mark.position[:2] for name, mark in own.marks.items()}
            for camera, own in self.fiducials.items()
        }
        found = []
        for row, film in enumerate(self.films):
            if not film:
                continue
            name, side = scanners[row], sides[row].lower()
            if name not in self.machines and (name or len(self.machines) > 1):
                raise table.unknown_error(row, "scanner", "scanner", name, self.machines)
            machine = self.machines[name] if name else next(iter(self.machines.values()), comparator)
            if side and side not in TRUE | FALSE:
                raise table.cell_error(row, "mirrored", "error.flag", value=side)
            own = np.flatnonzero(images.photos == row)
            c = -abs(self.cameras.cameras[photos.cameras[row]].parameters.get("c", np.nan))
            found.append(
                ScannedPhoto(
                    photos.names[row],
                    row,
                    photos.taken[row],
                    film,
                    machine,
                    places.get(photos.taken[row], {}),
                    side in TRUE if side else None,
                    images.xy[own],
                    sd[own],
                    images.points[own],
                    points[images.points[own]],
                    (photos.centres[row], photos.matrices[row], c),
                )
            )
        return found

    def read(self, found: Scanned) -> None:
        """Add the scans and observations of all photos to the result."""
        self._place_films()
        cameras = {each.name: each for each in self.cameras.cameras}
        for camera, certificate in self.cameras.certificates.items():
            places, sd = [np.zeros(0, dtype=complex)], [np.zeros(0)]
            for photo in self.photos:
                if photo.camera == camera and len(photo.marks) > 1:
                    places.append(Lying(photo.places, photo.mirrored).back(photo.true, photo.true_images))
                    sd.append(photo.machine.readings.pitch * photo.image_sd)
            beyond = beyond_message(cameras[camera], certificate, np.concatenate(places), np.concatenate(sd))
            if beyond:
                self.tables.messages.append(Message(beyond, certificate.file))
        starts = [self._start(photo) for photo in self.photos]
        for photo, start in zip(self.photos, starts, strict=True):
            film = self._film(photo, start)
            found.scans.append(Scan(photo.name, film))
            found.observations.extend(self._known(photo, film))
            if isinstance(film.pattern, Reseau):
                found.observations.append(
                    KnownTogether("reseau", film.pattern.weights, covariance=film.pattern.covariance)
                )
            found.observations.extend(
                Fiducial(photo.name, self.fiducials[photo.camera].marks[name], film, reading, sd=sd)
                for name, reading, sd in zip(photo.marks, photo.readings, photo.sd, strict=True)
            )
            model = self.kinds[photo.film].model
            if len(photo.marks) < LEAST[model] and self.tables.settings.interior != "before":
                fields = {"photo": photo.name, "n": len(photo.marks), "least": LEAST[model], "model": model}
                self.tables.remark("plain.few-fiducials", **fields)
        for camera, own in self.fiducials.items():
            read = {name for photo in self.photos if photo.camera == camera for name in photo.marks}
            found.observations.extend(own.known(self.tables, read, self.covariances))
        machines = {id(each.machine): each.machine for each in self.photos}
        found.observations.extend(each.known for each in machines.values() if each.known is not None)

    def _place_films(self) -> None:
        """Find the side of each photo, and initial values of t1, t2 and theta, from table and marks."""
        given = self.table.vectors(_START)
        for photo in self.photos:
            photo.mirrored = side_of(self.tables, self.table, photo, self.photos)
            if message := scale_message(photo):
                raise ContradictionError.of(self.table.error(photo.row, message))
            if not np.isnan(given[photo.row]).any():
                photo.start = given[photo.row]
            elif len(photo.marks) > 1:
                photo.start = np.array(conformal(photo.places, photo.true, mirrored=photo.mirrored)[:3])
        # The camera frame of a stellar calibration is the one of the measured plate.
        stars = {each.name for each in self.cameras.cameras if each.image_y == "down"}
        found = [each for each in self.photos if each.camera not in stars and each.given_side is None]
        remarks = mark_remarks(self.photos, [photo.name for photo in found if photo.mirrored])
        self.tables.messages.extend(Message(each, self.table.path) for each in remarks)

    def _start(self, photo: ScannedPhoto) -> Floats:
        """Return initial values of a photo, or of the nearest one on its film and scanner."""
        if photo.start is not None:
            return photo.start
        for other in sorted(self.photos, key=lambda each: abs(each.row - photo.row)):
            same = other.film == photo.film and other.machine is photo.machine
            if other.start is not None and same and other.mirrored == photo.mirrored:
                self.tables.remark("plain.film-start", photo=photo.name, other=other.name)
                return other.start
        message = phrase("plain.no-film-start", photo=photo.name, columns=list(_START))
        raise self.table.error(photo.row, message)

    def _film(self, photo: ScannedPhoto, start: Floats) -> Film:
        kind, machine = self.kinds[photo.film], photo.machine
        fixed = np.array(kind.sd_size) == 0
        roll = kind.roll if fixed[0] else None
        size, bend = [0.0 if fixed[0] else float(kind.roll.position[0]), 0.0, 0.0], None
        if kind.model == "conformal":
            fixed[1:] = True
        if kind.model in ("bilinear", "projective"):
            bend = FilmBend(photo.name, np.zeros(2), np.array(kind.sd_bend))
        return Film(
            FilmPlacement(photo.name, start),
            FilmSize(photo.name, size, np.where(fixed, 0.0, np.inf)),
            machine.scanner,
            machine.readings,
            bend=bend,
            projective=kind.model == "projective",
            roll=roll,
            curves=machine.curves,
            pattern=kind.pattern if kind.reseau is None else kind.reseau(photo.name),
            mirrored=photo.mirrored,
        )

    def fitted(self, scans: Sequence[Scan]) -> list[Scan]:
        """Return fixed films, fitted to their marks only, with fixed scanners."""
        scanners: dict[int, Machine] = {}
        found = []
        for photo, scan in zip(self.photos, scans, strict=True):
            kind, film, machine = self.kinds[photo.film], scan.film, photo.machine
            reseau = kind.reseau
            model: FilmModel = kind.model  # type: ignore[assignment]
            fit = made(
                self.table,
                photo.row,
                interior_orientation,
                photo.places,
                np.array(photo.readings).reshape(-1, 2),
                model,
                sd=np.array(photo.sd),
                counted=machine.readings,
                scanner=machine.scanner,
                curves=machine.curves,
                mirrored=film.mirrored,
                reseau=None if reseau is None else reseau(photo.name),
            )
            fixed = scanners.setdefault(id(machine), machine.held())
            film = replace(
                film,
                placement=FilmPlacement(photo.name, fit.film[:3], 0.0),
                size=FilmSize(photo.name, fit.film[3:].tolist(), np.zeros(3)),
                scanner=fixed.scanner,
                curves=fixed.curves,
                roll=None,
                bend=None if film.bend is None else FilmBend(photo.name, fit.bend, np.zeros(2)),
                pattern=None if reseau is None else reseau(photo.name, fit.shifts),
            )
            found.append(Scan(photo.name, film))
        return found

    def _known(self, photo: ScannedPhoto, film: Film) -> list[Observation]:
        """Return prior observations of a film; empty if it is free."""
        kind = self.kinds[photo.film]
        roll = None if film.roll is not None else kind.roll
        fixed = film.size.deviations == 0
        sd = {name: kind.sd_size[k] for k, name in enumerate(FILM[3:]) if not fixed[k]}
        sd = {name: own for name, own in sd.items() if math.isfinite(own)}
        sizes = 0.0 if roll is not None else float(kind.roll.position[0]), 0.0, 0.0
        values = dict(zip(FILM, (*film.placement.position.tolist(), *sizes), strict=True))
        own = photo.name, film.placement, film.size, roll
        if (covariance := self.covariances.over("film", photo.name, FILM)) is not None:
            return [KnownFilm(*own, FILM, list(values.values()), covariance=covariance)]
        if not sd:
            return []
        return [KnownFilm(*own, [*sd], [values[name] for name in sd], sd=[*sd.values()])]


def on_film(cameras: Cameras, photos: Photos, scanned: Scanned, messages: list[Message]) -> Cameras:
    """Return cameras with positive planes for films, and weights of the readings.

    The sign of a principal distance of the model, negative for the positive plane, is accepted, with its
    covariances. The frame of marks belongs to the positive.
    """
    used = {photos.cameras[row] for row in np.flatnonzero(scanned.photos).tolist()}
    found = list(cameras.rows)
    for row in used:
        camera = found[row].camera
        if camera.image_y == "up" and camera.parameters.get("c", -1.0) > 0:
            signs = signs_in_files(camera.names).tolist()
            camera = scaled_camera(camera, dict(zip(camera.names, signs, strict=True)))
            messages.append(Message(phrase("plain.negative-distance", camera=camera.name)))
        if camera.direction == "backward" and not found[row].weights_given:
            camera = camera.replace(weights="measured")
        found[row] = found[row]._replace(camera=camera)
    return cameras._replace(rows=found)


class WrittenFilms:
    """The films of a project in the form of tables."""

    def __init__(self, project: Project, cameras: Sequence[str]) -> None:
        block = project.block
        self.photos, camera_of = block.photo_ids, dict(zip(block.photo_ids, cameras, strict=True))
        scans = [each for each in block.passages if isinstance(each, Scan)]
        observations: Sequence[Observation] = block.observations
        self.before = any(not each.film.placement.deviations.any() for each in scans)
        if self.before:
            if INSIDE not in project.details:
                raise InputError(phrase("plain.fixed-films"))
            scans, observations = project.details[INSIDE]
        self.films = {each.photo: each.film for each in scans if each.photo in camera_of}
        self.readings = [
            each for each in observations if isinstance(each, Fiducial) and each.photo in self.films
        ]
        known = [each for each in observations if isinstance(each, KnownFilm)]
        self.known = {each.photo: each for each in known if each.photo in self.films}
        together = [each for each in observations if isinstance(each, KnownTogether)]
        self.machines = machines_of(self.films.values(), together)
        self.certificates = marks_of(self.readings, together, camera_of)
        self.by_mark = {
            id(mark): name for own in self.certificates.values() for name, mark in own.marks.items()
        }
        self._rolls = {
            photo: self.known[photo].roll if film.roll is None and photo in self.known else film.roll
            for photo, film in self.films.items()
        }

    @property
    def pixels(self) -> bool:
        """Whether readings are columns and rows."""
        return any(each.readings.pitch != 1.0 for each in self.films.values())

    def tables(self) -> dict[str, dict[str, Any]]:
        """Return the tables of films by name."""
        names = ("column", "row") if self.pixels else ("x", "y")
        if any(each.precision[0, 1] for each in self.readings):
            raise InputError(phrase("plain.correlated-readings"))
        readings = (
            {"photo": each.photo, "fiducial": self.by_mark[id(each.mark)]}
            | columns_of(names, each.observed[:2])
            | columns_of(deviation_columns(names), np.sqrt(np.diag(each.precision)))
            for each in self.readings
        )
        films: dict[str, dict[str, Any]] = {}  # One row for all photos of a roll
        for photo, film in self.films.items():
            cells = {"film": "film"} | film_cells(film, self._rolls[photo], self._sizes(photo))
            row = films.setdefault(cells["film"], cells)
            if any(None not in (row.get(key), cell) and row.get(key) != cell for key, cell in cells.items()):
                raise InputError(phrase("plain.film-differs", film=cells["film"], photo=photo))
            row |= {key: cell for key, cell in cells.items() if row.get(key) is None}
        rows = {
            "fiducials": (row for own in self.certificates.values() for row in own.rows()),
            "fiducial_images": readings,
            "films": films.values(),
            "scanners": map(scanner_cells, self.machines.values()),
        }
        found = {name: columns_of_records(own) for name, own in rows.items()}
        return {name: columns for name, columns in found.items() if columns}

    def photo_columns(self) -> dict[str, Any]:
        """Return the columns of photos; empty without films."""
        rows: dict[str, dict[str, Any]] = {photo: {} for photo in self.photos}
        for photo, film in self.films.items():
            known, roll, start = self.known.get(photo), self._rolls[photo], film.placement.position
            if known is not None and known.covariance is not None:
                start = np.asarray(known.values, dtype=float)[:3]
            rows[photo] = {"film": "film" if roll is None else roll.name, "scanner": film.scanner.name}
            rows[photo] |= {"mirrored": film.mirrored, **columns_of(_START, start)}
        return columns_of_records(rows.values())

    def covariances(self) -> list[tuple[str, str, Sequence[str], Floats]]:
        """Return type, name, components and matrix of joint priors."""
        found: list[tuple[str, str, Sequence[str], Floats]] = [
            ("film", photo, FILM, each.precision)
            for photo, each in self.known.items()
            if each.covariance is not None
        ]
        for name, own in self.machines.items():
            if own.known is not None:
                found.append(("scanner", name, own.words(own.known.joined), own.known.precision))
        for camera, marks in self.certificates.items():
            if marks.covariance is not None:
                found.append(("fiducials", camera, marks.words, marks.covariance))
        return found

    def _sizes(self, photo: str) -> Mapping[str, float | None]:
        """Return standard deviations of m, b1, b2; None with covariances."""
        known, sd = self.known.get(photo), self.films[photo].size.deviations
        if known is not None and known.covariance is not None:
            if tuple(known.known) != FILM:
                raise InputError(phrase("plain.film-covariance", name=known.name, names=list(FILM)))
            return {name: None if own else 0.0 for name, own in zip(FILM[3:], sd, strict=True)}
        found = dict(zip(FILM[3:], np.where(sd == 0, 0.0, np.inf).tolist(), strict=True))
        if known is None:
            return found
        if not set(known.known) <= set(found) or np.any(known.values):
            raise InputError(phrase("plain.film-priors", name=known.name))
        return found | dict(zip(known.known, np.sqrt(np.diag(known.precision)).tolist(), strict=True))
