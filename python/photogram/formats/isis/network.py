"""Control networks: points and measures as columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.io.pvl import Group
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.words import phrase

POINT_TYPES = ("Tie", "Ground", "Free", "Constrained", "Fixed")
"""Meaning of point types; old networks have `Tie` and `Ground` for `Free` and `Fixed`."""
SOURCES = (
    "None",
    "User",
    "AverageOfMeasures",
    "Reference",
    "Ellipsoid",
    "DEM",
    "Basemap",
    "BundleSolution",
)
"""Meaning of sources of a-priori coordinates and radii."""
MEASURE_TYPES = ("Candidate", "Manual", "RegisteredPixel", "RegisteredSubPixel")
"""Meaning of measure types."""

HEADER = {
    "NetworkId": "network_id",
    "TargetName": "target",
    "UserName": "user",
    "Created": "created",
    "LastModified": "modified",
    "Description": "description",
}
"""Keys of the header in the order of ISIS, and the fields of a network."""
MESSAGE = ("network_id", "target", "created", "modified", "description", "user")
"""Header texts in the order of their numbers in binary networks."""

_Codes = NDArray[np.int8]
_Indices = NDArray[np.int32]
_Rest = tuple[NDArray[np.uint8], NDArray[np.int64]]

_TRIPLES = {
    "apriori": ("apriori_x", "apriori_y", "apriori_z"),
    "adjusted": ("adjusted_x", "adjusted_y", "adjusted_z"),
    "constrained": ("latitude_constrained", "longitude_constrained", "radius_constrained"),
}
"""Columns of a table that are three columns of the engine."""
_WIDTHS = {**dict.fromkeys(_TRIPLES, 3), "apriori_covariance": 6, "adjusted_covariance": 6}
"""Numbers per row of columns with several."""
_TRUTHS = {"edit_lock", "ignore", "rejected", *_TRIPLES["constrained"]}
_CODES = {"types", "apriori_source", "apriori_radius_source"}
_NO_COLUMNS = ("serials", "rest")
_NAMES = ("ids", "serial", *_NO_COLUMNS)  # Passed to the engine separately from the columns of numbers


def _check_shape(name: str, values: Any, shape: tuple[int, ...]) -> None:
    if np.shape(values) != shape:
        raise InputError(phrase("format.shape", name=name, required=str(shape), got=str(np.shape(values))))


class _Columns:
    """Columns of points or measures, all with the same number of rows."""

    rest: _Rest

    def __len__(self) -> int:
        raise NotImplementedError

    def __post_init__(self) -> None:
        rows = len(self)
        for each in fields(self):  # type: ignore[arg-type]
            if each.name in _NO_COLUMNS:
                continue
            shape = (rows, _WIDTHS[each.name]) if each.name in _WIDTHS else (rows,)
            _check_shape(each.name, getattr(self, each.name), shape)
        _check_shape("rest[1]", self.rest[1], (rows + 1,))


@dataclass(frozen=True, eq=False)
class ControlPoints(_Columns):
    """The points of a network.

    Coordinates are rectangular and body-fixed, in metres. A covariance is the upper triangle of a matrix, row
    by row, in square metres. Missing values are NaN, or -1 for indices and codes.
    """

    ids: Sequence[str]
    types: _Codes  # (n,) index into `POINT_TYPES`
    edit_lock: Bools  # (n,) the point must not be edited
    ignore: Bools
    rejected: Bools
    reference: _Indices  # (n,) the reference measure of the point, counted from its first measure
    # (n,) index into `SOURCES`: origin of the a-priori coordinates, and of the radius
    apriori_source: _Codes
    apriori_radius_source: _Codes
    apriori: Floats  # (n, 3) coordinates before an adjustment
    apriori_covariance: Floats
    constrained: Bools  # (n, 3) whether latitude, longitude and radius are weighted
    adjusted: Floats  # (n, 3) coordinates of an adjustment
    adjusted_covariance: Floats
    # All other message fields as bytes, and the start of each point (n + 1); written unchanged
    rest: _Rest

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def is_fixed(self) -> Bools:
        """(n,) whether a point is fixed: `Fixed`, or `Ground` in old networks."""
        return np.isin(self.types, [POINT_TYPES.index("Fixed"), POINT_TYPES.index("Ground")])

    @property
    def is_constrained(self) -> Bools:
        """(n,) whether the a-priori coordinates of a point are weighted: `Constrained`."""
        return np.asarray(self.types == POINT_TYPES.index("Constrained"))


@dataclass(frozen=True, eq=False)
class ControlMeasures(_Columns):
    """The measures of a network, grouped by point.

    Samples and lines are pixels; the centre of an image's first pixel is (1, 1). Missing values are NaN.
    """

    serials: Sequence[str]  # Serial numbers of images, each once
    serial: _Indices  # (m,) index of the image in `serials`
    types: _Codes  # (m,) index into `MEASURE_TYPES`
    sample: Floats
    line: Floats
    apriori_sample: Floats
    apriori_line: Floats
    sample_sigma: Floats
    line_sigma: Floats
    sample_residual: Floats
    line_residual: Floats
    diameter: Floats  # (m,) diameter of a measured crater
    edit_lock: Bools  # (m,) the measure must not be edited
    ignore: Bools
    rejected: Bools
    rest: _Rest

    def __len__(self) -> int:
        return len(self.serial)


@dataclass(frozen=True, eq=False)
class ControlNetwork:
    """A control network.

    Use :func:`dataclasses.replace` to insert adjustment results: into points and measures, and these into the
    network. All other values are written as they were read.

    Parameters
    ----------
    points, measures
        Points and their measures.
    firsts
        (n + 1,) the first measure of each point, and the number of all.
    network_id, target, user, created, modified, description
        Values of the header; None if missing. ISIS requires the first two.
    version
        Version of the file that was read.
    radii
        (3,) radii of the target in metres; (0,) if unknown.
    others
        Unknown keys and groups of the header.
    header_rest
        Unknown fields of the binary header, as bytes.
    """

    points: ControlPoints
    measures: ControlMeasures
    firsts: NDArray[np.int64]
    network_id: str | None = ""
    target: str | None = ""
    user: str | None = None
    created: str | None = None
    modified: str | None = None
    description: str | None = None
    version: int = 5
    radii: Floats = field(default_factory=lambda: np.zeros(0))
    others: Group = field(default_factory=lambda: Group("", "label"))
    header_rest: bytes = b""

    def __post_init__(self) -> None:
        _check_shape("firsts", self.firsts, (len(self.points) + 1,))

    @property
    def point_of_measure(self) -> NDArray[np.int64]:
        """(m,) the point of each measure."""
        return np.repeat(np.arange(len(self.points)), np.diff(self.firsts))

    @property
    def is_ignored(self) -> Bools:
        """(m,) whether a measure is ignored, or its point."""
        return self.measures.ignore | self.points.ignore[self.point_of_measure]


def _absent(name: str) -> np.generic:
    """Return the missing value of a column of the engine."""
    if name in _TRUTHS:
        return np.bool_(False)
    if name in _CODES:
        return np.int8(-1)
    return np.int32(-1) if name == "reference" else np.float64(np.nan)


def _from_core(kind: type[_Columns], columns: Mapping[str, Any], rows: int) -> dict[str, Any]:
    """Return columns of points or measures; an empty one has missing values."""

    def column(name: str) -> NDArray[Any]:
        shape = (rows, _WIDTHS[name]) if name in _WIDTHS else (rows,)
        own: NDArray[Any] | None = columns.get(name)
        return np.broadcast_to(_absent(name), shape) if own is None else own

    found = {"rest": columns.get("rest", (np.zeros(0, np.uint8), np.zeros(rows + 1, np.int64)))}
    for each in fields(kind):  # type: ignore[arg-type]
        names = _TRIPLES.get(each.name, ())
        if any(name in columns for name in names):
            found[each.name] = np.column_stack([column(name) for name in names])
        elif names:
            found[each.name] = np.broadcast_to(_absent(names[0]), (rows, len(names)))
        elif each.name not in _NAMES:
            found[each.name] = column(each.name)
    return found


def _to_core(own: _Columns) -> dict[str, Any]:
    """Return points or measures as columns of the engine, without empty columns."""
    found: dict[str, Any] = {"rest": own.rest}
    for each in fields(own):  # type: ignore[arg-type]
        if each.name in _NAMES:
            continue
        values = getattr(own, each.name)
        triple = _TRIPLES.get(each.name)
        for name, column in zip(triple, values.T, strict=True) if triple else [(each.name, values)]:
            absent = _absent(name)
            same = not any(column.strides)
            if column.size and not (same and np.array_equal(column.flat[0], absent, equal_nan=True)):
                found[name] = np.ascontiguousarray(column, dtype=absent.dtype)
    return found


def points_of(columns: Mapping[str, Any]) -> ControlPoints:
    """Return points from columns of the engine: `ids`, `types`, and optional ones."""
    ids = columns["ids"]
    return ControlPoints(ids=ids, **_from_core(ControlPoints, columns, len(ids)))


def measures_of(columns: Mapping[str, Any]) -> ControlMeasures:
    """Return measures from engine columns `serial`, `types` and optional ones."""
    serial, serials = columns["serial"]
    own = _from_core(ControlMeasures, columns, len(serial))
    return ControlMeasures(serials=serials, serial=serial, **own)


def columns_of_points(points: ControlPoints) -> dict[str, Any]:
    """Return points as columns of the engine."""
    return {"ids": list(points.ids), **_to_core(points)}


def columns_of_measures(measures: ControlMeasures) -> dict[str, Any]:
    """Return measures as columns of the engine."""
    serial = np.ascontiguousarray(measures.serial, dtype=np.int32)
    return {"serial": (serial, list(measures.serials)), **_to_core(measures)}
