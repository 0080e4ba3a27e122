"""Validation of blocks: rules for arrays, and consistency of their parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.arrays import (
    argument_error,
    frozen,
    indices,
    length,
    repeated_pairs,
    shaped,
    text,
    truth_value,
)
from photogram.arguments.objects import instances, kind_error, require_kind
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.network.films import check_scans
from photogram.network.frame import Frame
from photogram.network.geometry import Spheroid
from photogram.network.moving_photos import checked_timed, own_trajectories
from photogram.network.observations import Observation, Rate, Velocity
from photogram.network.observations.unknowns import with_knots, with_smoothness
from photogram.network.passages import Figure, checked_passages
from photogram.network.refraction import Refraction, metres_per_unit
from photogram.network.rigs import checked_mounts
from photogram.network.tables import checked_cameras, different, numbered, photo_indices
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Block

_ANGLES = 1e6  # Radians; larger angles do not have the digits that an attitude needs
RULES: dict[str, Callable[[Floats], Bools]] = {
    "finite": np.isfinite,
    "not-infinite": lambda values: ~np.isinf(values),
    "angle": lambda values: np.isnan(values) | (np.abs(values) <= _ANGLES),
    "not-zero": lambda values: np.isfinite(values) & (values != 0),
    "positive": lambda values: (values > 0) & np.isfinite(values),
    "sd": lambda values: values >= 0,
    "check-sd": lambda values: np.isnan(values) | ((values >= 0) & ~np.isinf(values)),
}
_WITH_NAN = ("not-infinite", "angle", "check-sd")
ARRAYS = (
    ("photo_positions", "photos", 3, "not-infinite"),
    ("photo_attitudes", "photos", 3, "angle"),
    ("principal_distances", "photos", 0, "not-zero"),
    ("point_positions", "points", 3, "not-infinite"),
    ("photo_position_sd", "photos", 3, "sd"),
    ("photo_attitude_sd", "photos", 3, "sd"),
    ("point_sd", "points", 3, "sd"),
    ("photo_positions_observed", "photos", 3, "not-infinite"),
    ("photo_attitudes_observed", "photos", 3, "angle"),
    ("point_check_sd", "points", 3, "check-sd"),
    ("image_xy", "images", 2, "finite"),
    ("image_sd", "images", 2, "positive"),
)
"""Arrays of a block: name, rows, columns (0 for one number in each row), and rule."""
OPTIONAL = ("photo_positions_observed", "photo_attitudes_observed", "point_check_sd")


def check_block(block: Block) -> None:
    """Convert and check all fields of a new block."""
    for name, positions in (("photo_ids", "photo_positions"), ("point_ids", "point_positions")):
        names = getattr(block, name)
        names = numbered(length(positions, getattr(block, positions))) if names is None else names
        block._set(name, different(name, names))
    block._set("cameras", checked_cameras(block.cameras))
    if not block.cameras and block.photo_cameras is not None:
        raise InputError(phrase("error.requires", name="photo_cameras", other="cameras"))
    if block.cameras and block.principal_distances is not None:
        raise InputError(phrase("error.exclusive", first="principal_distances", second="cameras"))
    photos, points = len(block.photo_ids), len(block.point_ids)
    if block.cameras:
        block._set("photo_cameras", frozen(photo_indices(block.photo_cameras, block.cameras, photos)))
    counts = {"photos": photos, "points": points, "images": length("image_photos", block.image_photos)}
    for name, rows, columns, rule in ARRAYS:
        if name == "image_xy":  # Errors of images name their photos and points
            for of, count in (("image_photos", photos), ("image_points", points)):
                block._set(of, indices(of, getattr(block, of), counts["images"], count))
        value = getattr(block, name)
        if value is None and (name in OPTIONAL or (name == "principal_distances" and block.cameras)):
            continue
        shape = (counts[rows], columns) if columns else (counts[rows],)
        array = shaped(name, value, shape, missing=rule in _WITH_NAN)
        block._set(name, array)
        refuse(block, name, rows, ~RULES[rule](array), rule)
    unknown_control = np.isfinite(block.point_sd) & np.isnan(block.point_positions)
    refuse(block, "point_positions", "points", unknown_control, "control-unknown")
    _check_observed(block)
    _check_repeated(block)
    _check_conventions(block)
    _check_observations(block)


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


def _check_conventions(block: Block) -> None:
    text("title", block.title)
    text("linear_unit", block.linear_unit)
    block._set("photo_to_ground", truth_value("photo_to_ground", block.photo_to_ground))
    require_kind("spheroid", block.spheroid, Spheroid, optional=True)
    require_kind("frame", block.frame, Frame)
    require_kind("refraction", block.refraction, Refraction, optional=True)
    if block.refraction is not None:
        metres_per_unit(block.linear_unit)


def _check_observations(block: Block) -> None:
    block._set("observations", instances("observations", block.observations, Observation))
    for row, observation in enumerate(block.observations):
        if not observation.KIND:
            raise kind_error(f"observations[{row}]", "an Observation", observation)
    block._set("mounts", checked_mounts(block.mounts, block.photo_ids))
    _check_free_poses(block, [mount.photo for mount in block.mounts], "mounted")
    _check_timed(block)
    _check_motions(block)
    block._set("passages", checked_passages(block.passages, block.point_ids, block.photo_ids))
    block._set("observations", with_smoothness(block.observations, block.trajectories))
    block._set("observations", with_knots(block.observations, block.cameras))
    _ = block.observation_groups  # rejects observations of other points and photos
    figures = {
        name: each.title for each in block.passages if isinstance(each, Figure) for name in each.points
    }
    observed = {name for each in block.observations for name in each.points} if figures else set()
    for row, name in enumerate(block.point_ids if figures else ()):
        if name in figures and (block.point_sd[row].any() or name in observed):
            raise InputError(phrase("block.figure-point", point=name, figure=figures[name]))
    photo_cameras = block.photo_cameras if block.cameras else None
    check_scans(block.passages, block.photo_ids, block.cameras, photo_cameras, block.image_photos)


def _check_free_poses(block: Block, photos: list[str], rule: str) -> None:
    """Reject standard deviations of poses that are not unknowns."""
    if photos:
        rows = np.isin(block.photo_ids, photos)[:, np.newaxis]
        for name in ("photo_position_sd", "photo_attitude_sd"):
            refuse(block, name, "photos", rows & np.isfinite(getattr(block, name)), rule)


def _check_timed(block: Block) -> None:
    block._set("timed", checked_timed(block.timed, block.photo_ids))
    own = [each.photo for each in block.timed if each.trajectory is None]
    if own:
        poses = np.hstack([block.photo_positions, block.photo_attitudes])
        unknown = np.isnan(poses).any(axis=1) & np.isin(block.photo_ids, own)
        for row in np.flatnonzero(unknown).tolist():
            raise InputError(phrase("block.moving-pose-unknown", photo=block.photo_ids[row]))
    block._set("_trajectories", own_trajectories(block))
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
    for each in block.observations:
        if each.moment is not None:
            continue
        photo: Any = next((name for name in each.photos if name in without_time), None)
        code = "scanner-time" if photo else ""
        if not code and isinstance(each, Rate | Velocity):
            photo = each.photos[0]
            at_rest = photo not in sensors and photo in block.photo_ids
            code = "at-rest" if at_rest else "sensor" if sensors.get(photo) is not None else ""
        if code:
            raise InputError(phrase(f"block.motion.{code}", kind=each.KIND, photo=photo))


def known_poses(block: Block) -> Bools:
    """Return (P,) whether the pose of each photo is known."""
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(np.isfinite(poses).all(axis=1))


def unsupported(what: str, code: str, **fields: object) -> InputError:
    """Return the error that a function does not support a part of a block."""
    return argument_error(what, "value", value=phrase(f"block.unsupported.{code}", **fields))
