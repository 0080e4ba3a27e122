"""Validation of blocks: rules for arrays, and consistency of their parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.arrays import (
    RULES,
    argument_error,
    elements,
    frozen,
    indices,
    length,
    repeated_pairs,
    shaped,
)
from photogram.arguments.fields import checks_of
from photogram.arguments.types import Bools
from photogram.errors import InputError
from photogram.lazy_dataclasses import fields
from photogram.network.films import check_scans
from photogram.network.moving_photos import Timed, require_photos, trajectory_of
from photogram.network.observations import Rate, Velocity
from photogram.network.observations.observation import checked_observations
from photogram.network.observations.unknowns import with_knots, with_smoothness
from photogram.network.passages import Figure, checked_passages
from photogram.network.refraction import metres_per_unit
from photogram.network.rigs import checked_mounts
from photogram.network.tables import checked_cameras, different, numbered, photo_indices
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Block

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
    """Reject repeated image observations, which would count as independent."""
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
        for row in np.flatnonzero(unknown).tolist():
            raise InputError(phrase("block.moving-pose-unknown", photo=block.photo_ids[row]))
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
        for names, moment in zip(own.table["photos"], own.moments, strict=True):
            photo: Any = next((name for name in names if name in without_time), None)
            code = "scanner-time" if photo else ""
            if not code and issubclass(own.kind, Rate | Velocity):
                photo = names[0]
                at_rest = photo not in sensors and photo in block.photo_ids
                code = "at-rest" if at_rest else "sensor" if sensors.get(photo) is not None else ""
            if code and moment is None:
                raise InputError(phrase(f"block.motion.{code}", kind=own.kind.KIND, photo=photo))


def known_poses(block: Block) -> Bools:
    """Return (P,) whether the pose of each photo is known."""
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(np.isfinite(poses).all(axis=1))


def unsupported(what: str, code: str, **fields: object) -> InputError:
    """Return the error that a function does not support a part of a block."""
    return argument_error(what, "value", value=phrase(f"block.unsupported.{code}", **fields))
