"""The tables of scanners and of films: shared properties of the films of photos."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.arrays import is_covariance
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.schema import CURVES, DEVICE, GRID, TABLES, deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, made
from photogram.formats.plain.unknowns import Covariances
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass, field, replace
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
        """Return the scanner with fixed parameters."""
        curves = tuple(each.replace(sd=0.0) for each in self.curves)
        return Machine(self.scanner.replace(sd=0.0), curves, self.readings, None)


@dataclass(frozen=True)
class FilmKind:
    """A row of the table of films: its roll, and priors of its films."""

    roll: Roll
    model: str
    sd_size: tuple[float, float, float]
    sd_bend: tuple[float, float]
    pattern: Pattern | None
    reseau: Callable[..., Reseau] | None = None
    """Function that returns the pattern of a photo from its name and known shifts."""


def read_scanners(tables: Tables, covariances: Covariances) -> dict[str, Machine]:
    """Read the table of scanners."""
    table, found = tables.rows("scanners"), {}
    for row, given in enumerate(tables.records("scanners")):
        name, cells = given["scanner"], TABLES["scanners"].defaults | given
        if "calibration" in given:
            for column in (*_NUMBERS, "hx", "hy", *deviation_columns(_NUMBERS)):
                if column in given:
                    raise table.cell_error(row, column, "plain.calibrated-scanner", scanner=name)
            if covariances.names("scanner", name):
                raise table.error(row, phrase("plain.scanner-covariance", scanner=name))
            numbers = _calibrated(table.path.parent / given["calibration"], tables.messages)
        else:
            columns = _NUMBERS, deviation_columns(_NUMBERS), ("hx", "hy")
            numbers = _Numbers(*(np.array([cells[each] for each in names]) for names in columns))
        # Readings count rows downwards by default.
        pitch, *origin, down = *(cells[each] for each in _READINGS[1:]), cells.get("rows_down", True)
        zero = numbers.zero / pitch * [1.0, -1.0 if down else 1.0] + origin
        counted = pitch, tuple(zero.tolist()), down, tuple(numbers.half.tolist())
        readings = made(table, row, Readings, *counted)
        found[name] = _machine(table, row, name, numbers, readings, covariances)
    return found


@dataclass(frozen=True)
class _Numbers:
    """Sx, Sy, alpha and 18 coefficients of a scanner (mm), and their prior."""

    values: Floats  # (21,) values; those with a covariance are estimated
    sd: Floats
    half: Floats  # (2,) half ranges of the polynomials, mm
    # (2,) origin of the polynomials, mm from the origin of readings
    zero: Floats = field(default_factory=lambda: np.zeros(2))
    covariance: Floats | None = None  # (21, 21); None without


def _calibrated(path: Path, messages: list[Message]) -> _Numbers:
    """Return the contents of a comparator calibration file, or of its correction.

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
    zero = np.asarray(np.linalg.solve(own.matrix, frame.centre_um), dtype=float) * UM
    return _Numbers(
        values, np.where(known, np.inf, 0.0), np.array(frame.half_range_um) * UM, zero, covariance
    )


def _machine(
    table: ColumnTable, row: int, name: str, numbers: _Numbers, readings: Readings, covariances: Covariances
) -> Machine:
    """Return a scanner with its curves, if any, and their joint prior."""
    words, named = [word.lower() for word in _WORDS], covariances.names("scanner", name)
    # By the index of the first of their three numbers
    parts: dict[int, tuple[type[Unknown], str]] = {0: (Scanner, name)}
    if numbers.values[3:].any() or numbers.sd[3:].any() or named - set(words[:3]):
        parts |= {3 * k: (ScannerCurve, f"{name} {k}") for k in range(1, 7)}
    sd = numbers.sd.copy()
    if numbers.covariance is not None:
        joined = [at for at in parts if np.isinf(sd[at])]
    else:
        # A covariance matrix contains all three parameters of an unknown, or none.
        joined = [at for at in parts if named & set(words[at : at + 3])] or [0] * bool(named)
    rows = [at + k for at in joined for k in range(3)]
    sd[rows] = np.inf
    unknowns: dict[int, Unknown] = {
        at: made(table, row, kind, title, numbers.values[at : at + 3], sd[at : at + 3])
        for at, (kind, title) in parts.items()
    }
    if numbers.covariance is None:
        covariance = covariances.over("scanner", name, [words[k] for k in rows])
    else:
        covariance = numbers.covariance[np.ix_(rows, rows)] if rows else None
    known = None
    if covariance is not None:
        together = [unknowns[at] for at in joined]
        known = made(table, row, KnownTogether, "scanner", together, covariance=covariance)
    scanner, *curves = unknowns.values()
    assert isinstance(scanner, Scanner)
    return Machine(scanner, tuple(each for each in curves if isinstance(each, ScannerCurve)), readings, known)


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
        found[cells["film"]] = kind = made(table, row, _film_kind, cells["film"], cells)
        if cells["pattern"] == LOCAL:
            numbers = *_pattern_numbers(table, row, cells, GRID, 2), cells.get("sd_smooth", math.inf)
            found[cells["film"]] = replace(kind, reseau=partial(_reseau, table, row, numbers))
        elif cells["pattern"] != "none":
            found[cells["film"]] = replace(kind, pattern=_pattern(table, row, cells))
    return found


def _film_kind(name: str, cells: Mapping[str, Any]) -> FilmKind:
    """Return the priors of a film without a pattern."""
    bends = [cells[f"sd_{each}"] for each in BENDS.get(cells["model"], ())]
    roll = Roll(name, cells["m"], cells["sd_m"])
    size = cells["sd_photo_m"], cells["sd_b1"], cells["sd_b2"]
    return FilmKind(roll, cells["model"], size, (bends[0], bends[1]) if bends else (0.0, 0.0), None)


def _pattern(table: ColumnTable, row: int, cells: Mapping[str, Any]) -> Pattern:
    kind, film = cells["pattern"], cells["film"]
    count = 10 if kind == "ebner" else 2
    names = GRID if kind == "grid" else ("half_format_mm",)
    values, sd = _pattern_numbers(table, row, cells, names, count)
    if kind == "grid":
        nodes = int(values[4]) * int(values[5])
        own = [Weights(f"{film} node {k}", 0.0, sd) for k in range(1, nodes + 1)]
    else:
        own = [Weights(film if count == 2 else f"{film} {k}", 0.0, sd[k : k + 2]) for k in range(0, count, 2)]
    return made(table, row, Pattern, kind, values, own)


def _reseau(
    table: ColumnTable, row: int, numbers: Sequence[Any], photo: str, shifts: Floats | None = None
) -> Reseau:
    free = made(table, row, Reseau, photo, *numbers)
    return free if shifts is None else free.with_shifts(shifts)


def _pattern_numbers(
    table: ColumnTable, row: int, cells: Mapping[str, Any], columns: Sequence[str], count: int
) -> list[Floats]:
    """Return the numbers of a pattern and standard deviations of its weights."""
    weights = [f"sd_w{k}" for k in range(1, count + 1)]
    for column in (*columns, *weights):
        if column not in cells:
            raise table.cell_error(row, column, "plain.pattern", pattern=cells["pattern"])
    return [np.array([cells[column] for column in own]) for own in (columns, weights)]


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
