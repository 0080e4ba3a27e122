"""Control networks: points and measures as columns, and their readers (binary 2 and 5, text 3 to 5)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.io.files import read_bytes, reading
from photogram.io.pvl import Group, Quantity, Value, parsed
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

_ABSENT: Mapping[type, np.generic] = {
    np.bool_: np.bool_(False),
    np.int8: np.int8(-1),
    np.int32: np.int32(-1),
    np.float64: np.float64(np.nan),
}
"""Missing values of columns by type."""


_no_column: Callable[..., Any] = field  # Declares a field that is no column


def _column(kind: type, *names: str, width: int = 1) -> Any:
    """Declare a column: type, names of the engine if it has several columns, numbers per row."""
    return field(metadata={"absent": _ABSENT[kind], "names": names, "width": len(names) or width})


def _axes(kind: type, form: str, names: str = "x y z") -> Any:
    return _column(kind, *(form.format(name) for name in names.split()))


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
        for name, column in _columns(type(self)).items():
            width = column["width"]
            _check_shape(name, getattr(self, name), (rows,) if width == 1 else (rows, width))
        _check_shape("rest[1]", self.rest[1], (rows + 1,))


def _columns(kind: type[_Columns]) -> dict[str, Mapping[str, Any]]:
    """Return the declarations of the columns of points or measures."""
    return {each.name: each.metadata for each in fields(kind) if each.metadata}  # type: ignore[arg-type]


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
    # (n,) index into `SOURCES`: origin of the a-priori coordinates, and of the radius
    apriori_source: _Codes = _column(np.int8)
    apriori_radius_source: _Codes = _column(np.int8)
    apriori: Floats = _axes(np.float64, "apriori_{}")  # (n, 3) coordinates before an adjustment
    apriori_covariance: Floats = _column(np.float64, width=6)
    # (n, 3) whether latitude, longitude and radius are weighted
    constrained: Bools = _axes(np.bool_, "{}_constrained", "latitude longitude radius")
    adjusted: Floats = _axes(np.float64, "adjusted_{}")  # (n, 3) coordinates of an adjustment
    adjusted_covariance: Floats = _column(np.float64, width=6)
    # All other message fields as bytes, and the start of each point (n + 1); written unchanged
    rest: _Rest = _no_column()

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
    types: _Codes = _column(np.int8)  # (m,) index into `MEASURE_TYPES`
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
    rest: _Rest = _no_column()

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


def _from_core(kind: type[_Columns], columns: Mapping[str, Any], rows: int) -> dict[str, Any]:
    """Return columns of points or measures; an empty one has missing values."""
    found = {"rest": columns.get("rest", (np.zeros(0, np.uint8), np.zeros(rows + 1, np.int64)))}
    for name, own in _columns(kind).items():
        absent, names, width = own["absent"], own["names"] or (name,), own["width"]
        if not any(each in columns for each in names):
            shape = (rows,) if width == 1 else (rows, width)
            found[name] = np.broadcast_to(absent, shape)
        elif len(names) == 1:
            found[name] = columns[name]
        else:
            parts = [columns.get(each) for each in names]
            missing = np.broadcast_to(absent, rows)
            found[name] = np.column_stack([missing if part is None else part for part in parts])
    return found


def _to_core(table: _Columns) -> dict[str, Any]:
    """Return points or measures as columns of the engine, without empty columns."""
    found: dict[str, Any] = {"rest": table.rest}
    for name, own in _columns(type(table)).items():
        absent, values = own["absent"], getattr(table, name)
        pairs = zip(own["names"], values.T, strict=True) if own["names"] else [(name, values)]
        for each, column in pairs:
            same = not any(column.strides)
            if column.size and not (same and np.array_equal(column.flat[0], absent, equal_nan=True)):
                found[each] = np.ascontiguousarray(column, dtype=absent.dtype)
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


LABEL_BYTES = 65536  # Bytes of the label of a binary network, padded with zeros
_FIRST_OBJECT = re.compile(rb"\s*(?:(?:#|/\*)[^\n]*\n\s*)*object\s*=\s*(\w+)", re.IGNORECASE)
_BINARY, _TEXT = "protobuffer", "controlnetwork"
_BINARY_VERSIONS = ("2", "5")
_TEXT_VERSIONS = ("3", "4", "5")
_OLDEST = "1"  # Version of a network without a version
_HEADER = {key.lower(): name for key, name in HEADER.items()}


def _kind(data: bytes) -> str:
    """Return the name of the first object of a label in small letters; empty without."""
    found = _FIRST_OBJECT.match(data[:LABEL_BYTES].removeprefix(b"\xef\xbb\xbf"))
    return found[1].decode().lower() if found else ""


def is_network(head: bytes) -> bool:
    """Return whether this is the start of a control network."""
    return _kind(head) in (_BINARY, _TEXT)


def is_binary(path: Path) -> bool:
    """Return whether a control network is binary."""
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
    if kind == _BINARY:
        network = _binary(data, path)
    elif kind == _TEXT:
        network = _text(data, path)
    else:
        raise InputError(phrase("isis.network", value=str(kind)), file=path)
    ids = network.points.ids
    if len(set(ids)) < len(ids):
        first: dict[str, int] = {}
        for number, name in enumerate(ids, 1):
            if first.setdefault(name, number) != number:
                raise InputError(phrase("format.repeated", what="point", name=name), file=path, record=number)
    return network


def _check_version(version: str, known: tuple[str, ...], what: str, path: Path) -> None:
    if version not in known:
        raise InputError(phrase("isis.version", kind=what, version=version, names=list(known)), file=path)


def _whole(group: Group, key: str, path: Path, *, required: bool = False) -> int | None:
    """Return an integer that is not negative; None if the key is missing."""
    value = group.get(key)
    if value is None:
        if required:
            raise InputError(phrase("format.member", name=key), file=path, record=group.line)
        return None
    if not isinstance(value, str) or re.fullmatch(r"\d{1,18}", value) is None:
        raise InputError(phrase("format.whole", name=key, value=value), file=path, record=group.line)
    return int(value)


def _binary(data: bytes, path: Path) -> ControlNetwork:
    head = data[:LABEL_BYTES].split(b"\0", 1)[0]
    try:
        text = head.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = head.decode("latin-1")
    label = parsed(text, path, numbers=False)
    buffer = label.need("ProtoBuffer", path)
    core, info = (buffer.need(name, path) for name in ("Core", "ControlNetworkInfo"))
    version = str(info.get("Version") or _OLDEST)
    _check_version(version, _BINARY_VERSIONS, "binary", path)
    keys = ("HeaderStartByte", "HeaderBytes", "PointsStartByte", "PointsBytes")
    start, size, points, points_size = (int(_whole(core, key, path, required=True) or 0) for key in keys)
    texts, count, lengths, radii, rest = _photocore.control_header(data, start, start + size, path)
    listed = lengths if version == "2" else None
    columns, measures, firsts = _photocore.control_points(data, points, points + points_size, listed, path)
    known = {*_HEADER, "numberofpoints", "numberofmeasures", "version"}
    others = Group("", "label", items=[item for item in info.items if item[0].lower() not in known])
    others.items += label.items + buffer.items
    read = {id(buffer), id(core), id(info)}
    others.inside = [each for each in label.inside + buffer.inside if id(each) not in read]
    header: dict[str, Any] = dict(zip(MESSAGE, texts, strict=True))
    header |= {"radii": np.array(radii), "header_rest": rest, "version": int(version), "others": others}
    network = ControlNetwork(points_of(columns), measures_of(measures), firsts, **header)
    for said, found, what in (
        (count, len(network.points), "points"),
        (_whole(info, "NumberOfPoints", path), len(network.points), "points"),
        (_whole(info, "NumberOfMeasures", path), len(network.measures), "measures"),
    ):
        if said is not None and said != found:
            raise InputError(phrase("isis.count", count=said, what=what, n=found), file=path)
    return network


def _text(data: bytes, path: Path) -> ControlNetwork:
    (points, measures, firsts), around = _photocore.control_points_of_text(
        data.removeprefix(b"\xef\xbb\xbf"), path
    )
    label = parsed(around, path, numbers=False)
    network = label.need("ControlNetwork", path)
    _check_version(str(network.get("Version") or _OLDEST), _TEXT_VERSIONS, "text", path)
    header: dict[str, Any] = {}
    others = Group("", "label", items=[*label.items])
    others.inside = network.inside + [each for each in label.inside if each is not network]
    for key, value in network.items:
        if (name := _HEADER.get(key.lower())) is not None:
            if not isinstance(value, str):
                raise InputError(phrase("format.text", name=key, value=value), file=path, record=network.line)
            header[name] = value
        elif key.lower() == "targetradii":
            header["radii"] = _radii(value, network, path)
        elif key.lower() != "version":
            others.items.append((key, value))
    header |= {"version": int(str(network.get("Version"))), "others": others}
    return ControlNetwork(points_of(points), measures_of(measures), firsts, **header)


def _radii(value: Value, network: Group, path: Path) -> Floats:
    try:
        if isinstance(value, Quantity):
            if value.unit.lower() != "meters":
                raise ValueError
            value = value.value
        radii = np.array([float(str(each)) for each in (value if isinstance(value, list) else [value])])
        if not np.isfinite(radii).all():
            raise ValueError
    except ValueError:
        raise InputError(phrase("isis.radii", value=str(value)), file=path, record=network.line) from None
    return radii
