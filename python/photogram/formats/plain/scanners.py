"""The tables of scanners and of films: what the films of photos have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from photogram.formats.plain.covariances import Covariances
from photogram.formats.plain.shared import made
from photogram.formats.plain.tables import Tables
from photogram.io.delimited import ColumnTable
from photogram.messages import nearest, quoted
from photogram.network.films import PATTERNS, Pattern, Readings, Roll, Scanner, ScannerCurve, Weights
from photogram.network.observations import KnownTogether, Observation
from photogram.network.unknowns import Unknown

__all__ = ["BENDS", "CURVES", "DEVICE", "FilmKind", "Machine", "read_films", "read_scanners"]

DEVICE = ("sx", "sy", "alpha_rad")
"""Columns of scales and obliqueness of a scanner."""
CURVES = tuple(f"{axis}{letter}" for axis in "xy" for letter in "abcdefghj")
"""Those of the coefficients of its polynomials."""
BENDS = {"bilinear": ("h1", "h2"), "projective": ("g1", "g2")}
"""What is not affine in films, by their model."""
_BEND_SD = {"bilinear": 5e-7, "projective": 2e-7}
_WEIGHTS = tuple(f"w{k}" for k in range(1, 11))
_GRID = ("grid_x", "grid_y", "grid_dx", "grid_dy", "grid_columns", "grid_rows")
MODELS = ("affine", "conformal", "bilinear", "projective")


@dataclass(frozen=True)
class Machine:
    """A scanner: its unknowns, what its readings count, and what is known of it."""

    scanner: Scanner
    curves: tuple[ScannerCurve, ...]
    readings: Readings
    known: Observation | None

    def held(self) -> Machine:
        """Return it as errorless."""
        return Machine(
            self.scanner.replace(sd=0.0),
            tuple(each.replace(sd=0.0) for each in self.curves),
            self.readings,
            None,
        )


@dataclass(frozen=True)
class FilmKind:
    """What the table of films says of one: its roll, and how the films of its photos are known."""

    roll: Roll
    model: str
    sd_size: tuple[float, float, float]
    sd_bend: tuple[float, float]
    pattern: Pattern | None


def read_scanners(tables: Tables, covariances: Covariances) -> dict[str, Machine]:
    """Read the table of scanners; nothing where there is none.

    Raises
    ------
    InputError
        Numbers that are none, a covariance of components that a scanner has not.
    """
    table = tables.read("scanners")
    if table is None:
        return {}
    names = table.names_once("scanner")
    counts = table.vectors(("pitch_mm", "origin_column", "origin_row"))
    table.check_given(counts, ("pitch_mm", "origin_column", "origin_row"))
    given = np.column_stack([table.numbers(name, float(name in ("sx", "sy"))) for name in (*DEVICE, *CURVES)])
    sd = table.vectors([f"sd_{name}" for name in (*DEVICE, *CURVES)], 0.0, infinite=True)
    half = np.column_stack([table.numbers(name, 1.0) for name in ("hx", "hy")])
    # Rows are told from y, which counts up, by where the project has its readings.
    down = table.flags("rows_down") if "rows_down" in table else np.ones(table.count, dtype=bool)
    found = {}
    for row, name in enumerate(names):
        pitch, *origin = counts[row].tolist()
        readings = made(
            table,
            row,
            partial(Readings, pitch, (origin[0], origin[1]), bool(down[row]), tuple(half[row].tolist())),
        )
        found[name] = _machine(table, row, name, given[row], sd[row], readings, covariances)
    return found


def _machine(
    table: ColumnTable,
    row: int,
    name: str,
    given: np.ndarray,
    sd: np.ndarray,
    readings: Readings,
    covariances: Covariances,
) -> Machine:
    parts: list[tuple[str, type[Unknown], slice]] = [(name, Scanner, slice(3))]
    if given[3:].any() or sd[3:].any() or covariances.names("scanner", name) - {"sx", "sy", "alpha"}:
        starts = range(3, 3 + len(CURVES), 3)
        parts += [(f"{name} {k}", ScannerCurve, slice(at, at + 3)) for k, at in enumerate(starts, 1)]
    words = ["sx", "sy", "alpha", *CURVES][: 3 * len(parts)]
    covariance = covariances.over("scanner", name, words)
    free = np.full(len(words), np.inf) if covariance is not None else sd

    def unknown(kind: type[Unknown], title: str, own: slice) -> Unknown:
        return made(table, row, lambda: kind(title, given[own], free[own]))  # type: ignore[call-arg]

    scanner, *curves = (unknown(kind, title, own) for title, kind, own in parts)
    known = None
    if covariance is not None:
        known = made(table, row, lambda: KnownTogether("scanner", [scanner, *curves], covariance=covariance))
    assert isinstance(scanner, Scanner)
    return Machine(scanner, tuple(each for each in curves if isinstance(each, ScannerCurve)), readings, known)


def read_films(tables: Tables, names: Sequence[str], default: str) -> Mapping[str, FilmKind]:
    """Read the table of films; those that are not in it have the defaults.

    Parameters
    ----------
    tables
        The tables.
    names
        Of the films that photos name.
    default
        The model of films that say none.

    Raises
    ------
    InputError
        Patterns and models that there are not, numbers that are none.
    """
    table = tables.read("films")
    found = {
        name: FilmKind(Roll(name, 0.0, 5e-4), default, (1e-4,) * 3, _bends(default), None) for name in names
    }
    if table is None:
        return found
    means, sd_means = table.numbers("m", 0.0), table.numbers("sd_m", 5e-4, infinite=True)
    size = np.column_stack(
        [table.numbers(f"sd_{name}", 1e-4, infinite=True) for name in ("photo_m", "b1", "b2")]
    )
    models = table.texts("model", default)
    for row, name in enumerate(table.names_once("film")):
        if models[row] not in MODELS:
            raise table.error(
                row, f"column model: there is no film {quoted(models[row])}{nearest(models[row], MODELS)}"
            )
        bends = _bends(models[row])
        columns = [f"sd_{each}" for each in BENDS.get(models[row], ())]
        own = tuple(
            float(table.numbers(each, bends[k], infinite=True)[row]) for k, each in enumerate(columns)
        )
        found[name] = FilmKind(
            made(table, row, partial(Roll, name, float(means[row]), float(sd_means[row]))),
            models[row],
            (float(size[row, 0]), float(size[row, 1]), float(size[row, 2])),
            (own[0], own[1]) if own else bends,
            _pattern(table, row, name),
        )
    return found


def _bends(model: str) -> tuple[float, float]:
    sd = _BEND_SD.get(model, 0.0)
    return sd, sd


def _pattern(table: ColumnTable, row: int, film: str) -> Pattern | None:
    """Return the pattern of a film; None where it has none."""
    kind = table.texts("pattern", "none")[row]
    if kind not in PATTERNS:
        raise table.error(row, f"column pattern: there is no {quoted(kind)}{nearest(kind, PATTERNS)}")
    if kind == "none":
        return None
    columns = _GRID if kind == "grid" else ("half_format_mm",)
    values = table.vectors(columns)[row]
    missing = [name for name, value in zip(columns, values, strict=True) if math.isnan(value)]
    if missing:
        raise table.error(row, f"column {missing[0]}: is empty, and the pattern {kind} needs it")
    count = {"w1 w2": 2, "ebner": 10}.get(kind, 2)
    sd = table.vectors(_deviations(count), infinite=True)[row]
    if np.isnan(sd).any():
        raise table.error(row, f"columns {', '.join(_deviations(count))}: the pattern {kind} needs them (mm)")
    if kind == "grid":
        nodes = int(values[4]) * int(values[5])
        own = [Weights(f"{film} node {k}", 0.0, sd) for k in range(1, nodes + 1)]
    else:
        own = [Weights(film if count == 2 else f"{film} {k}", 0.0, sd[k : k + 2]) for k in range(0, count, 2)]
    return made(table, row, partial(Pattern, kind, values, own))


def _deviations(count: int) -> tuple[str, ...]:
    return tuple(f"sd_{name}" for name in _WEIGHTS[:count])
