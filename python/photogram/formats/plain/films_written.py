"""Tables of scanned films and plates, from the contents of a block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.scanners import BENDS, LOCAL, Machine
from photogram.formats.plain.schema import CURVES, GRID, deviation_columns
from photogram.formats.plain.tables import columns_of
from photogram.formats.project import Project
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.films import Film, Mark, Reseau, Scan
from photogram.network.observations import FILM, Fiducial, KnownFilm, KnownTogether, Observation
from photogram.network.unknowns import Unknown
from photogram.words import phrase

INSIDE = "films inside"
"""Key of a detail of a project with fixed films: the complete contents of their tables."""
_Seen = TypeVar("_Seen")


@dataclass
class _Marks:
    """The marks of a camera, and their joint prior."""

    marks: dict[str, Mark] = field(default_factory=dict)
    sd: dict[str, Floats] = field(default_factory=dict)
    covariance: Floats | None = None


class WrittenFilms:
    """The films of a project in the form of tables."""

    def __init__(self, project: Project, cameras: Sequence[str]) -> None:
        block = project.block
        self.photos = block.photo_ids
        self.camera_of = dict(zip(self.photos, cameras, strict=True))
        self.before = any(
            isinstance(each, Scan) and not each.film.placement.deviations.any() for each in block.passages
        )
        passages, observations = self._read(project) if self.before else (block.passages, block.observations)
        self.films = {
            each.photo: each.film
            for each in passages
            if isinstance(each, Scan) and each.photo in self.camera_of
        }
        self.readings = [each for each in _of(observations, Fiducial) if each.photo in self.films]
        self.known = {each.photo: each for each in _of(observations, KnownFilm)}
        self.together = list(_of(observations, KnownTogether))
        self.rolls = self._rolls()
        self.machines = self._machines()
        self.certificates = self._certificates()
        self.by_mark = {
            id(mark): name for own in self.certificates.values() for name, mark in own.marks.items()
        }

    def _read(self, project: Project) -> tuple[Sequence[Any], Sequence[Observation]]:
        if INSIDE not in project.details:
            raise InputError(phrase("plain.fixed-films"))
        found: tuple[Sequence[Any], Sequence[Observation]] = project.details[INSIDE]
        return found

    @property
    def pixels(self) -> bool:
        """Whether readings are columns and rows."""
        return any(each.readings.pitch != 1.0 for each in self.films.values())

    def tables(self) -> dict[str, dict[str, Any]]:
        """Return the four tables; empty without films."""
        if not self.films:
            return {}
        return {
            "fiducials": self._fiducials(),
            "fiducial_images": self._images(),
            "films": self._film_table(),
            "scanners": self._scanner_table(),
        }

    def photo_columns(self) -> dict[str, Any]:
        """Return the columns of photos; empty without films."""
        if not self.films:
            return {}
        films = [self.films.get(photo) for photo in self.photos]
        starts = np.array([self._start(photo) for photo in self.photos])
        return {
            "film": [
                "" if film is None else self.rolls[photo]
                for photo, film in zip(self.photos, films, strict=True)
            ],
            "scanner": ["" if film is None else film.scanner.name for film in films],
            "mirrored": [None if film is None else film.mirrored for film in films],
            **{f"start_{name}": starts[:, k] for k, name in enumerate(FILM[:3])},
        }

    def _start(self, photo: str) -> Floats:
        """Return the initial values of a film: observed, otherwise approximate."""
        if photo not in self.films:
            return np.full(3, np.nan)
        known = self.known.get(photo)
        if known is not None and known.covariance is not None:
            return np.asarray(known.values, dtype=float)[:3]
        return self.films[photo].placement.position

    def covariances(self) -> list[tuple[str, str, Sequence[str], Floats]]:
        """Return type, name, components and matrix of joint priors."""
        found: list[tuple[str, str, Sequence[str], Floats]] = []
        for photo, each in self.known.items():
            if photo in self.films and each.covariance is not None:
                found.append(("film", photo, FILM, each.precision))
        for own in self.machines.values():
            if own.known is not None:
                parts = [word for each in own.known.joined for word in _words(own, each)]
                found.append(("scanner", own.scanner.name, parts, own.known.precision))
        for camera, marks in self.certificates.items():
            if marks.covariance is not None:
                words = tuple(f"{name}.{axis}" for name in marks.marks for axis in "xy")
                found.append(("fiducials", camera, words, marks.covariance))
        return found

    def _rolls(self) -> dict[str, str]:
        """Return the film name of each photo, which is the name of its roll."""
        found = {}
        for photo, film in self.films.items():
            known = self.known.get(photo)
            roll = film.roll if film.roll is not None or known is None else known.roll
            found[photo] = "film" if roll is None else roll.name
        return found

    def _film_table(self) -> dict[str, Any]:
        """Return the table of films, one row for all photos of a roll."""
        rows: dict[str, dict[str, Any]] = {}
        for photo, name in self.rolls.items():
            own = self._film_row(photo)
            row = rows.setdefault(name, own)
            if any(None not in (row.get(key), value) and row.get(key) != value for key, value in own.items()):
                raise InputError(phrase("plain.film-differs", film=name, photo=photo))
            row |= {key: value for key, value in own.items() if row.get(key) is None}
        columns = dict.fromkeys(key for row in rows.values() for key in row)
        return {"film": list(rows), **{key: [row.get(key) for row in rows.values()] for key in columns}}

    def _film_row(self, photo: str) -> dict[str, Any]:
        film, known = self.films[photo], self.known.get(photo)
        roll = film.roll if film.roll is not None or known is None else known.roll
        held = film.size.deviations == 0
        conformal = film.bend is None and bool(held[1:].all())
        bend = "projective" if film.projective else "bilinear"
        row: dict[str, Any] = {"model": "conformal" if conformal else "affine" if film.bend is None else bend}
        if roll is not None:
            row |= {"m": float(roll.position[0]), "sd_m": float(roll.deviations[0])}
        names = ("photo_m", "b1", "b2")
        row |= {f"sd_{name}": sd for name, sd in zip(names, self._size(photo, held), strict=True)}
        if conformal:
            row |= {"sd_b1": None, "sd_b2": None}
        if film.bend is not None:
            row |= {f"sd_{n}": float(sd) for n, sd in zip(BENDS[bend], film.bend.deviations, strict=True)}
        return row | _pattern_cells(film)

    def _size(self, photo: str, held: Floats) -> list[float | None]:
        """Return standard deviations of m, b1, b2; None with covariances."""
        known = self.known.get(photo)
        if known is not None and known.covariance is not None:
            if tuple(known.known) != FILM:
                raise InputError(phrase("plain.film-covariance", name=known.name, names=list(FILM)))
            return [0.0 if own else None for own in held]
        sd = dict(zip(FILM[3:], np.where(held, 0.0, np.inf).tolist(), strict=True))
        if known is None:
            return list(sd.values())
        values = np.asarray(known.values, dtype=float)
        if not set(known.known) <= set(sd) or (values != 0).any():
            raise InputError(phrase("plain.film-priors", name=known.name))
        own = np.sqrt(np.diag(known.precision)).tolist()
        return list((sd | dict(zip(known.known, own, strict=True))).values())

    def _machines(self) -> dict[str, Machine]:
        found: dict[str, Machine] = {}
        known = {id(one): each for each in self.together for one in each.joined}
        for film in self.films.values():
            own = Machine(film.scanner, tuple(film.curves), film.readings, None)
            of = [known[id(each)] for each in (own.scanner, *own.curves) if id(each) in known]
            if of:
                own = replace(own, known=of[0])
            first = found.setdefault(film.scanner.name, own)
            same = first.scanner is own.scanner and first.readings == own.readings
            if not same or [*map(id, first.curves)] != [*map(id, own.curves)]:
                raise InputError(phrase("plain.same-scanners", name=own.scanner.name))
        return found

    def _scanner_table(self) -> dict[str, Any]:
        machines = self.machines.values()
        names = ("Sx", "Sy", "alpha_rad", *CURVES)[: 21 if any(each.curves for each in machines) else 3]
        values = np.array([_joined(each, "position") for each in machines])[:, : len(names)]
        sd = np.array([_own_deviations(each) for each in machines])[:, : len(names)]
        readings = [each.readings for each in machines]
        return {
            "scanner": list(self.machines),
            "pitch_mm": [each.pitch for each in readings],
            "origin_column": [each.origin[0] for each in readings],
            "origin_row": [each.origin[1] for each in readings],
            "rows_down": [each.down for each in readings],
            "hx": [each.half_range[0] for each in readings],
            "hy": [each.half_range[1] for each in readings],
            **columns_of(names, values),
            **columns_of(deviation_columns(names), sd),
        }

    def _certificates(self) -> dict[str, _Marks]:
        """Return marks by camera name and mark name."""
        cameras: dict[int, str] = {}
        for each in self.readings:
            camera = self.camera_of[each.photo]
            if cameras.setdefault(id(each.mark), camera) != camera:
                raise InputError(phrase("plain.mark-of-cameras", name=each.mark.name))
        found: dict[str, _Marks] = {}
        for known in self.together:
            marks = [each for each in known.joined if isinstance(each, Mark)]
            if not marks:
                continue
            own = {cameras[id(mark)] for mark in marks if id(mark) in cameras}
            if len(own) != 1 or len(marks) < len(known.joined):
                raise InputError(phrase("plain.known-marks", name=known.name))
            _take(found.setdefault(own.pop(), _Marks()), known, marks)
        for each in self.readings:
            if not any(each.mark is mark for own in found.values() for mark in own.marks.values()):
                _put(found.setdefault(cameras[id(each.mark)], _Marks()), cameras[id(each.mark)], each.mark)
        return {camera: _named(camera, own) for camera, own in found.items()}

    def _fiducials(self) -> dict[str, Any]:
        rows = [
            (camera, name, mark, own.sd.get(name))
            for camera, own in self.certificates.items()
            for name, mark in own.marks.items()
        ]
        sd = np.array([np.full(2, np.nan) if own is None else own for *_, own in rows]).reshape(-1, 2)
        places = np.array([mark.position[:2] for _, _, mark, _ in rows]).reshape(-1, 2)
        return {
            "camera": [row[0] for row in rows],
            "fiducial": [row[1] for row in rows],
            **columns_of(("x", "y", "sd_x", "sd_y"), np.hstack([places, sd])),
        }

    def _images(self) -> dict[str, Any]:
        names = ("column", "row") if self.pixels else ("x", "y")
        found = np.array([each.observed[:2] for each in self.readings]).reshape(-1, 2)
        precision = np.array([each.precision for each in self.readings]).reshape(-1, 2, 2)
        if precision[:, 0, 1].any():
            raise InputError(phrase("plain.correlated-readings"))
        sd = np.sqrt(np.diagonal(precision, axis1=1, axis2=2))
        return {
            "photo": [each.photo for each in self.readings],
            "fiducial": [self.by_mark[id(each.mark)] for each in self.readings],
            **columns_of(names, found),
            **columns_of(deviation_columns(names), sd),
        }


def _of(observations: Sequence[Observation], kind: type[_Seen]) -> Iterator[_Seen]:
    return (each for each in observations if isinstance(each, kind))


def _joined(machine: Machine, what: str) -> Floats:
    """Return (21,) numbers of a scanner and its curves; 0 without curves."""
    own = [getattr(each, what)[:3] for each in (machine.scanner, *machine.curves)]
    return np.concatenate([*own, np.zeros(3 + len(CURVES) - 3 * len(own))])


def _words(machine: Machine, unknown: Unknown) -> Sequence[str]:
    """Return covariance table names of a scanner's or curve's components."""
    at = [*map(id, machine.curves)].index(id(unknown)) if unknown in machine.curves else -1
    return ("Sx", "Sy", "alpha") if at < 0 else CURVES[3 * at : 3 * at + 3]


def _own_deviations(machine: Machine) -> Floats:
    """Return (21,) standard deviations; NaN for components with a covariance matrix."""
    found = _joined(machine, "deviations")
    joined = set() if machine.known is None else {*map(id, machine.known.joined)}
    for k, each in enumerate((machine.scanner, *machine.curves)):
        if id(each) in joined:
            found[3 * k : 3 * k + 3] = np.nan
    return found


def _pattern_cells(film: Film) -> dict[str, Any]:
    pattern = film.pattern
    if pattern is None:
        return {"pattern": "none"}
    columns = GRID if pattern.kind == "grid" else ("half_format_mm",)
    if isinstance(pattern, Reseau):
        cells = dict(zip((*columns, "sd_w1", "sd_w2"), [*pattern.numbers, *pattern.sd], strict=True))  # type: ignore[misc]
        return {"pattern": LOCAL, **cells, "sd_smooth": pattern.smooth}
    sd = [each.deviations for each in pattern.weights]
    if any(each.position.any() for each in pattern.weights):
        raise InputError(phrase("plain.pattern-weights", pattern=pattern.kind))
    if pattern.kind == "grid":
        if any((each != sd[0]).any() for each in sd):
            raise InputError(phrase("plain.grid-deviations"))
        sd = sd[:1]
    cells = dict(zip(columns, np.asarray(pattern.numbers, dtype=float).tolist(), strict=True))
    weights = {f"sd_w{k}": value for k, value in enumerate(np.concatenate(sd).tolist(), 1)}
    return {"pattern": pattern.kind, **cells, **weights}


def _take(own: _Marks, known: KnownTogether, marks: Sequence[Mark]) -> None:
    """Add marks with a joint prior, or a single one."""
    full = len(marks) > 1 or known.precision[0, 1] != 0
    if own.covariance is not None or (full and own.marks):
        raise InputError(phrase("plain.one-certificate", name=known.name))
    own.marks |= {mark.name: mark for mark in marks}
    if full:
        own.covariance = known.precision
    else:
        own.sd[marks[0].name] = np.sqrt(np.diag(known.precision))


def _put(own: _Marks, camera: str, mark: Mark) -> None:
    """Add a mark whose only prior is its own standard deviation."""
    sd = mark.deviations
    if own.covariance is not None or not (np.isfinite(sd).all() and (sd > 0).all()):
        raise InputError(phrase("plain.no-certificate", mark=mark.name, camera=camera))
    own.marks[mark.name], own.sd[mark.name] = mark, sd


def _named(camera: str, own: _Marks) -> _Marks:
    """Return the marks of a camera by table name: without the camera name."""

    def plain(name: str) -> str:
        return name.removeprefix(f"{camera} ")

    return _Marks(
        {plain(name): mark for name, mark in own.marks.items()},
        {plain(name): sd for name, sd in own.sd.items()},
        own.covariance,
    )
