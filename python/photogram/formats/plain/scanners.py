"""The tables of scanners and of films: shared properties of the films of photos."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from photogram.arguments.arrays import is_covariance
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.schema import CURVES, DEVICE, GRID, TABLES, deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, made
from photogram.formats.plain.unknowns import Covariances
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.films import (
    Film,
    Pattern,
    Readings,
    Reseau,
    Roll,
    Scanner,
    ScannerCurve,
    Weights,
)
from photogram.network.observations import KnownTogether
from photogram.network.unknowns import Unknown
from photogram.words import phrase

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


def film_cells(film: Film, roll: Roll | None, sd: Mapping[str, float | None]) -> dict[str, Any]:
    """Return the row of a film on a roll, with standard deviations of its size, m, b1 and b2."""
    fixed = film.size.deviations == 0
    conformal = film.bend is None and bool(fixed[1:].all())
    bend = "projective" if film.projective else "bilinear"
    model = "conformal" if conformal else "affine" if film.bend is None else bend
    cells: dict[str, Any] = {} if roll is None else {"film": roll.name}
    cells |= {"model": model}
    if roll is not None:
        cells |= {"m": float(roll.position[0]), "sd_m": float(roll.deviations[0])}
    cells |= {"sd_photo_m": sd["m"], "sd_b1": sd["b1"], "sd_b2": sd["b2"]}
    if conformal:
        cells |= {"sd_b1": None, "sd_b2": None}
    if film.bend is not None:
        cells |= columns_of(deviation_columns(BENDS[bend]), film.bend.deviations)
    pattern = film.pattern
    if pattern is None:
        return cells | {"pattern": "none"}
    local = isinstance(pattern, Reseau)
    cells["pattern"] = LOCAL if local else pattern.kind
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
