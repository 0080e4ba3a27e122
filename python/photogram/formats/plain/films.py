"""Photos on film and plates: which are scanned, their marks, and what is known of all that."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.film.interior import (
    FilmModel,
    conformal,
    interior_orientation,
    is_mirrored,
    mirror_message,
    true_places,
)
from photogram.film.which import which_mark
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.covariances import Covariances
from photogram.formats.plain.photos import Photos
from photogram.formats.plain.scanners import Machine, read_films, read_scanners
from photogram.formats.plain.shared import made
from photogram.formats.plain.tables import Tables, indices_of
from photogram.io.delimited import FALSE, TRUE, ColumnTable
from photogram.messages import Message, quoted
from photogram.network.cameras import Camera
from photogram.network.films import Film, FilmBend, FilmPlacement, FilmSize, Mark, Readings, Scan, Scanner
from photogram.network.observations import FILM, Fiducial, KnownFilm, KnownTogether, Observation

__all__ = ["Scanned", "on_film", "read_scanned"]

SD_MARK = 0.002
"""mm, of places in a certificate that does not say it: they are printed to 0.001."""
LEAST = {"conformal": 2, "affine": 3, "bilinear": 4, "projective": 4}
"""Marks that determine a film."""
_START = ("start_t1", "start_t2", "start_theta")


@dataclass(frozen=True)
class Scanned:
    """Photos whose images are readings: which they are, what images pass, and what was observed."""

    photos: Bools
    scans: list[Scan] = field(default_factory=list)
    observations: list[Observation] = field(default_factory=list)


@dataclass
class _Photo:
    """A photo on film: rows of the table of photos, and readings of its marks."""

    name: str
    row: int
    camera: str
    film: str
    machine: Machine
    marks: list[str] = field(default_factory=list)
    readings: list[Floats] = field(default_factory=list)
    sd: list[Floats] = field(default_factory=list)


def read_scanned(tables: Tables, photos: Photos, covariances: Covariances) -> Scanned:
    """Read which photos are scanned films or plates, and all that belongs to these.

    Raises
    ------
    InputError
        Films, scanners and marks that are not there, photos that are mirrored against what is given, marks
        that cannot be told.
    """
    films = [photos.table.texts("film")[row] for row in photos.rows.tolist()]
    scanned = np.array([bool(name) for name in films], dtype=bool)
    for table in ("fiducial_images", "fiducials", "films", "scanners"):
        if table in tables.settings.tables and not scanned.any():
            raise InputError(
                f"there is a table {table}, and no photo names its film (column film of photos)",
                file=tables.settings.tables[table],
            )
    found = Scanned(scanned)
    if scanned.any():
        _Reader(tables, photos, covariances, films).read(found)
    return found


class _Reader:
    """Reads the films of photos."""

    def __init__(
        self, tables: Tables, photos: Photos, covariances: Covariances, films: Sequence[str]
    ) -> None:
        self.tables, self.table, self.covariances = tables, photos.table, covariances
        self.before = tables.settings.interior == "before"
        machines = read_scanners(tables, covariances)
        self.kinds = read_films(tables, list(dict.fromkeys(filter(None, films))), tables.settings.film)
        self.places, self.place_sd, self.certificates = self._certificates(photos)
        names = self.table.texts("scanner")
        self.photos = [
            _Photo(name, row, camera, film, self._machine(row, names[row], machines))
            for name, row, camera, film in zip(
                photos.names, photos.rows.tolist(), photos.taken, films, strict=True
            )
            if film
        ]
        self._read_marks(photos)

    def _machine(self, row: int, name: str, machines: Mapping[str, Machine]) -> Machine:
        if not name and len(machines) == 1:
            own = next(iter(machines.values()))
        elif not name and not machines:
            own = Machine(Scanner("comparator", sd=0.0), (), Readings(), None)
        elif name not in machines:
            raise self.table.error(row, f"column scanner: there is no scanner {quoted(name)}")
        else:
            own = machines[name]
        return self._held.setdefault(id(own), own.held()) if self.before else own

    @property
    def _held(self) -> dict[int, Machine]:
        own: dict[int, Machine] = self.__dict__.setdefault("_held_machines", {})
        return own

    def _certificates(
        self, photos: Photos
    ) -> tuple[dict[str, dict[str, Floats]], dict[str, dict[str, Floats]], ColumnTable | None]:
        """Return places and standard deviations of marks by camera."""
        table = self.tables.read("fiducials")
        places: dict[str, dict[str, Floats]] = {}
        deviations: dict[str, dict[str, Floats]] = {}
        if table is None:
            return places, deviations, None
        xy = table.vectors(("x", "y"))
        table.check_given(xy, ("x", "y"))
        sd = self.tables.deviations(table, "fiducials", ("sd_x", "sd_y"), SD_MARK)
        use, cameras = table.flags("use"), set(photos.taken)
        for row, (camera, name) in enumerate(
            zip(table.texts("camera"), table.texts("fiducial"), strict=True)
        ):
            if not use[row] or camera not in cameras:
                continue
            if name in places.setdefault(camera, {}):
                raise table.error(row, f"the camera {camera} has the fiducial {name} twice")
            places[camera][name] = xy[row]
            deviations.setdefault(camera, {})[name] = sd[row]
        return places, deviations, table

    def _read_marks(self, photos: Photos) -> None:
        """Read the readings of marks."""
        table = self.tables.read("fiducial_images")
        if table is None:
            return
        names = ("column", "row") if "column" in table else ("x", "y")
        xy = table.vectors(names)
        table.check_given(xy, names)
        own = ["sd_column", "sd_row"] if "column" in table else ["sd_x", "sd_y"]
        sd = self.tables.deviations(table, "fiducial_images", own)
        table.check_given(sd, own, "is empty: give sd, or [sd] fiducial_images")
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
                raise table.error(row, f"the photo {name} has no film (column film of photos)")
            photo = by_name[name]
            if marks[row] and marks[row] not in self.places.get(photo.camera, {}):
                raise table.error(row, f"the camera {photo.camera} has no fiducial {quoted(marks[row])}")
            if marks[row] and marks[row] in photo.marks:
                raise table.error(row, f"the fiducial {marks[row]} of the photo {name} was read twice")
            photo.marks.append(marks[row])
            photo.readings.append(xy[row])
            photo.sd.append(sd[row])
        for photo in self.photos:
            self._name_marks(table, photo)

    def _name_marks(self, table: ColumnTable, photo: _Photo) -> None:
        """Find which marks readings without names are of."""
        if all(photo.marks):
            return
        if any(photo.marks):
            raise table.head.error(f"some fiducials of the photo {photo.name} have names: give all or none")
        places = self.places.get(photo.camera, {})
        try:
            found = which_mark(np.array(list(places.values())).reshape(-1, 2), self._true(photo))
        except InputError as error:
            raise table.head.error(f"photo {photo.name}: {error.message}") from None
        if not found.decided:
            raise table.head.error(f"photo {photo.name}: {found}; give the names of its fiducials")
        photo.marks[:] = [list(places)[k] for k in found.marks.tolist()]
        self.tables.messages.append(Message(f"photo {photo.name}: its film lies {found}", table.path))

    def _true(self, photo: _Photo) -> Floats:
        return true_places(np.array(photo.readings), photo.machine.readings, photo.machine.scanner)

    def read(self, found: Scanned) -> None:
        """Put the scans and observations of all photos in their place."""
        marks = {
            camera: {
                name: Mark(f"{camera} {name}", place, 0.0 if self.before else np.inf)
                for name, place in own.items()
            }
            for camera, own in self.places.items()
        }
        starts = self._starts()
        for photo, (mirrored, start) in zip(self.photos, starts, strict=True):
            film = self._film(photo, mirrored, start)
            found.scans.append(Scan(photo.name, film))
            if self.before:
                continue
            found.observations.append(self._known(photo, film))
            found.observations.extend(
                Fiducial(photo.name, marks[photo.camera][name], film, reading, sd=sd)
                for name, reading, sd in zip(photo.marks, photo.readings, photo.sd, strict=True)
            )
            self._remark(photo)
        if not self.before:
            found.observations.extend(self._known_marks(marks))
            machines = {id(each.machine): each.machine for each in self.photos}
            found.observations.extend(each.known for each in machines.values() if each.known is not None)

    def _remark(self, photo: _Photo) -> None:
        """Say it where a film stands on what is known of it beforehand."""
        model = self.kinds[photo.film].model
        if len(photo.marks) < LEAST[model]:
            self.tables.messages.append(
                Message(
                    f"photo {photo.name}: {len(photo.marks)} fiducials, fewer than the {LEAST[model]} of the"
                    f" {model} film: its unknowns stand on what is known of the film beforehand, and on images"
                )
            )

    def _starts(self) -> list[tuple[bool, Floats]]:
        """Return the side of each photo, and where t1, t2 and theta start."""
        given, sides = self.table.vectors(_START), self.table.texts("mirrored")
        found: list[tuple[bool, Floats | None]] = []
        for photo in self.photos:
            row = photo.row
            mirrored = self._side(photo, sides[row])
            start: Floats | None = None if np.isnan(given[row]).any() else given[row]
            if start is None and len(photo.marks) > 1:
                q = np.array([self.places[photo.camera][name] for name in photo.marks])
                start = np.array(conformal(q, self._true(photo), mirrored=mirrored)[:3])
            found.append((mirrored, start))
        return [
            (mirrored, self._neighbour(k, found) if start is None else start)
            for k, (mirrored, start) in enumerate(found)
        ]

    def _side(self, photo: _Photo, word: str) -> bool:
        """Return whether a photo is mirrored: as is given, or as its marks tell."""
        if word and word.lower() not in TRUE | FALSE:
            raise self.table.error(photo.row, f"column mirrored: {quoted(word)} is neither true nor false")
        given = None if not word else word.lower() in TRUE
        q = np.array([self.places[photo.camera][name] for name in photo.marks]).reshape(-1, 2)
        found = is_mirrored(q, self._true(photo)) if len(q) > 2 else None
        if given is not None and found is not None and found != given:
            raise self.table.error(photo.row, f"photo {photo.name}: {mirror_message(given)}")
        if given is None and found is None:
            if self.table.texts("mirrored") and len(q):
                self.tables.messages.append(
                    Message(
                        f"photo {photo.name}: its marks do not tell the side; it is taken as not mirrored"
                    )
                )
            return False
        return bool(found if given is None else given)

    def _neighbour(self, k: int, found: Sequence[tuple[bool, Floats | None]]) -> Floats:
        """Return where a photo of the same film and scanner starts, of one that has no marks."""
        photo, mirrored = self.photos[k], found[k][0]
        for other in sorted(range(len(found)), key=lambda j: abs(j - k)):
            start = found[other][1]
            same = self.photos[other].film == photo.film and self.photos[other].machine is photo.machine
            if start is not None and same and found[other][0] == mirrored:
                self.tables.messages.append(
                    Message(
                        f"photo {photo.name}: fewer than two fiducials; its film starts where that of"
                        f" {self.photos[other].name} lies"
                    )
                )
                return start
        raise self.table.error(
            photo.row,
            f"photo {photo.name} has fewer than two fiducials, and no photo of its film and scanner has more:"
            f" give {', '.join(_START)}",
        )

    def _film(self, photo: _Photo, mirrored: bool, start: Floats) -> Film:
        kind, machine = self.kinds[photo.film], photo.machine
        placement = partial(FilmPlacement, photo.name, start)
        roll, bend, pattern = None, None, kind.pattern
        held = np.array(kind.sd_size) == 0
        size = [0.0, 0.0, 0.0]
        bend_sd = np.array(kind.sd_bend)
        bend_at: Floats = np.zeros(2)
        if self.before:
            placement, size, bend_at = self._fitted(photo, mirrored)
            held[:], bend_sd, pattern = True, np.zeros(2), None
        elif held[0]:
            roll = kind.roll
        else:
            size[0] = float(kind.roll.position[0])
        if kind.model == "conformal":
            held[1:] = True
        if kind.model in ("bilinear", "projective"):
            bend = FilmBend(photo.name, bend_at, bend_sd)
        own = FilmSize(photo.name, size, np.where(held, 0.0, np.inf))
        return Film(
            placement(),
            own,
            machine.scanner,
            machine.readings,
            bend=bend,
            projective=kind.model == "projective",
            roll=roll,
            curves=machine.curves,
            pattern=pattern,
            mirrored=mirrored,
        )

    def _fitted(self, photo: _Photo, mirrored: bool) -> tuple[partial[FilmPlacement], list[float], Floats]:
        """Return the film of a photo as its marks alone have it: errorless."""
        q = np.array([self.places[photo.camera][name] for name in photo.marks]).reshape(-1, 2)
        model: FilmModel = self.kinds[photo.film].model  # type: ignore[assignment]
        fit = made(
            self.table,
            photo.row,
            lambda: interior_orientation(
                q,
                np.array(photo.readings).reshape(-1, 2),
                model,
                sd=np.array(photo.sd),
                counted=photo.machine.readings,
                scanner=photo.machine.scanner,
                mirrored=mirrored,
            ),
        )
        return partial(FilmPlacement, photo.name, fit.film[:3], 0.0), fit.film[3:].tolist(), fit.bend

    def _known(self, photo: _Photo, film: Film) -> Observation:
        """Return what is known of a film beforehand."""
        kind = self.kinds[photo.film]
        roll = None if film.roll is not None else kind.roll
        names = [
            name
            for name, sd, held in zip(FILM[3:], kind.sd_size, film.size.deviations == 0, strict=True)
            if not held and math.isfinite(sd)
        ]
        values = {"m": 0.0 if roll is not None else float(kind.roll.position[0]), "b1": 0.0, "b2": 0.0}
        sd = dict(zip(FILM[3:], kind.sd_size, strict=True))
        covariance = self.covariances.over("film", photo.name, FILM)
        if covariance is not None:
            full = [*film.placement.position.tolist(), *(values[name] for name in FILM[3:])]
            return KnownFilm(photo.name, film.placement, film.size, roll, FILM, full, covariance=covariance)
        return KnownFilm(
            photo.name,
            film.placement,
            film.size,
            roll,
            names,
            [values[n] for n in names],
            sd=[sd[n] for n in names],
        )

    def _known_marks(self, marks: Mapping[str, Mapping[str, Mark]]) -> list[Observation]:
        """Return certificates: a covariance of all marks of a camera, or each mark by itself."""
        found: list[Observation] = []
        read = {(photo.camera, name) for photo in self.photos for name in photo.marks}
        for camera, own in marks.items():
            words = [f"{name}.{axis}".lower() for name in own for axis in "xy"]
            covariance = self.covariances.over("fiducials", camera, words)
            if covariance is not None:
                found.append(KnownTogether("certificate", list(own.values()), covariance=covariance))
                continue
            found += [
                KnownTogether("certificate", [mark], sd=self.place_sd[camera][name])
                for name, mark in own.items()
                if (camera, name) in read
            ]
        return found


def on_film(cameras: Cameras, photos: Photos, scanned: Scanned, messages: list[Message]) -> Cameras:
    """Return cameras of which those of films are of the positive, with weights of what was read.

    A principal distance that a file has with the sign of the model, negative for the positive plane, is taken
    as it is, and so are its covariances: the frame of marks is that of the positive.
    """
    used = {photos.cameras[row] for row in np.flatnonzero(scanned.photos).tolist()}
    found = list(cameras.cameras)
    for row in used:
        camera = found[row]
        if camera.parameters.get("c", -1.0) > 0:
            found[row] = camera = _positive(camera)
            messages.append(
                Message(
                    f"camera {camera.name}: its principal distance is negative; it is taken as that of the"
                    " positive, in whose frame marks are"
                )
            )
        if camera.direction == "backward" and not cameras.weights_given[row]:
            found[row] = camera.replace(weights="measured")
    return replace(cameras, cameras=found)


def _positive(camera: Camera) -> Camera:
    covariance = camera.covariance
    if covariance is not None:
        names, matrix = covariance
        signs = np.array([-1.0 if name == "c" else 1.0 for name in names])
        covariance = names, np.asarray(matrix) * signs * signs[:, np.newaxis]
    parameters = {**camera.parameters, "c": -camera.parameters["c"]}
    return camera.replace(parameters=parameters, covariance=covariance)
