"""Control networks: points with their measures in images, as columns, and as the core takes these."""

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
"""What types of points mean; `Tie` and `Ground` are what old networks have for `Free` and `Fixed`."""
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
"""What sources of a-priori coordinates and radii mean."""
MEASURE_TYPES = ("Candidate", "Manual", "RegisteredPixel", "RegisteredSubPixel")
"""What types of measures mean."""

HEADER = {
    "NetworkId": "network_id",
    "TargetName": "target",
    "UserName": "user",
    "Created": "created",
    "LastModified": "modified",
    "Description": "description",
}
"""Keys of the header in the order of ISIS, and what they are here."""
MESSAGE = ("network_id", "target", "created", "modified", "description", "user")
"""Texts of the header, in the order of their numbers in binary networks."""

_Codes = NDArray[np.int8]
_Indices = NDArray[np.int32]
_Rest = tuple[NDArray[np.uint8], NDArray[np.int64]]

_TRIPLES = {
    "apriori": ("apriori_x", "apriori_y", "apriori_z"),
    "adjusted": ("adjusted_x", "adjusted_y", "adjusted_z"),
    "constrained": ("latitude_constrained", "longitude_constrained", "radius_constrained"),
}
"""Columns of a table each that are three columns of the core."""
_WIDTHS = {**dict.fromkeys(_TRIPLES, 3), "apriori_covariance": 6, "adjusted_covariance": 6}
"""Numbers in each row of a column, where there are several."""
_TRUTHS = {"edit_lock", "ignore", "rejected", *_TRIPLES["constrained"]}
_CODES = {"types", "apriori_source", "apriori_radius_source"}
_NO_COLUMNS = ("serials", "rest")
_NAMES = ("ids", "serial", *_NO_COLUMNS)  # What is handed to the core apart from the columns of numbers


class _Columns:
    """Points or measures: all columns have as many rows."""

    rest: _Rest

    def __len__(self) -> int:
        raise NotImplementedError

    def __post_init__(self) -> None:
        rows = len(self)
        for each in fields(self):  # type: ignore[arg-type]
            if each.name in _NO_COLUMNS:
                continue
            shape = (rows, _WIDTHS[each.name]) if each.name in _WIDTHS else (rows,)
            found = np.shape(getattr(self, each.name))
            if found != shape:
                raise InputError(phrase("format.shape", name=each.name, required=str(shape), got=str(found)))
        if self.rest[1].shape != (rows + 1,):
            raise InputError(
                phrase("format.shape", name="rest[1]", required=str((rows + 1,)), got=str(self.rest[1].shape))
            )


@dataclass(frozen=True, eq=False)
class ControlPoints(_Columns):
    """The points of a network.

    Coordinates are rectangular and body-fixed, in metres; a covariance is the upper triangle of a matrix, row
    by row, in square metres. Whatever a point does not have is NaN, -1 where it is an index or a code.
    """

    ids: Sequence[str]
    types: _Codes  # (n,) index into `POINT_TYPES`
    edit_lock: Bools  # (n,) the point must not be edited
    ignore: Bools
    rejected: Bools
    reference: _Indices  # (n,) the measure to which the others of the point refer, counted from its first one
    # (n,) index into `SOURCES`: where the a-priori coordinates, and the radius, are from
    apriori_source: _Codes
    apriori_radius_source: _Codes
    apriori: Floats  # (n, 3) coordinates before an adjustment
    apriori_covariance: Floats
    constrained: Bools  # (n, 3) whether latitude, longitude and radius are weighted
    adjusted: Floats  # (n, 3) coordinates of an adjustment
    adjusted_covariance: Floats
    # All other fields of messages, byte for byte, and the first of each point (n + 1); they are written back
    rest: _Rest

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def is_fixed(self) -> Bools:
        """(n,) whether a point is held where it is: `Fixed`, in old networks `Ground`."""
        return np.isin(self.types, [POINT_TYPES.index("Fixed"), POINT_TYPES.index("Ground")])

    @property
    def is_constrained(self) -> Bools:
        """(n,) whether the a-priori coordinates of a point are observed: `Constrained`."""
        return np.asarray(self.types == POINT_TYPES.index("Constrained"))


@dataclass(frozen=True, eq=False)
class ControlMeasures(_Columns):
    """The measures of a network, those of a point one after the other.

    Samples and lines are pixels, counted so that the centre of an image's first pixel is (1, 1). Whatever a
    measure does not have is NaN.
    """

    serials: Sequence[str]  # Of images, each once
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
    diameter: Floats  # (m,) of a crater that was measured
    edit_lock: Bools  # (m,) the measure must not be edited
    ignore: Bools
    rejected: Bools
    rest: _Rest

    def __len__(self) -> int:
        return len(self.serial)


@dataclass(frozen=True, eq=False)
class ControlNetwork:
    """A control network.

    What an adjustment has found is put into it by :func:`dataclasses.replace`: into the points, the measures,
    and these into the network. What is not replaced is written as it was read.

    Parameters
    ----------
    points, measures
        Its points and their measures.
    firsts
        (n + 1,) the first measure of each point, and the number of all.
    network_id, target, user, created, modified, description
        What its header says; None where it does not. ISIS reads no network without the first two.
    version
        Of the file that it was read from.
    radii
        (3,) radii of the target in metres; (0,) where they are not said.
    others
        Keys and groups of the header that nobody knows.
    header_rest
        Fields of the binary header that nobody knows, byte for byte.
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
        if self.firsts.shape != (len(self.points) + 1,):
            raise InputError(
                phrase(
                    "format.shape",
                    name="firsts",
                    required=str((len(self.points) + 1,)),
                    got=str(self.firsts.shape),
                )
            )

    @property
    def point_of_measure(self) -> NDArray[np.int64]:
        """(m,) the point of each measure."""
        return np.repeat(np.arange(len(self.points)), np.diff(self.firsts))

    @property
    def is_ignored(self) -> Bools:
        """(m,) whether a measure does not count: it is ignored, or its point."""
        return self.measures.ignore | self.points.ignore[self.point_of_measure]


def _absent(name: str) -> np.generic:
    """Return what stands in a column of the core where there is nothing."""
    if name in _TRUTHS:
        return np.bool_(False)
    if name in _CODES:
        return np.int8(-1)
    return np.int32(-1) if name == "reference" else np.float64(np.nan)


def _from_core(kind: type[_Columns], columns: Mapping[str, Any], rows: int) -> dict[str, Any]:
    """Return the columns of points or measures; an empty one is one value that stands in all its rows."""

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
    """Return points or measures as columns of the core; those in which nothing stands are left out."""
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
    """Return points from the columns of the core: `ids`, `types`, and whatever else there is."""
    ids = columns["ids"]
    return ControlPoints(ids=ids, **_from_core(ControlPoints, columns, len(ids)))


def measures_of(columns: Mapping[str, Any]) -> ControlMeasures:
    """Return measures from the columns of the core: `serial`, `types`, and whatever else there is."""
    serial, serials = columns["serial"]
    own = _from_core(ControlMeasures, columns, len(serial))
    return ControlMeasures(serials=serials, serial=serial, **own)


def columns_of_points(points: ControlPoints) -> dict[str, Any]:
    """Return points as columns of the core."""
    return {"ids": list(points.ids), **_to_core(points)}


def columns_of_measures(measures: ControlMeasures) -> dict[str, Any]:
    """Return measures as columns of the core."""
    serial = np.ascontiguousarray(measures.serial, dtype=np.int32)
    return {"serial": (serial, list(measures.serials)), **_to_core(measures)}
