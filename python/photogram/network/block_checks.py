"""Validation of blocks: tables, names, cameras, rules of arrays, and consistency of the parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence, Sized
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import (
    RULES,
    argument_error,
    elements,
    frozen,
    indices,
    length,
    names,
    repeated_pairs,
    shaped,
)
from photogram.arguments.fields import checks_of
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import fields
from photogram.network.cameras import Camera
from photogram.network.films import check_scans
from photogram.network.geometry import Spheroid
from photogram.network.moving_photos import Timed, checked_mounts, require_photos, trajectory_of
from photogram.network.observations import Rate, Velocity
from photogram.network.observations.observation import checked_observations
from photogram.network.observations.unknowns import with_knots, with_smoothness
from photogram.network.passages import Figure, checked_passages
from photogram.network.refraction import metres_per_unit
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Block


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
    given = name in photos or principal_distance is not None
    if cameras:
        require(not given, "photos", "exclusive", first="principal_distance", second="cameras")
        return None
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


_IMAGES = frozenset({"image_photos", "image_points", "image_xy", "image_sd"})
_ALONE = _IMAGES | {"title", "linear_unit", "refraction", "frame", "point_check_sd"}
"""Fields that observations, mounted photos, trajectories and image transformations do not depend on."""


def rows_of(kind: type[Any], rows: str) -> tuple[str, ...]:
    """Return the declared arrays of a class with one row for each photo, point or image."""
    return tuple(each.name for each in fields(kind) if each.metadata.get("shape", ("",))[0] == rows)


def check_block(block: Block, changed: Collection[str]) -> None:
    """Convert and check the changed fields of a block, and what depends on them."""
    changed = set(changed)
    if changed & {"photo_ids", "point_ids"}:
        changed = {each.name for each in fields(block)}
        for name in ("_photo_rows", "_point_rows"):
            vars(block).pop(name, None)
        for name, positions in (("photo_ids", "photo_positions"), ("point_ids", "point_positions")):
            names = getattr(block, name)
            names = numbered(length(positions, getattr(block, positions))) if names is None else names
            block._set(name, different(name, names))
    if changed & {"image_photos", "image_points"}:
        changed |= _IMAGES
    if changed & {"cameras", "photo_cameras", "principal_distances"}:
        changed |= {"cameras", "photo_cameras", "principal_distances"}
        block._set("cameras", checked_cameras(block.cameras))
        if not block.cameras and block.photo_cameras is not None:
            raise InputError(phrase("error.requires", name="photo_cameras", other="cameras"))
        if block.cameras and block.principal_distances is not None:
            raise InputError(phrase("error.exclusive", first="principal_distances", second="cameras"))
    counts = {"photos": len(block.photo_ids), "points": len(block.point_ids)}
    counts["images"] = length("image_photos", block.image_photos)
    for each in fields(block):
        if each.name in changed:
            _check_field(block, each, counts)
    unknown_control = np.isfinite(block.point_sd) & np.isnan(block.point_positions)
    refuse(block, "point_positions", "points", unknown_control, "control-unknown")
    _check_observed(block)
    if changed & _IMAGES:
        _check_repeated(block)
    if block.refraction is not None:
        metres_per_unit(block.linear_unit)
    if changed - _ALONE:
        for name in ("unknowns", "observation_groups"):
            vars(block).pop(name, None)
        _check_observations(block)
    if changed - _ALONE or "image_photos" in changed:
        photo_cameras = block.photo_cameras if block.cameras else None
        check_scans(block.passages, block.photo_ids, block.cameras, photo_cameras, block.image_photos)


def _check_field(block: Block, declared: Any, counts: Mapping[str, int]) -> None:
    name, rules = declared.name, declared.metadata
    value = getattr(block, name)
    if "rule" not in rules:
        kind: Any = type(block)
        if (check := checks_of(kind).get(name)) is not None:
            block._set(name, check(name, value))
        return
    (rows, *columns), rule, limit = rules["shape"], rules["rule"], rules["index"]
    if limit == "cameras":
        if block.cameras:
            block._set(name, frozen(photo_indices(value, block.cameras, counts[rows])))
    elif limit:
        block._set(name, indices(name, value, counts[rows], counts[limit]))
    elif value is not None or declared.default is not None or (rule == "not-zero" and not block.cameras):
        numbers = shaped(name, value, (counts[rows], *columns), missing=rules["missing"])
        block._set(name, numbers)
        refuse(block, name, rows, ~RULES[rule](numbers), rule)


def refuse(block: Block, name: str, rows: str, bad: Bools, rule: str) -> None:
    """Raise an error that names the first photo, point or image with a bad value."""
    if not bad.any():
        return
    row = int(np.argwhere(bad)[0][0])
    owner: Phrase
    if rows == "photos":
        owner = phrase("named.photo", photo=block.photo_ids[row])
    elif rows == "points":
        owner = phrase("named.object_point", point=block.point_ids[row])
    else:
        point, photo = block.point_ids[block.image_points[row]], block.photo_ids[block.image_photos[row]]
        owner = phrase("named.image", point=point, photo=photo)
    value = str(getattr(block, name)[row].tolist())
    raise InputError(phrase(f"block.value.{rule}", name=name, owner=owner, value=value))


def _check_observed(block: Block) -> None:
    for name in ("photo_position", "photo_attitude"):
        initial, sd = getattr(block, f"{name}s"), getattr(block, f"{name}_sd")
        observed = getattr(block, f"{name}s_observed")
        if observed is None:
            refuse(block, f"{name}s", "photos", np.isnan(initial) & np.isfinite(sd), "unknown")
            continue
        refuse(block, f"{name}s_observed", "photos", np.isnan(observed) & np.isfinite(sd), "unknown")
        refuse(block, f"{name}s_observed", "photos", (sd == 0) & (observed != initial), "fixed")


def _check_repeated(block: Block) -> None:
    again = repeated_pairs(block.image_photos, block.image_points, len(block.point_ids))
    if again.size:
        second = int(again[0])
        photo, point = block.image_photos[second], block.image_points[second]
        first = int(np.flatnonzero((block.image_photos == photo) & (block.image_points == point))[0])
        names = {"point": block.point_ids[point], "photo": block.photo_ids[photo]}
        raise InputError(phrase("block.repeated-image", **names, first=first, second=second))


def _check_observations(block: Block) -> None:
    block._set("observations", checked_observations(block.observations))
    block._set("mounts", checked_mounts(block.mounts, block.photo_ids))
    _check_free_poses(block, [mount.photo for mount in block.mounts], "mounted")
    _check_timed(block)
    _check_motions(block)
    block._set("passages", checked_passages(block.passages))
    for each in block.passages:
        each.of(block._point_rows, block._photo_rows)
    block._set("observations", with_smoothness(block.observations, block.trajectories))
    block._set("observations", with_knots(block.observations, block.cameras))
    _ = block.observation_groups  # rejects observations of other points and photos
    figures = {
        name: each.title for each in block.passages if isinstance(each, Figure) for name in each.points
    }
    observed = {name for own in block.observations.column("points") for name in own} if figures else set()
    for row, name in enumerate(block.point_ids if figures else ()):
        if name in figures and (block.point_sd[row].any() or name in observed):
            raise InputError(phrase("block.figure-point", point=name, figure=figures[name]))


def _check_free_poses(block: Block, photos: list[str], rule: str) -> None:
    """Reject standard deviations of poses that are not unknowns."""
    if photos:
        rows = np.isin(block.photo_ids, photos)[:, np.newaxis]
        for name in ("photo_position_sd", "photo_attitude_sd"):
            refuse(block, name, "photos", rows & np.isfinite(getattr(block, name)), rule)


def _check_timed(block: Block) -> None:
    block._set("timed", elements("timed", block.timed, Timed))
    require_photos("timed", [each.photo for each in block.timed], block.photo_ids)
    own = [each.photo for each in block.timed if each.trajectory is None]
    if own:
        poses = np.hstack([block.photo_positions, block.photo_attitudes])
        unknown = np.isnan(poses).any(axis=1) & np.isin(block.photo_ids, own)
        if unknown.any():
            photo = block.photo_ids[int(np.argmax(unknown))]
            raise InputError(phrase("block.moving-pose-unknown", photo=photo))
    block._set("_trajectories", [trajectory_of(block, each) for each in block.timed])
    on_frames = {name for mount in block.mounts for name in (mount.photo, mount.frame)}
    if both := [each.photo for each in block.timed if each.photo in on_frames]:
        raise InputError(phrase("block.timed-and-mounted", photo=both[0]))
    _check_free_poses(block, [each.photo for each in block.timed if each.trajectory is not None], "timed")
    scanned = [each.photo for each in block.timed if each.lines is not None]
    if scanned and block.image_unit != "mm":
        raise InputError(phrase("block.scanner-unit", photo=scanned[0], unit=block.image_unit))
    if scanned and block.photo_cameras is not None:
        rows = np.unique(block.photo_cameras[np.isin(block.photo_ids, scanned)]).tolist()
        if measured := [block.cameras[row].title for row in rows if block.cameras[row].weights == "measured"]:
            raise InputError(phrase("block.scanner-weights", camera=measured[0]))
    names = Counter(each.name for each in block.all_trajectories)
    if repeated := [name for name, count in names.items() if count > 1]:
        raise InputError(phrase("block.repeated-object", kind="trajectory", name=repeated[0]))


def _check_motions(block: Block) -> None:
    """Reject motions of photos at rest, and observed poses of scanners without a time."""
    sensors = {each.photo: each.sensor for each in block.timed}
    # The mean time of a scanner's images changes if one image is removed.
    without_time = {each.photo for each in block.timed if each.lines is not None and each.time is None}
    for own in block.observations.columns:
        if not (without_time or issubclass(own.kind, Rate | Velocity)):
            continue
        for photos, moment in zip(own.table["photos"], own.moments, strict=True):
            photo: Any = next((name for name in photos if name in without_time), None)
            code = "scanner-time" if photo else ""
            if not code and issubclass(own.kind, Rate | Velocity):
                photo = photos[0]
                at_rest = photo not in sensors and photo in block.photo_ids
                code = "at-rest" if at_rest else "sensor" if sensors.get(photo) is not None else ""
            if code and moment is None:
                raise InputError(phrase(f"block.motion.{code}", kind=own.kind.KIND, photo=photo))


def known_poses(block: Block) -> Bools:
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(np.isfinite(poses).all(axis=1))


def unsupported(what: str, code: str, **fields: object) -> InputError:
    return argument_error(what, "value", value=phrase(f"block.unsupported.{code}", **fields))
