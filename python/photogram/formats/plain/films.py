"""Photos on film and plates: scanned photos, their marks, and prior information; read and written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import ContradictionError, InputError
from photogram.film.interior import FilmModel, conformal, interior_orientation
from photogram.formats.images import scaled_camera
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.film_readings import (
    ScannedPhoto,
    beyond_message,
    mark_remarks,
    read_marks,
    scale_message,
    side_of,
)
from photogram.formats.plain.film_tables import (
    FilmKind,
    Machine,
    Marks,
    film_cells,
    machines_of,
    marks_of,
    read_fiducials,
    read_films,
    read_scanners,
    roll_of,
    scanner_cells,
)
from photogram.formats.plain.photos import Images, Photos
from photogram.formats.plain.schema import deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, columns_of_records, made, signs_in_files
from photogram.formats.plain.unknowns import Covariances
from photogram.formats.project import Project
from photogram.io.column_table import FALSE, TRUE, ColumnTable
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.network.films import Film, FilmBend, FilmPlacement, FilmSize, Readings, Reseau, Scan, Scanner
from photogram.network.observations import FILM, Fiducial, KnownFilm, KnownTogether, Observation
from photogram.words import phrase

LEAST = {"conformal": 2, "affine": 3, "bilinear": 4, "projective": 4}  # Required marks of a film
_START = ("start_t1", "start_t2", "start_theta")
INSIDE = "films inside"
"""Key of a detail of a project with fixed films: the complete contents of their tables."""


class Scanned(NamedTuple):
    """Scanned photos with the transformations of their images and their observations."""

    photos: Bools  # (P,) whether photos are scanned
    scans: Sequence[Scan] = ()  # Transformations of image coordinates
    observations: Sequence[Observation] = ()
    # If films are fitted in advance: the complete scans and observations for the details of the project, from
    # which tables are written
    inside: Mapping[str, tuple[list[Scan], list[Observation]]] = MappingProxyType({})


def read_scanned(
    tables: Tables, images: Images, points: Floats, photos: Photos, cameras: Cameras, covariances: Covariances
) -> Scanned:
    """Read which photos are scanned films or plates, and their films and marks.

    `points` are the (n, 3) coordinates of all points of the images; NaN where unknown.
    """
    scanned = np.array([bool(name) for name in photos.table.texts("film")], dtype=bool)
    if not scanned.any():
        for name in ("fiducial_images", "fiducials", "films", "scanners"):
            if name in tables.settings.tables:
                raise InputError(phrase("plain.no-film", table=name), file=tables.settings.tables[name])
        return Scanned(scanned)
    if tables.settings.image == "um":
        raise InputError(phrase("plain.film-unit"), file=tables.settings.path)
    machines = read_scanners(tables, covariances)
    names = [*dict.fromkeys(filter(None, photos.table.texts("film")))]
    kinds = read_films(tables, names, tables.settings.film)
    fiducials = read_fiducials(tables, set(photos.taken), cameras.certificates)
    films = _scanned_photos(photos, cameras, images, points, machines, kinds, fiducials)
    read_marks(tables, photos, films)
    starts = _starts(tables, photos.table, cameras, films)
    scans = [Scan(photo.name, _film(photo, start)) for photo, start in zip(films, starts, strict=True)]
    observations = _observations(tables, films, scans, fiducials, covariances)
    if tables.settings.interior == "before":
        return Scanned(scanned, _fitted(photos.table, films, scans), (), {INSIDE: (scans, observations)})
    return Scanned(scanned, scans, observations)


def _scanned_photos(
    photos: Photos,
    cameras: Cameras,
    images: Images,
    points: Floats,
    machines: Mapping[str, Machine],
    kinds: Mapping[str, FilmKind],
    fiducials: Mapping[str, Marks],
) -> list[ScannedPhoto]:
    table, found = photos.table, []
    comparator = Machine(Scanner("comparator", sd=0.0), (), Readings(), None)
    scanners, sides = table.texts("scanner"), table.texts("mirrored")
    sd = np.ones(len(images.xy)) if images.sd is None else images.sd.max(axis=1)
    for row, film in enumerate(table.texts("film")):
        if not film:
            continue
        name, side, camera = scanners[row], sides[row].lower(), photos.taken[row]
        if name not in machines and (name or len(machines) > 1):
            raise table.unknown_error(row, "scanner", "scanner", name, machines)
        if side and side not in TRUE | FALSE:
            raise table.cell_error(row, "mirrored", "error.flag", value=side)
        own = np.flatnonzero(images.photos == row)
        c = -abs(cameras.cameras[photos.cameras[row]].parameters.get("c", np.nan))
        found.append(
            ScannedPhoto(
                photos.names[row],
                row,
                camera,
                kinds[film],
                machines[name] if name else next(iter(machines.values()), comparator),
                fiducials[camera].marks if camera in fiducials else {},
                side in TRUE if side else None,
                images.xy[own],
                sd[own],
                images.points[own],
                points[images.points[own]],
                (photos.centres[row], photos.matrices[row], c),
            )
        )
    return found


def _starts(
    tables: Tables, table: ColumnTable, cameras: Cameras, photos: Sequence[ScannedPhoto]
) -> list[Floats]:
    """Find the side of each photo; return initial values of t1, t2 and theta, from table and marks."""
    given = table.vectors(_START)
    for photo in photos:
        photo.mirrored = side_of(tables, table, photo, photos)
        if message := scale_message(photo):
            raise ContradictionError.of(table.error(photo.row, message))
        if not np.isnan(given[photo.row]).any():
            photo.start = given[photo.row]
        elif len(photo.marks) > 1:
            photo.start = np.array(conformal(photo.places, photo.true, mirrored=photo.mirrored)[:3])
    # The camera frame of a stellar calibration is the one of the measured plate.
    by_name = {each.name: each for each in cameras.cameras}
    unsided = [each for each in photos if each.given_side is None and by_name[each.camera].image_y != "down"]
    remarks = mark_remarks(photos, [photo.name for photo in unsided if photo.mirrored])
    tables.messages.extend(Message(each, table.path) for each in remarks)
    for name, certificate in cameras.certificates.items():
        if beyond := beyond_message(by_name[name], certificate, photos):
            tables.messages.append(Message(beyond, certificate.file))
    return [_start(tables, table, photo, photos) for photo in photos]


def _start(tables: Tables, table: ColumnTable, photo: ScannedPhoto, photos: Sequence[ScannedPhoto]) -> Floats:
    """Return initial values of a photo, or of the nearest one on its film and scanner."""
    if photo.start is not None:
        return photo.start
    for other in sorted(photos, key=lambda each: abs(each.row - photo.row)):
        same = other.kind is photo.kind and other.machine is photo.machine
        if other.start is not None and same and other.mirrored == photo.mirrored:
            tables.remark("plain.film-start", photo=photo.name, other=other.name)
            return other.start
    raise table.error(photo.row, phrase("plain.no-film-start", photo=photo.name, columns=list(_START)))


def _observations(
    tables: Tables,
    photos: Sequence[ScannedPhoto],
    scans: Sequence[Scan],
    fiducials: Mapping[str, Marks],
    covariances: Covariances,
) -> list[Observation]:
    found = list[Observation]()
    for photo, film in ((photo, scan.film) for photo, scan in zip(photos, scans, strict=True)):
        found += _known(photo, film, covariances)
        if isinstance(film.pattern, Reseau):
            reseau = film.pattern
            found.append(KnownTogether("reseau", reseau.weights, covariance=reseau.covariance))
        found += (
            Fiducial(photo.name, photo.fiducials[name], film, reading, sd=sd)
            for name, reading, sd in zip(photo.marks, photo.readings, photo.sd, strict=True)
        )
        model = photo.kind.model
        if len(photo.marks) < LEAST[model] and tables.settings.interior != "before":
            fields = {"photo": photo.name, "n": len(photo.marks), "least": LEAST[model], "model": model}
            tables.remark("plain.few-fiducials", **fields)
    for camera, own in fiducials.items():
        read = {name for photo in photos if photo.camera == camera for name in photo.marks}
        found += own.known(tables, read, covariances)
    machines = {id(each.machine): each.machine for each in photos}
    return [*found, *(each.known for each in machines.values() if each.known is not None)]


def _film(photo: ScannedPhoto, start: Floats) -> Film:
    kind, machine = photo.kind, photo.machine
    fixed = np.array(kind.sd_size) == 0
    roll = kind.roll if fixed[0] else None
    size = [0.0 if fixed[0] else float(kind.roll.position[0]), 0.0, 0.0]
    if kind.model == "conformal":
        fixed[1:] = True
    return Film(
        FilmPlacement(photo.name, start),
        FilmSize(photo.name, size, np.where(fixed, 0.0, np.inf)),
        machine.scanner,
        machine.readings,
        bend=FilmBend(photo.name, np.zeros(2), np.array(kind.sd_bend)) if kind.sd_bend else None,
        projective=kind.model == "projective",
        roll=roll,
        curves=machine.curves,
        pattern=kind.pattern(photo.name),
        mirrored=photo.mirrored,
    )


def _fitted(table: ColumnTable, photos: Sequence[ScannedPhoto], scans: Sequence[Scan]) -> list[Scan]:
    """Return fixed films, fitted to their marks only, with fixed scanners."""
    scanners: dict[int, Machine] = {}
    found = []
    for photo, film in ((photo, scan.film) for photo, scan in zip(photos, scans, strict=True)):
        machine, reseau = photo.machine, film.pattern if isinstance(film.pattern, Reseau) else None
        model: FilmModel = photo.kind.model  # type: ignore[assignment]
        fit = made(
            table,
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
            reseau=reseau,
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
            pattern=None if reseau is None else reseau.with_shifts(fit.shifts),
        )
        found.append(Scan(photo.name, film))
    return found


def _known(photo: ScannedPhoto, film: Film, covariances: Covariances) -> list[Observation]:
    """Return prior observations of a film; empty if it is free."""
    roll = photo.kind.roll if film.roll is None else None
    sizes = 0.0 if roll is not None else float(photo.kind.roll.position[0]), 0.0, 0.0
    values = dict(zip(FILM, (*film.placement.position.tolist(), *sizes), strict=True))
    own = photo.name, film.placement, film.size, roll
    if (covariance := covariances.over("film", photo.name, FILM)) is not None:
        return [KnownFilm(*own, FILM, list(values.values()), covariance=covariance)]
    free = film.size.deviations != 0
    sd = {
        name: one
        for name, one, weighted in zip(FILM[3:], photo.kind.sd_size, free, strict=True)
        if weighted and math.isfinite(one)
    }
    return [KnownFilm(*own, [*sd], [values[name] for name in sd], sd=[*sd.values()])] if sd else []


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
        self.by_mark = {mark: name for own in self.certificates.values() for name, mark in own.marks.items()}

    @property
    def pixels(self) -> bool:
        """Whether readings are columns and rows."""
        return any(each.readings.pitch != 1.0 for each in self.films.values())

    def tables(self) -> dict[str, dict[str, Any]]:
        names = ("column", "row") if self.pixels else ("x", "y")
        if any(each.precision[0, 1] for each in self.readings):
            raise InputError(phrase("plain.correlated-readings"))
        readings = (
            {"photo": each.photo, "fiducial": self.by_mark[each.mark]}
            | columns_of(names, each.observed[:2])
            | columns_of(deviation_columns(names), np.sqrt(np.diag(each.precision)))
            for each in self.readings
        )
        films: dict[str, dict[str, Any]] = {}  # One row for all photos of a roll
        for photo, film in self.films.items():
            cells = film_cells(film, self.known.get(photo))
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
            known, start = self.known.get(photo), film.placement.position
            roll = roll_of(film, known)
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
