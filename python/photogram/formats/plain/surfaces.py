"""Tables of points on levels, planes, lines and plumb lines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.rows import check_given, made
from photogram.formats.plain.schema import AXES
from photogram.formats.plain.tables import Tables, covariances_of, indices_of
from photogram.formats.plain.transform import Transform
from photogram.io.delimited import ColumnTable
from photogram.network.observations import Observation, OnLevel, OnLine, OnPlane, OnPlumbLine
from photogram.network.unknowns import Level, Line, Plane, PlumbLine, Unknown

__all__ = ["read_surfaces"]

_Surface = TypeVar("_Surface", bound=Unknown)
_OFFSETS = ("sd_x", "sd_y")
_TILTS = ("sd_rotation_x", "sd_rotation_y")


def read_surfaces(tables: Tables, transform: Transform, points: Mapping[str, int]) -> list[Observation]:
    """Read all tables of points on surfaces.

    Raises
    ------
    InputError
        Names that are not there, surfaces that are given by halves, standard deviations that give no weight.
    """
    return [
        *_on_levels(tables, points),
        *_on_planes(tables, transform, points),
        *_on_lines(tables, transform, points),
        *_on_plumb_lines(tables, transform, points),
    ]


def _on(
    tables: Tables,
    kind: str,
    points: Mapping[str, int],
    surface: Callable[[ColumnTable], Callable[[int, str], _Surface]],
    bare: Callable[[str], _Surface],
    observed: Callable[[ColumnTable], Callable[[int, str, _Surface], Observation]],
) -> list[Observation]:
    """Return the observations of points on surfaces of a kind.

    Parameters
    ----------
    tables, points
        As for :func:`read_surfaces`.
    kind
        The column that names surfaces; tables are called after it.
    surface
        Reads the table of surfaces, and makes one of a row and a name.
    bare
        Makes one of which nothing is said.
    observed
        Reads the table of points, and makes an observation of a row, a point and its surface.
    """
    known: dict[str, _Surface] = {}
    table = tables.read(f"{kind}s")
    if table is not None:
        table.names(kind)
        make = surface(table)
        for row, name in enumerate(table.texts(kind)):
            if name in known:
                raise table.error(row, f"the {kind.replace('_', ' ')} {name} is there twice")
            known[name] = made(table, row, partial(make, row, name))
    table = tables.read(f"{kind}_points")
    if table is None:
        return []
    table.names(kind)
    places, names = indices_of(table, "point", points, "point").tolist(), list(points)
    observe = observed(table)
    found = []
    for row, (place, name) in enumerate(zip(places, table.texts(kind), strict=True)):
        if name not in known:
            known[name] = made(table, row, partial(bare, name))
        found.append(made(table, row, partial(observe, row, names[place], known[name])))
    return found


def _on_levels(tables: Tables, points: Mapping[str, int]) -> list[Observation]:
    def surface(table: ColumnTable) -> Callable[[int, str], Level]:
        heights = [None if math.isnan(each) else each for each in table.numbers("z").tolist()]
        sd = table.numbers("sd", math.inf, infinite=True)
        return lambda row, name: Level(name, heights[row], sd[row])

    def observed(table: ColumnTable) -> Callable[[int, str, Level], Observation]:
        offsets, sd = table.numbers("dz", 0.0), _sd(tables, table, "level_points", ("sd",))[:, 0]
        return lambda row, point, level: OnLevel(point, level, float(sd[row]), float(offsets[row]))

    return _on(tables, "level", points, surface, Level, observed)


def _on_planes(tables: Tables, transform: Transform, points: Mapping[str, int]) -> list[Observation]:
    def surface(table: ColumnTable) -> Callable[[int, str], Plane]:
        places, normals = _placed(tables, transform, table, "plane"), _vectors(table, ("nx", "ny", "nz"))
        sd = np.column_stack([_free(table, ("sd_distance",)), _free(table, _TILTS, tables.angle)])
        return lambda row, name: Plane(name, _or_none(normals[row]), _or_none(places[row]), sd[row])

    def observed(table: ColumnTable) -> Callable[[int, str, Plane], Observation]:
        distances, sd = table.numbers("distance", 0.0), _sd(tables, table, "plane_points", ("sd",))[:, 0]
        return lambda row, point, plane: OnPlane(point, plane, float(sd[row]), float(distances[row]))

    return _on(tables, "plane", points, surface, Plane, observed)


def _on_lines(tables: Tables, transform: Transform, points: Mapping[str, int]) -> list[Observation]:
    def surface(table: ColumnTable) -> Callable[[int, str], Line]:
        places, directions = _placed(tables, transform, table, "line"), _vectors(table, ("dx", "dy", "dz"))
        sd = np.column_stack([_free(table, _OFFSETS), _free(table, _TILTS, tables.angle)])
        return lambda row, name: Line(name, _or_none(directions[row]), _or_none(places[row]), sd[row])

    def observed(table: ColumnTable) -> Callable[[int, str, Line], Observation]:
        covariances = covariances_of(_sd(tables, table, "line_points", _OFFSETS), table, ("x", "y"))
        return lambda row, point, line: OnLine(point, line, covariance=covariances[row])

    return _on(tables, "line", points, surface, Line, observed)


def _on_plumb_lines(tables: Tables, transform: Transform, points: Mapping[str, int]) -> list[Observation]:
    def surface(table: ColumnTable) -> Callable[[int, str], PlumbLine]:
        places, sd = _placed(tables, transform, table, "plumb_line"), _free(table, _OFFSETS)
        return lambda row, name: PlumbLine(name, _or_none(places[row]), sd[row])

    def observed(table: ColumnTable) -> Callable[[int, str, PlumbLine], Observation]:
        covariances = covariances_of(_sd(tables, table, "plumb_line_points", _OFFSETS), table, ("x", "y"))
        return lambda row, point, line: OnPlumbLine(point, line, covariance=covariances[row])

    return _on(tables, "plumb_line", points, surface, PlumbLine, observed)


def _placed(tables: Tables, transform: Transform, table: ColumnTable, kind: str) -> Floats:
    """Return (rows, 3) places; NaN where nothing is said."""
    values = _vectors(table, AXES)
    found, _ = transform.positions(f"{kind}s", values, None, table)
    return found


def _vectors(table: ColumnTable, columns: tuple[str, ...]) -> Floats:
    """Return (rows, 3) vectors that are given altogether or not at all."""
    values: Floats = np.stack([table.numbers(name) for name in columns], axis=1)
    partly = np.isnan(values).any(axis=1) & ~np.isnan(values).all(axis=1)
    if partly.any():
        row = int(np.flatnonzero(partly)[0])
        raise table.error(row, f"some of {', '.join(columns)} are empty: give all or none")
    return values


def _or_none(values: Floats) -> Floats | None:
    return None if np.isnan(values).all() else values


def _free(table: ColumnTable, columns: tuple[str, ...], read: Callable[[str], float] | None = None) -> Floats:
    """Return (rows, k) standard deviations of a surface: infinite where nothing is said."""
    return np.stack([table.numbers(name, math.inf, infinite=True, read=read) for name in columns], axis=1)


def _sd(tables: Tables, table: ColumnTable, name: str, columns: tuple[str, ...]) -> Floats:
    found = tables.deviations(table, name, columns)
    check_given(table, found, columns, f"is empty: give it, or {name} under [sd]")
    return found
