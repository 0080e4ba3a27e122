"""Validation of the parts of a block: tables (data frames or mappings), names and cameras."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, elements, names, shaped
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.network.geometry import Spheroid
from photogram.words import phrase

RECTANGULAR_COLUMNS = ("X", "Y", "Z")
GEOGRAPHIC_COLUMNS = ("longitude_deg", "latitude_deg", "height")
ATTITUDE_COLUMNS = ("omega_deg", "phi_deg", "kappa_deg")
TABLE = "a table (a mapping of column names to columns)"


class Table(Protocol):
    """Columns by name: a data frame of pandas or polars, a dictionary, or an Arrow table."""

    def __contains__(self, name: Any, /) -> bool: ...

    def __getitem__(self, name: Any, /) -> Any: ...


def table_arguments(
    photos: Table,
    images: Table,
    points: Table | None,
    principal_distance: float | None,
    cameras: Sequence[Camera],
    image_sd: float | None,
    spheroid: Spheroid | None,
) -> dict[str, Any]:
    """Convert tables to arguments of a block, as specified in :meth:`photogram.Block.from_tables`."""
    axes = RECTANGULAR_COLUMNS if spheroid is None else GEOGRAPHIC_COLUMNS
    has_names = _has(photos, "photos", "photo")
    photo_ids = _name_column(photos, "photos", "photo") if has_names else numbered(_rows(photos, "photos"))
    image_point_names = _name_column(images, "images", "point")
    control_ids = _name_column(points, "points", "point") if points is not None else []
    control_ids = different("points", control_ids)
    point_ids = list(dict.fromkeys([*control_ids, *image_point_names]))

    positions = np.full((len(point_ids), 3), np.nan)
    sd = np.full((len(point_ids), 3), np.inf)
    if points is not None:
        positions[: len(control_ids)] = _columns(points, "points", axes)
        sd[: len(control_ids)] = _columns(points, "points", [f"sd_{axis}" for axis in axes], np.inf)
        sd[np.isnan(sd) | np.isnan(positions)] = np.inf
    photo_cameras = None
    if cameras and "camera" in photos:
        given = list(_column(photos, "photos", "camera"))
        photo_cameras = photo_indices(given, cameras, _rows(photos, "photos"))
    unit = str(cameras[0].unit) if cameras else "mm"
    if image_sd is None and unit == "mm":
        image_sd = 0.010
    return {
        "photo_ids": photo_ids,
        "photo_positions": _columns(photos, "photos", axes),
        "photo_attitudes": _columns(photos, "photos", ATTITUDE_COLUMNS),
        "principal_distances": _distances(photos, principal_distance, cameras),
        "cameras": cameras,
        "photo_cameras": photo_cameras,
        "point_ids": point_ids,
        "point_positions": positions,
        "image_photos": _lookup("photo", photo_ids, _name_column(images, "images", "photo")),
        "image_points": _lookup("point", point_ids, image_point_names),
        "image_xy": _columns(images, "images", [f"x_{unit}", f"y_{unit}"]),
        "image_sd": _columns(images, "images", [f"sd_x_{unit}", f"sd_y_{unit}"], image_sd),
        "photo_position_sd": _columns(photos, "photos", [f"sd_{axis}" for axis in axes], np.inf),
        "photo_attitude_sd": _columns(photos, "photos", [f"sd_{axis}" for axis in ATTITUDE_COLUMNS], np.inf),
        "point_sd": sd,
        "photo_positions_observed": _observed(photos, axes),
        "photo_attitudes_observed": _observed(photos, ATTITUDE_COLUMNS),
    }


def different(name: str, values: Sequence[str]) -> list[str]:
    """Return validated names; reject repeated ones."""
    checked = names(name, values)
    if len(set(checked)) != len(checked):
        seen: set[str] = set()
        repeated = next(value for value in checked if value in seen or seen.add(value))  # type: ignore[func-returns-value]
        raise argument_error(name, "repeated", kind="name", name=repeated)
    return checked


def numbered(count: int) -> list[str]:
    """Return default names: 0, 1, 2 ..."""
    return [str(number) for number in range(count)]


def _has(table: Table, table_name: str, name: str) -> bool:
    try:
        return bool(name in table)
    except TypeError:
        raise kind_error(table_name, TABLE, table) from None


def _column(table: Table, table_name: str, name: str) -> Sequence[Any]:
    if not _has(table, table_name, name):
        raise argument_error(table_name, "absent", kind="column", name=name)
    try:
        column: Sequence[Any] = table[name]
    except (TypeError, KeyError, IndexError):
        raise kind_error(table_name, TABLE, table) from None
    return column


def _rows(table: Table, table_name: str) -> int:
    """Return the number of rows of a table, from its names or else a coordinate."""
    name = "photo" if table_name == "photos" else "point"
    first = (RECTANGULAR_COLUMNS[0], GEOGRAPHIC_COLUMNS[0])
    known = next((each for each in (name, *first) if _has(table, table_name, each)), name)
    column = _column(table, table_name, known)
    if not isinstance(column, Sized) or np.ndim(column) == 0:
        raise argument_error(f"{table_name}, column {known}", "list", value=column)
    return len(column)


def _name_column(table: Table, table_name: str, name: str) -> list[str]:
    return names(f"{table_name}, column {name}", _column(table, table_name, name))


def _columns(
    table: Table, table_name: str, columns: Sequence[str], default: ArrayLike | None = None
) -> Floats:
    """Stack columns as (rows, len(columns)), `_deg` columns in radians; use the default if absent."""
    rows = _rows(table, table_name)
    stacked = []
    for name in columns:
        values = default if name not in table and default is not None else _column(table, table_name, name)
        column = shaped(f"{table_name}, column {name}", values, (rows,), missing=True)
        stacked.append(np.radians(column) if name.endswith("_deg") else column)
    return np.stack(stacked, axis=1)


def _distances(photos: Table, principal_distance: float | None, cameras: Sequence[Camera]) -> Floats | None:
    name = "principal_distance_mm"
    if cameras:
        given = name in photos or principal_distance is not None
        require(not given, "photos", "exclusive", first="principal_distance", second="cameras")
        return None
    given = name in photos or principal_distance is not None
    require(
        given, "photos", "requires", name="a block without cameras", other=f"principal_distance or {name}"
    )
    return _columns(photos, "photos", [name], principal_distance)[:, 0]


def _observed(photos: Table, columns: Sequence[str]) -> Floats | None:
    """Return the observed columns, with initial values if missing; None without any."""
    observed = [f"observed_{name}" for name in columns]
    if not any(name in photos for name in observed):
        return None
    present = [own if own in photos else name for own, name in zip(observed, columns, strict=True)]
    return _columns(photos, "photos", present)


def _lookup(kind: str, ids: Sequence[str], images: Sequence[str]) -> Indices:
    index = {name: i for i, name in enumerate(ids)}
    try:
        return np.array([index[name] for name in images], dtype=np.int64)
    except KeyError as error:
        raise argument_error("images", "unknown", kind=kind, name=error.args[0], names=list(ids)) from None


def checked_cameras(cameras: object) -> tuple[Camera, ...]:
    """Return validated cameras with unique names and one unit."""
    checked = elements("cameras", cameras, Camera)
    different("cameras", [each.name for each in checked if each.name])
    if len(of_unit := {each.unit: f"{each.title} in {each.unit}" for each in checked}) > 1:
        raise InputError(phrase("block.camera-units", cameras=list(of_unit.values())))
    return checked


def photo_indices(given: object, cameras: Sequence[Camera], photos: int) -> Indices:
    """Return (P,) camera indices of photos.

    `given` contains (P,) indices or names of cameras, or one for all photos. None: the only camera, or one
    for each photo.
    """
    if given is None:
        unique = len(cameras) in (1, photos)
        require(unique, "photo_cameras", "missing", name="the camera of each photo")
        return np.zeros(photos, dtype=np.int64) if len(cameras) == 1 else np.arange(photos)
    whole = [given] * photos if isinstance(given, str | int) else given
    try:
        rows = list(whole)  # type: ignore[call-overload]
    except TypeError:
        raise argument_error("photo_cameras", "list", value=given) from None
    require(len(rows) == photos, "photo_cameras", "count", count=photos, actual=len(rows))
    places: dict[object, int] = {each.name: row for row, each in enumerate(cameras) if each.name}
    indices = [places.get(each) if isinstance(each, str) else _index(each, len(cameras)) for each in rows]
    if None in indices:
        name = str(rows[indices.index(None)])
        raise argument_error("photo_cameras", "absent", kind="camera", name=name)
    return np.array(indices, dtype=np.int64)


def _index(each: object, count: int) -> int | None:
    if isinstance(each, bool | np.bool_) or not isinstance(each, int | np.integer):
        return None
    return int(each) if 0 <= each < count else None
