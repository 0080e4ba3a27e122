"""Columns of control networks, as the core reads and writes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from photogram.formats.isis.network import ControlMeasures, ControlPoints

__all__ = ["columns_of_measures", "columns_of_points", "measures_of", "points_of"]

_Array: TypeAlias = NDArray[Any]

_FLAGS = ("edit_lock", "ignore", "rejected")
_SIXES = ("apriori_covariance", "adjusted_covariance")
_POINTS = ("types", *_FLAGS, "reference", "apriori_source", "apriori_radius_source", *_SIXES)
_MEASURES = (
    *("types", *_FLAGS, "sample", "line", "apriori_sample", "apriori_line"),
    *("sample_sigma", "line_sigma", "sample_residual", "line_residual", "diameter"),
)
_TRIPLES = {
    "apriori": ("apriori_x", "apriori_y", "apriori_z"),
    "adjusted": ("adjusted_x", "adjusted_y", "adjusted_z"),
    "constrained": ("latitude_constrained", "longitude_constrained", "radius_constrained"),
}
"""Columns of a table each that are attributes of three columns."""

_TRUTHS = {*_FLAGS, *_TRIPLES["constrained"]}
_CODES = {"types", "apriori_source", "apriori_radius_source"}


def _absent(name: str) -> np.generic:
    """Return what stands in a column where there is nothing."""
    if name in _TRUTHS:
        return np.bool_(False)
    if name in _CODES:
        return np.int8(-1)
    return np.int32(-1) if name == "reference" else np.float64(np.nan)


def _whole(columns: Mapping[str, Any], name: str, rows: int) -> _Array:
    """Return a column; where nothing is in it, one number that stands in all its rows."""
    found: _Array | None = columns.get(name)
    return (
        np.broadcast_to(_absent(name), (rows, 6) if name in _SIXES else (rows,)) if found is None else found
    )


def _triple(columns: Mapping[str, Any], names: tuple[str, str, str], rows: int) -> _Array:
    if not any(name in columns for name in names):
        return np.broadcast_to(_absent(names[0]), (rows, 3))
    return np.column_stack([_whole(columns, name, rows) for name in names])


def _rest(columns: Mapping[str, Any], rows: int) -> Any:
    return columns.get("rest", (np.zeros(0, np.uint8), np.zeros(rows + 1, np.int64)))


def points_of(columns: Mapping[str, Any]) -> ControlPoints:
    """Return points from the columns of the core: `ids`, `types`, and whatever else there is."""
    rows = len(columns["ids"])
    plain = {name: _whole(columns, name, rows) for name in _POINTS}
    triples = {own: _triple(columns, names, rows) for own, names in _TRIPLES.items()}
    return ControlPoints(ids=columns["ids"], **plain, **triples, rest=_rest(columns, rows))


def measures_of(columns: Mapping[str, Any]) -> ControlMeasures:
    """Return measures from the columns of the core: `serial`, `types`, and whatever else there is."""
    serial, serials = columns["serial"]
    plain = {name: _whole(columns, name, len(serial)) for name in _MEASURES}
    return ControlMeasures(serials=serials, serial=serial, **plain, rest=_rest(columns, len(serial)))


def _put(columns: dict[str, Any], name: str, column: _Array) -> None:
    """Put a column to others as the core takes it; one in which nothing stands is left out."""
    absent = _absent(name)
    if column.size == 0 or (
        not any(column.strides) and np.array_equal(column.flat[0], absent, equal_nan=True)
    ):
        return
    columns[name] = np.ascontiguousarray(column, dtype=absent.dtype)


def columns_of_points(points: ControlPoints) -> dict[str, Any]:
    """Return points as columns of the core."""
    columns: dict[str, Any] = {"ids": list(points.ids), "rest": points.rest}
    for name in _POINTS:
        _put(columns, name, getattr(points, name))
    for own, names in _TRIPLES.items():
        for k, name in enumerate(names):
            _put(columns, name, getattr(points, own)[:, k])
    return columns


def columns_of_measures(measures: ControlMeasures) -> dict[str, Any]:
    """Return measures as columns of the core."""
    serial = np.ascontiguousarray(measures.serial, dtype=np.int32)
    columns: dict[str, Any] = {"serial": (serial, list(measures.serials)), "rest": measures.rest}
    for name in _MEASURES:
        _put(columns, name, getattr(measures, name))
    return columns
