"""Tables of films: scanners, films, fiducial marks, and certificate files."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from photogram.arguments.arrays import is_covariance
from photogram.arguments.types import Floats
from photogram.errors import ContradictionError, InputError, message_of
from photogram.film.distances import with_datum
from photogram.film.marks import SD_PLACE, marks_in_use
from photogram.formats.plain.schema import CURVES, DEVICE, GRID, TABLES, deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, made
from photogram.formats.plain.unknowns import Covariances
from photogram.io.column_table import ColumnTable
from photogram.io.places import Place, at_place
from photogram.io.toml import day_of
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.network.films import (
    Film,
    Mark,
    Pattern,
    Readings,
    Reseau,
    Roll,
    Scanner,
    ScannerCurve,
    Weights,
)
from photogram.network.observations import FILM, Fiducial, KnownFilm, KnownTogether, Observation
from photogram.network.unknowns import Unknown
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film import Certificate

BENDS = {"bilinear": ("h1", "h2"), "projective": ("g1", "g2")}  # Parameters of models that are not affine
_NUMBERS = (*DEVICE, *CURVES)  # Numbers of a scanner
_WRITTEN = ("Sx", "Sy", "alpha_rad", *CURVES)
_WORDS = ("Sx", "Sy", "alpha", *CURVES)  # Their names in the table of covariances
_READINGS = ("scanner", "pitch_mm", "origin_column", "origin_row")
UM = 1e-3  # In millimetres
KNOWN = 1e-6  # Standard deviation of fixed components in a singular covariance (mm, a ratio, radians)
LOCAL = "local"  # The pattern of films with a separate grid for each photo


@dataclass(frozen=True)
class Machine:
    """A scanner: its unknowns, the definition of its readings, and its prior."""

    scanner: Scanner
    curves: tuple[ScannerCurve, ...]
    readings: Readings
    known: KnownTogether | None

    def words(self, joined: Sequence[Unknown]) -> list[str]:
        """Return the names of components in the table of covariances."""
        rows = {id(each): 3 * k for k, each in enumerate((self.scanner, *self.curves))}
        return [word for each in joined for word in _WORDS[rows[id(each)] : rows[id(each)] + 3]]

    def held(self) -> Machine:
        curves = tuple(each.replace(sd=0.0) for each in self.curves)
        return Machine(self.scanner.replace(sd=0.0), curves, self.readings, None)


class FilmKind(NamedTuple):
    """A row of the table of films: its roll, and priors of its films."""

    roll: Roll
    model: str
    sd_size: tuple[float, float, float]
    sd_bend: tuple[float, ...]
    pattern: Callable[[str], Pattern | None] = lambda _: None  # Of a photo, by its name


def read_scanners(tables: Tables, covariances: Covariances) -> dict[str, Machine]:
    table, found = tables.rows("scanners"), {}
    for row, given in enumerate(tables.records("scanners")):
        name, cells = given["scanner"], TABLES["scanners"].defaults | given
        # Origin of the polynomials, mm from the origin of readings, and covariance of all numbers
        zero, covariance = np.zeros(2), None
        if "calibration" in given:
            for column in (*_NUMBERS, "hx", "hy", *deviation_columns(_NUMBERS)):
                if column in given:
                    raise table.cell_error(row, column, "plain.calibrated-scanner", scanner=name)
            if covariances.names("scanner", name):
                raise table.error(row, phrase("plain.scanner-covariance", scanner=name))
            path = table.path.parent / given["calibration"]
            calibrated, zero, covariance = _calibrated(path, tables.messages)
            cells |= calibrated
        # Readings count rows downwards by default.
        pitch, *origin, down = *(cells[each] for each in _READINGS[1:]), cells.get("rows_down", True)
        zero = zero / pitch * [1.0, -1.0 if down else 1.0] + origin
        half = cells["hx"], cells["hy"]
        readings = made(table, row, Readings, pitch, tuple(zero.tolist()), down, half)
        found[name] = _machine(table, row, cells, readings, covariance, covariances)
    return found


def _calibrated(path: Path, messages: list[Message]) -> tuple[dict[str, float], Floats, Floats]:
    """Return cells, origin and covariance (mm) of a comparator calibration file, or of its correction.

    Fixed components of a singular covariance matrix get a standard deviation of 0.001 um.
    """
    from photogram.comparator.correction import Correction
    from photogram.comparator.fits import Frame

    own = Correction.read(path)
    frame = Frame.metres() if own.polynomial is None else own.polynomial.frame
    scaled = np.zeros(18) if own.polynomial is None else own.polynomial.scaled_um.ravel()
    unit = np.array([1.0] * 3 + [UM] * 18)
    values = np.array([own.scale_x, own.scale_y, own.nonorthogonality_rad, *scaled.tolist()]) * unit
    covariance = own.covariance * unit * unit[:, np.newaxis]
    known = np.repeat((np.diag(covariance).reshape(7, 3) > 0).any(axis=1), 3)
    part = covariance[np.ix_(known, known)]
    if known.any() and not is_covariance(part):
        covariance = covariance + np.diag(np.where(known, KNOWN**2, 0.0))
        messages.append(Message(phrase("plain.singular-scanner", sd=KNOWN), path))
    cells = columns_of(_NUMBERS, values) | columns_of(("hx", "hy"), np.array(frame.half_range_um) * UM)
    cells |= columns_of(deviation_columns(_NUMBERS), np.where(known, np.inf, 0.0))
    zero = np.asarray(np.linalg.solve(own.matrix, frame.centre_um), dtype=float) * UM
    return cells, zero, covariance


def _machine(
    table: ColumnTable,
    row: int,
    cells: Mapping[str, Any],
    readings: Readings,
    calibrated: Floats | None,
    covariances: Covariances,
) -> Machine:
    """Return a scanner with its curves, if any, and their joint prior."""
    name, words = cells["scanner"], [word.lower() for word in _WORDS]
    values, sd = (
        np.array([cells[each] for each in names]) for names in (_NUMBERS, deviation_columns(_NUMBERS))
    )
    named = covariances.names("scanner", name)
    if calibrated is not None:
        named = {word for word, free in zip(words, np.isinf(sd), strict=True) if free}
    # By the index of the first of their three numbers
    parts: dict[int, tuple[type[Unknown], str]] = {0: (Scanner, name)}
    if values[3:].any() or sd[3:].any() or named - set(words[:3]):
        parts |= {3 * k: (ScannerCurve, f"{name} {k}") for k in range(1, 7)}
    # A covariance matrix contains all three parameters of an unknown, or none.
    joined = [at for at in parts if named & set(words[at : at + 3])] or [0] * bool(named)
    rows = [at + k for at in joined for k in range(3)]
    sd[rows] = np.inf
    unknowns: dict[int, Any] = {
        at: made(table, row, kind, title, values[at : at + 3], sd[at : at + 3])
        for at, (kind, title) in parts.items()
    }
    known = None
    if joined:
        if calibrated is None:
            covariance = covariances.over("scanner", name, [words[k] for k in rows])
        else:
            covariance = calibrated[np.ix_(rows, rows)]
        together = [unknowns[at] for at in joined]
        known = made(table, row, KnownTogether, "scanner", together, covariance=covariance)
    scanner, *curves = unknowns.values()
    return Machine(scanner, tuple(curves), readings, known)


def machines_of(films: Iterable[Film], together: Iterable[KnownTogether]) -> dict[str, Machine]:
    """Return the scanners of films by name; `together` contains their priors."""
    known = {id(one): each for each in together for one in each.joined}
    found: dict[str, Machine] = {}
    for film in films:
        own = Machine(film.scanner, tuple(film.curves), film.readings, None)
        priors = [known[id(each)] for each in (own.scanner, *own.curves) if id(each) in known]
        first = found.setdefault(film.scanner.name, replace(own, known=priors[0]) if priors else own)
        same = first.scanner is own.scanner and first.readings == own.readings
        if not same or [*map(id, first.curves)] != [*map(id, own.curves)]:
            raise InputError(phrase("plain.same-scanners", name=own.scanner.name))
    return found


def scanner_cells(machine: Machine) -> dict[str, Any]:
    """Return the row of a scanner; components with a covariance matrix have no standard deviation."""
    own, joined = machine.readings, {*map(id, machine.known.joined if machine.known else ())}
    cells = dict(zip(_READINGS, (machine.scanner.name, own.pitch, *own.origin), strict=True))
    cells |= {"rows_down": own.down, "hx": own.half_range[0], "hy": own.half_range[1]}
    for k, each in enumerate((machine.scanner, *machine.curves)):
        names = _WRITTEN[3 * k : 3 * k + 3]
        sd = np.full(3, np.nan) if id(each) in joined else each.deviations[:3]
        cells |= columns_of(names, each.position[:3]) | columns_of(deviation_columns(names), sd)
    return cells


def read_films(tables: Tables, names: Sequence[str], default: str) -> Mapping[str, FilmKind]:
    """Read the table of films; films without a row have defaults."""
    table, defaults = tables.rows("films"), {"model": default, **TABLES["films"].defaults}
    found = {name: _film_kind(name, defaults) for name in names}
    for row, given in enumerate(tables.records("films")):
        cells = defaults | given
        kind = made(table, row, _film_kind, cells["film"], cells)
        found[cells["film"]] = kind._replace(pattern=_pattern(table, row, cells))
    return found


def _film_kind(name: str, cells: Mapping[str, Any]) -> FilmKind:
    bends = tuple(cells[f"sd_{each}"] for each in BENDS.get(cells["model"], ()))
    size = cells["sd_photo_m"], cells["sd_b1"], cells["sd_b2"]
    return FilmKind(Roll(name, cells["m"], cells["sd_m"]), cells["model"], size, bends)


def _pattern(table: ColumnTable, row: int, cells: Mapping[str, Any]) -> Callable[[str], Pattern | None]:
    """Return the pattern of photos by name: one for all of a film, or a separate grid for each."""
    kind, film = cells["pattern"], cells["film"]
    if kind == "none":
        return lambda _: None
    names = GRID if kind in ("grid", LOCAL) else ("half_format_mm",)
    weights = [f"sd_w{k}" for k in range(1, 11 if kind == "ebner" else 3)]
    for column in (*names, *weights):
        if column not in cells:
            raise table.cell_error(row, column, "plain.pattern", pattern=kind)
    values, sd = (np.array([cells[column] for column in own]) for own in (names, weights))
    if kind == LOCAL:
        smooth = cells.get("sd_smooth", math.inf)
        return lambda photo: made(table, row, Reseau, photo, values, sd, smooth)
    if kind == "grid":
        own = [Weights(f"{film} node {k}", 0.0, sd) for k in range(1, int(values[4]) * int(values[5]) + 1)]
    else:
        titles = [film] if len(sd) == 2 else [f"{film} {k}" for k in range(0, len(sd), 2)]
        own = [Weights(title, 0.0, pair) for title, pair in zip(titles, sd.reshape(-1, 2), strict=True)]
    pattern = made(table, row, Pattern, kind, values, own)
    return lambda _: pattern


def roll_of(film: Film, known: KnownFilm | None) -> Roll | None:
    return known.roll if film.roll is None and known is not None else film.roll


def film_cells(film: Film, known: KnownFilm | None) -> dict[str, Any]:
    """Return the row of a film with its prior, which is not in the row if it is a covariance matrix."""
    fixed, roll = film.size.deviations == 0, roll_of(film, known)
    conformal = film.bend is None and bool(fixed[1:].all())
    bend = "projective" if film.projective else "bilinear"
    model = "conformal" if conformal else "affine" if film.bend is None else bend
    cells: dict[str, Any] = {"film": "film" if roll is None else roll.name, "model": model}
    if roll is not None:
        cells |= {"m": float(roll.position[0]), "sd_m": float(roll.deviations[0])}
    sd: dict[str, float | None] = dict(zip(FILM[3:], np.where(fixed, 0.0, np.inf).tolist(), strict=True))
    if known is not None and known.covariance is not None:
        if tuple(known.known) != FILM:
            raise InputError(phrase("plain.film-covariance", name=known.name, names=list(FILM)))
        sd = {name: None if own else own for name, own in sd.items()}
    elif known is not None:
        if not set(known.known) <= set(sd) or np.any(known.values):
            raise InputError(phrase("plain.film-priors", name=known.name))
        sd |= zip(known.known, np.sqrt(np.diag(known.precision)).tolist(), strict=True)
    sd |= {"b1": None, "b2": None} if conformal else {}
    cells |= {"sd_photo_m": sd["m"], "sd_b1": sd["b1"], "sd_b2": sd["b2"]}
    if film.bend is not None:
        cells |= columns_of(deviation_columns(BENDS[bend]), film.bend.deviations)
    if (pattern := film.pattern) is None:
        return cells | {"pattern": "none"}
    cells["pattern"] = LOCAL if isinstance(pattern, Reseau) else pattern.kind
    columns = GRID if pattern.kind == "grid" else ("half_format_mm",)
    cells |= columns_of(columns, np.asarray(pattern.numbers, dtype=float))
    if isinstance(pattern, Reseau):
        weights = np.asarray(pattern.sd)
        cells["sd_smooth"] = pattern.smooth
    else:
        weights = np.array([each.deviations for each in pattern.weights])
        if any(each.position.any() for each in pattern.weights):
            raise InputError(phrase("plain.pattern-weights", pattern=pattern.kind))
        if pattern.kind == "grid" and (weights != weights[0]).any():
            raise InputError(phrase("plain.grid-deviations"))
        weights = weights[0] if pattern.kind == "grid" else weights.ravel()
    return cells | {f"sd_w{k}": value for k, value in enumerate(weights.tolist(), 1)}


_MODELS = ("brown_forward", "brown")


def read_certificates(tables: Tables) -> dict[str, Certificate]:
    table = tables.read("photos")
    if table is None or (not tables.settings.certificates and "certificate" not in table):
        return {}
    listed = tables.rows("cameras")
    only = listed.texts("camera")[0] if listed.count == 1 else ""
    files = dict[str, Path]()
    flown = dict[str, dict[date | None, int]]()  # First row of each date of a camera
    columns = (table.texts(name) for name in ("film", "camera", "certificate", "flown"))
    for row, (film, name, file, text) in enumerate(zip(*columns, strict=True)):
        if not film:
            continue
        camera = name or only
        try:
            day = day_of(text) if text else tables.settings.flown
        except ValueError:
            raise table.cell_error(row, "flown", "error.day", value=text) from None
        flown.setdefault(camera, {}).setdefault(day, row)
        if file and files.setdefault(camera, table.path.parent / file) != table.path.parent / file:
            fields = {"camera": camera, "certificate": files[camera].name}
            raise table.cell_error(row, "certificate", "plain.other-certificate", **fields)
    from photogram.film import Certificate  # imported on demand
    from photogram.film.years import age_remark, changed_remark

    several = {
        camera: [Certificate.read(path, None if path.suffix.lower() == ".toml" else camera)]
        for camera, path in files.items()
    }
    several |= _of_settings(tables, [camera for camera in flown if camera not in files])
    certificates = {camera: _valid(table, camera, own, flown[camera]) for camera, own in several.items()}
    for camera, own in certificates.items():
        remarks: list[str | Phrase] = list(own.told())
        days = sorted(filter(None, flown[camera]))
        if not days or len(several[camera]) > 1 or own.verdict.exit_code():
            dated = phrase("plain.undated") if own.day is None else str(own.day)
            fields = {"n": len(several[camera]), "day": dated, "verdict": str(own.verdict.headline)}
            remarks.insert(0, phrase("plain.certificate", **fields))
        for day in sorted({*days[:1], *days[-1:]}):
            remarks += [age_remark(own, day), changed_remark(own, several[camera], day)]
        for message in filter(None, remarks):
            tables.remark("error.at", own.file, what=f"camera {camera}", message=message)
    return certificates


def _valid(
    table: ColumnTable, camera: str, several: Sequence[Certificate], flown: Mapping[date | None, int]
) -> Certificate:
    from photogram.film.years import valid_certificate

    found: list[Certificate] = []
    for day, row in flown.items():
        try:
            found.append(valid_certificate(several, day))
        except InputError as error:
            if error.file or isinstance(error, ContradictionError):
                raise
            message = phrase("error.at", what=f"camera {camera}", message=message_of(error))
            raise table.error(row, message) from None
        if found[-1] is not found[0]:
            fields = {"camera": camera, "first": str(found[0].day), "second": str(found[-1].day)}
            raise table.error(row, phrase("plain.two-certificates", day=str(day), **fields))
    return found[0]


def _of_settings(tables: Tables, cameras: Sequence[str]) -> dict[str, list[Certificate]]:
    """Return the certificates of a project by camera: of the only camera, or by name."""
    from photogram.film import Certificate

    found: dict[str, list[Certificate]] = {}
    for path in tables.settings.certificates:
        if path.suffix.lower() != ".toml":
            for camera in cameras:
                found.setdefault(camera, []).append(Certificate.read(path, camera))
            continue
        own = Certificate.read(path)
        if own.name not in cameras and len(cameras) != 1:
            message = phrase("plain.certificate-camera", camera=own.name, names=list(cameras))
            raise InputError(message, file=tables.settings.path)
        found.setdefault(own.name if own.name in cameras else cameras[0], []).append(own)
    for camera, several in found.items():
        if len(names := {own.name for own in several}) > 1:
            message = phrase("plain.certificates-of", camera=camera, names=sorted(names))
            raise InputError(message, file=tables.settings.path)
    return found


def certified(tables: Tables, name: str, model: str, own: Certificate) -> Camera:
    if (chosen := model or _MODELS[0]) not in _MODELS:
        fields = {"camera": name, "model": chosen, "models": list(_MODELS)}
        raise InputError(phrase("plain.certificate-model", **fields), file=own.file)
    if tables.settings.image != "mm":
        raise InputError(phrase("plain.certificate-unit", camera=name), file=own.file)
    return own.camera(chosen).replace(name=name)  # type: ignore[arg-type]


def definite(tables: Tables, camera: str, xy: Floats, covariance: Floats, file: Path | None) -> Floats:
    """Return a covariance matrix of all marks of a camera with a datum."""
    with at_place(Place(file), f"camera {camera}"):
        found, free = with_datum(xy, covariance)
    if free:
        tables.remark("plain.distances-only", file, camera=camera, n=free)
    return found


@dataclass
class Marks:
    """The marks of a camera by name, and their standard deviations (mm) or joint covariance matrix."""

    camera: str
    marks: dict[str, Mark] = field(default_factory=dict)
    sd: dict[str, Floats] = field(default_factory=dict)
    covariance: Floats | None = None  # (2n, 2n) of all marks

    def add(self, name: str, xy: Floats) -> None:
        """Add a mark at a position (2,), mm."""
        self.marks[name] = Mark(f"{self.camera} {name}", xy, np.inf)

    @property
    def words(self) -> list[str]:
        """Coordinates of the marks in the table of covariances."""
        return [f"{name}.{axis}" for name in self.marks for axis in "xy"]

    def known(self, tables: Tables, read: Collection[str], covariances: Covariances) -> list[Observation]:
        """Return prior observations: of all marks together, or of each mark in `read`."""
        words, covariance = [word.lower().replace("_", " ") for word in self.words], self.covariance
        if (given := covariances.over("fiducials", self.camera, words, singular=True)) is not None:
            xy = np.array([mark.position[:2] for mark in self.marks.values()])
            covariance = definite(tables, self.camera, xy, given, tables.settings.tables["covariances"])
        if covariance is not None:
            return [KnownTogether("certificate", list(self.marks.values()), covariance=covariance)]
        return [
            KnownTogether("certificate", [mark], sd=self.sd[name])
            for name, mark in self.marks.items()
            if name in read
        ]

    def rows(self) -> Iterator[dict[str, Any]]:
        for name, mark in self.marks.items():
            sd = self.sd.get(name, np.full(2, np.nan))
            place = columns_of(("x", "y"), mark.position[:2])
            yield {"camera": self.camera, "fiducial": name, **place, **columns_of(("sd_x", "sd_y"), sd)}


def read_fiducials(
    tables: Tables, cameras: Collection[str], certificates: Mapping[str, Certificate]
) -> dict[str, Marks]:
    found, table = dict[str, Marks](), tables.rows("fiducials")
    xy = table.given(("x", "y"))
    sd = tables.deviations(table, "fiducials", ("sd_x", "sd_y"), SD_PLACE)
    for (camera, name), row in marks_in_use(table, cameras).items():
        own = found.setdefault(camera, Marks(camera))
        own.add(name, xy[row])
        own.sd[name] = sd[row]
    for camera, certificate in certificates.items():
        if camera in found:
            file = tables.settings.tables["fiducials"]
            raise InputError(phrase("plain.marks-twice", camera=camera), file=file)
        marks, found[camera] = certificate.fiducials(), (own := Marks(camera))
        for name, place in zip(marks.names, marks.xy, strict=True):
            own.add(name, place)
        if (marks.covariance - np.diag(np.diag(marks.covariance))).any():
            own.covariance = definite(tables, camera, marks.xy, marks.covariance, certificate.file)
        else:
            own.sd |= zip(marks.names, np.sqrt(np.diag(marks.covariance)).reshape(-1, 2), strict=True)
    return found


def marks_of(
    readings: Iterable[Fiducial], together: Iterable[KnownTogether], camera_of: Mapping[str, str]
) -> dict[str, Marks]:
    """Return the marks of readings by camera name, with their priors, from the cameras of photos."""
    cameras: dict[Mark, str] = {}
    for each in readings:
        camera = camera_of[each.photo]
        if cameras.setdefault(each.mark, camera) != camera:
            raise InputError(phrase("plain.mark-of-cameras", name=each.mark.name))
    others, found = dict(cameras), dict[str, Marks]()
    for known in together:
        marks = [each for each in known.joined if isinstance(each, Mark)]
        if not marks:
            continue
        of = {cameras[mark] for mark in marks if mark in cameras}
        if len(of) != 1 or len(marks) < len(known.joined):
            raise InputError(phrase("plain.known-marks", name=known.name))
        (camera,) = of
        own, full = found.setdefault(camera, Marks(camera)), len(marks) > 1 or known.precision[0, 1] != 0
        if own.covariance is not None or (full and own.marks):
            raise InputError(phrase("plain.one-certificate", name=known.name))
        names = [mark.name.removeprefix(f"{camera} ") for mark in marks]
        own.marks |= zip(names, marks, strict=True)
        if full:
            own.covariance = known.precision
        else:
            own.sd[names[0]] = np.sqrt(np.diag(known.precision))
        others = {mark: camera for mark, camera in others.items() if mark not in marks}
    # The only prior of other marks is their own standard deviation.
    for mark, camera in others.items():
        own, sd = found.setdefault(camera, Marks(camera)), mark.deviations
        if own.covariance is not None or not (np.isfinite(sd).all() and (sd > 0).all()):
            raise InputError(phrase("plain.no-certificate", mark=mark.name, camera=camera))
        name = mark.name.removeprefix(f"{camera} ")
        own.marks[name], own.sd[name] = mark, sd
    return found
