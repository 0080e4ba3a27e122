"""Control networks: points and measures as columns, and their readers (binary 2 and 5, text 3 to 5)."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.io.files import read_bytes, reading
from photogram.io.places import Place
from photogram.io.pvl import Group, Quantity, parsed
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.words import phrase

POINT_TYPES = ("Tie", "Ground", "Free", "Constrained", "Fixed")
"""Meaning of point types; old networks have `Tie` and `Ground` for `Free` and `Fixed`."""

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

_ABSENT = {np.bool_: False, np.int8: -1, np.int32: -1, np.float64: np.nan}  # Missing values by type


def _column(kind: Any, names: str = "", width: int = 1) -> Any:
    """Declare a column: type, names in the engine if each number of a row has one, numbers per row."""
    own = tuple(names.split())
    column = {"absent": kind(_ABSENT[kind]), "names": own, "shape": (len(own) or width,)}
    return field(default=None, metadata=column)


def _check_shape(name: str, values: Any, shape: tuple[int, ...]) -> None:
    if np.shape(values) != shape:
        raise InputError(phrase("format.shape", name=name, required=str(shape), got=str(np.shape(values))))


class _Columns:
    """Columns of points or measures, all with the same number of rows; missing ones have missing values."""

    rest: _Rest

    def __len__(self) -> int:
        raise NotImplementedError

    def __post_init__(self) -> None:
        rows = len(self)
        if self.rest is None:
            object.__setattr__(self, "rest", (np.zeros(0, np.uint8), np.zeros(rows + 1, np.int64)))
        for name, column in self._declared().items():
            shape = (rows, *column["shape"]) if column["shape"] != (1,) else (rows,)
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.broadcast_to(column["absent"], shape))
            _check_shape(name, getattr(self, name), shape)
        _check_shape("rest[1]", self.rest[1], (rows + 1,))

    @classmethod
    def _declared(cls) -> dict[str, Mapping[str, Any]]:
        return {each.name: each.metadata for each in fields(cls) if each.metadata}  # type: ignore[arg-type]

    @classmethod
    def of(cls, own: dict[str, Any]) -> Self:
        """Create columns from those of the engine."""
        for name, column in cls._declared().items():
            parts = {each: own.pop(each) for each in column["names"] if each in own}
            if parts:
                missing = np.full_like(next(iter(parts.values())), column["absent"])
                own[name] = np.column_stack([parts.get(each, missing) for each in column["names"]])
        return cls(**own)

    def columns(self) -> dict[str, Any]:
        """Return the columns of the engine, without empty ones."""
        found: dict[str, Any] = {"rest": self.rest}
        for name, own in self._declared().items():
            absent, values = own["absent"], getattr(self, name)
            pairs = zip(own["names"], values.T, strict=True) if own["names"] else [(name, values)]
            for each, column in pairs:
                same = not any(column.strides)
                if column.size and not (same and np.array_equal(column.flat[0], absent, equal_nan=True)):
                    found[each] = np.ascontiguousarray(column, dtype=absent.dtype)
        return found


@dataclass(frozen=True, eq=False)
class ControlPoints(_Columns):
    """The points of a network.

    Coordinates are rectangular and body-fixed, in metres. A covariance is the upper triangle of a matrix, row
    by row, in square metres. Missing values are NaN, or -1 for indices and codes.
    """

    ids: Sequence[str]
    types: _Codes = _column(np.int8)  # (n,) index into `POINT_TYPES`
    edit_lock: Bools = _column(np.bool_)  # (n,) the point must not be edited
    ignore: Bools = _column(np.bool_)
    rejected: Bools = _column(np.bool_)
    reference: _Indices = _column(np.int32)  # (n,) reference measure of the point, from its first measure
    # (n,) origin of the a-priori coordinates, and of the radius: 0 none, 1 user, 2 average of measures,
    # 3 reference, 4 ellipsoid, 5 DEM, 6 basemap, 7 bundle solution
    apriori_source: _Codes = _column(np.int8)
    apriori_radius_source: _Codes = _column(np.int8)
    # (n, 3) coordinates before an adjustment
    apriori: Floats = _column(np.float64, "apriori_x apriori_y apriori_z")
    apriori_covariance: Floats = _column(np.float64, width=6)
    # (n, 3) whether latitude, longitude and radius are weighted
    constrained: Bools = _column(np.bool_, "latitude_constrained longitude_constrained radius_constrained")
    # (n, 3) coordinates of an adjustment
    adjusted: Floats = _column(np.float64, "adjusted_x adjusted_y adjusted_z")
    adjusted_covariance: Floats = _column(np.float64, width=6)
    # All other message fields as bytes, and the start of each point (n + 1); written unchanged
    rest: _Rest = None  # type: ignore[assignment]  # Created if missing

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
    types: _Codes = _column(np.int8)  # (m,) 0 candidate, 1 manual, 2 registered to a pixel, 3 to a part of it
    sample: Floats = _column(np.float64)
    line: Floats = _column(np.float64)
    apriori_sample: Floats = _column(np.float64)
    apriori_line: Floats = _column(np.float64)
    sample_sigma: Floats = _column(np.float64)
    line_sigma: Floats = _column(np.float64)
    sample_residual: Floats = _column(np.float64)
    line_residual: Floats = _column(np.float64)
    diameter: Floats = _column(np.float64)  # (m,) diameter of a measured crater
    edit_lock: Bools = _column(np.bool_)  # (m,) the measure must not be edited
    ignore: Bools = _column(np.bool_)
    rejected: Bools = _column(np.bool_)
    rest: _Rest = None  # type: ignore[assignment]  # Created if missing

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

    @classmethod
    def of(cls, columns: tuple[dict[str, Any], dict[str, Any], NDArray[np.int64]], **header: Any) -> Self:
        """Create a network from columns of the engine."""
        points, measures, firsts = columns
        measures["serial"], measures["serials"] = measures["serial"]
        return cls(ControlPoints.of(points), ControlMeasures.of(measures), firsts, **header)

    def columns(self) -> tuple[dict[str, Any], dict[str, Any], NDArray[np.int64]]:
        """Return the columns of the engine: of points, of measures, first measures."""
        points, measures = self.points.columns(), self.measures.columns()
        points["ids"] = list(self.points.ids)
        measures["serial"] = np.ascontiguousarray(self.measures.serial, np.int32), list(self.measures.serials)
        return points, measures, self.firsts

    @property
    def point_of_measure(self) -> NDArray[np.int64]:
        """(m,) the point of each measure."""
        return np.repeat(np.arange(len(self.points)), np.diff(self.firsts))

    @property
    def is_ignored(self) -> Bools:
        """(m,) whether a measure is ignored, or its point."""
        return self.measures.ignore | self.points.ignore[self.point_of_measure]


LABEL_BYTES = 65536  # Bytes of the label of a binary network, padded with zeros
_FIRST_OBJECT = re.compile(rb"\s*(?:(?:#|/\*)[^\n]*\n\s*)*object\s*=\s*(\w+)", re.IGNORECASE)
_BINARY, _TEXT = "protobuffer", "controlnetwork"
_BINARY_VERSIONS = ("2", "5")
_TEXT_VERSIONS = ("3", "4", "5")
_OLDEST = "1"  # Version of a network without a version
_LISTED = 2  # Version whose header contains the lengths of points
PLACES = ("HeaderStartByte", "HeaderBytes", "PointsStartByte", "PointsBytes")
_HEADER = {key.lower(): name for key, name in HEADER.items()}


def _kind(data: bytes) -> str:
    """Return the name of the first object of a label in small letters; empty without."""
    found = _FIRST_OBJECT.match(data[:LABEL_BYTES].removeprefix(b"\xef\xbb\xbf"))
    return found[1].decode().lower() if found else ""


def is_network(head: bytes) -> bool:
    return _kind(head) in (_BINARY, _TEXT)


def is_binary(path: Path) -> bool:
    with reading(path), path.open("rb") as file:
        return _kind(file.read(LABEL_BYTES)) == _BINARY


def read_network(path: Path) -> ControlNetwork:
    """Read a control network.

    Comments of text are ignored: ISIS writes derived values there.

    Raises
    ------
    InputError
        If the file cannot be read, is not a control network, has an unknown version, or is damaged. The error
        contains the number of the point (binary networks) or the line (text).
    """
    data = read_bytes(path)
    kind = _kind(data)
    if kind not in (_BINARY, _TEXT):
        raise InputError(phrase("isis.network", value=kind), file=path)
    network = (_binary if kind == _BINARY else _text)(data, path)
    ids = network.points.ids
    if len(set(ids)) < len(ids):
        first: dict[str, int] = {}
        for number, name in enumerate(ids, 1):
            if first.setdefault(name, number) != number:
                raise Place(path, number).error(phrase("format.repeated", what="point", name=name))
    return network


def _version(group: Group, known: tuple[str, ...], what: str, path: Path) -> int:
    version = str(group.get("Version") or _OLDEST)
    if version not in known:
        raise InputError(phrase("isis.version", kind=what, version=version, names=list(known)), file=path)
    return int(version)


def _others(known: Container[str], *groups: Group) -> Group:
    """Return the keys and groups of a header that a network has no fields for."""
    items = [item for group in groups for item in group.items if item[0].lower() not in known]
    inside = [each for group in groups for each in group.inside if all(each is not own for own in groups)]
    return Group("", "label", items=items, inside=inside)


def _whole(group: Group, key: str, path: Path) -> int | None:
    """Return an integer that is not negative; None if the key is missing."""
    value = group.get(key)
    if value is not None and (not isinstance(value, str) or re.fullmatch(r"\d{1,18}", value) is None):
        raise InputError(phrase("format.whole", name=key, value=value), file=path, record=group.line)
    return None if value is None else int(value)


def _binary(data: bytes, path: Path) -> ControlNetwork:
    head = data[:LABEL_BYTES].split(b"\0", 1)[0]
    try:
        text = head.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = head.decode("latin-1")
    label = parsed(text, path, numbers=False)
    buffer = label.need("ProtoBuffer", path)
    core, info = (buffer.need(name, path) for name in ("Core", "ControlNetworkInfo"))
    version = _version(info, _BINARY_VERSIONS, "binary", path)
    places = {key: _whole(core, key, path) for key in PLACES}
    if missing := [key for key, place in places.items() if place is None]:
        raise InputError(phrase("format.member", name=missing[0]), file=path, record=core.line)
    start, size, first, points_size = (place or 0 for place in places.values())
    texts, count, lengths, radii, rest = _photocore.control_header(data, start, start + size, path)
    listed = lengths if version == _LISTED else None
    columns = _photocore.control_points(data, first, first + points_size, listed, path)
    known = {*_HEADER, "numberofpoints", "numberofmeasures", "version", *map(str.lower, PLACES)}
    network = ControlNetwork.of(
        columns,
        **dict(zip(MESSAGE, texts, strict=True)),
        version=version,
        radii=np.array(radii),
        others=_others(known, info, label, buffer, core),
        header_rest=rest,
    )
    for said, found, what in (
        (count, network.points, "points"),
        (_whole(info, "NumberOfPoints", path), network.points, "points"),
        (_whole(info, "NumberOfMeasures", path), network.measures, "measures"),
    ):
        if said is not None and said != len(found):
            raise InputError(phrase("isis.count", count=said, what=what, n=len(found)), file=path)
    return network


def _text(data: bytes, path: Path) -> ControlNetwork:
    data = data.removeprefix(b"\xef\xbb\xbf")
    columns, around = _photocore.control_points_of_text(data, path)
    label = parsed(around, path, numbers=False)
    network = label.need("ControlNetwork", path)
    version = _version(network, _TEXT_VERSIONS, "text", path)
    header: dict[str, Any] = {}
    for key, value in network.items:
        if (name := _HEADER.get(key.lower())) is not None:
            if not isinstance(value, str):
                raise InputError(phrase("format.text", name=key, value=value), file=path, record=network.line)
            header[name] = value
        elif key.lower() == "targetradii":
            own, unit = value if isinstance(value, Quantity) else (value, "meters")
            try:
                radii = np.array(own if isinstance(own, list) else [own], dtype=float)
            except (TypeError, ValueError):
                radii = np.array(np.nan)
            if unit.lower() != "meters" or radii.ndim != 1 or not np.isfinite(radii).all():
                message = phrase("isis.radii", value=str(value))
                raise InputError(message, file=path, record=network.line)
            header["radii"] = radii
    others = _others({*_HEADER, "targetradii", "version"}, label, network)
    return ControlNetwork.of(columns, **header, version=version, others=others)
