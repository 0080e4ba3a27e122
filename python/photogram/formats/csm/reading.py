"""Support data in JSON (ISDs, as ALE writes them for the Community Sensor Model)."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.csm.angles import of_quaternions
from photogram.formats.csm.isd import Framelets, Isd, Jitter, Positions, Turns
from photogram.formats.csm.line_times import fitting, read_drift, read_lines
from photogram.formats.csm.optics import instrument, not_zero, read_detector, read_lens
from photogram.io.json import Tree, read_json, unknown
from photogram.network.trajectories import increasing, rotations

__all__ = ["UNITS", "read_isd"]

_KINDS = {
    "USGS_ASTRO_LINE_SCANNER_SENSOR_MODEL": "line",
    "USGS_ASTRO_FRAME_SENSOR_MODEL": "frame",
    "USGS_ASTRO_PUSH_FRAME_SENSOR_MODEL": "push frame",
}
FRAMELETS = 100_000
"""At most in an image: each is a photo."""
UNITS = {"m": 1.0, "km": 1000.0}
"""Metres; km where nothing is said."""


def read_isd(path: Path) -> Isd:
    """Read the support data of an image.

    Raises
    ------
    InputError
        A file that is no JSON; a key that matters and is missing, or is not what it should be; a sensor or a
        lens that is not known.
    """
    tree = read_json(path)
    keywords = tree.get("naif_keywords", {})
    model = tree["name_model"]
    if model.text() not in _KINDS:
        raise unknown(model, "the sensor model", _KINDS)
    kind = cast("Any", _KINDS[model.text()])
    size = tree["image_samples"].whole(1), tree["image_lines"].whole(1)
    focal_length = not_zero(tree["focal_length_model"]["focal_length"])
    _check_frames(tree)
    detector = read_detector(tree, keywords)
    pointing, center = _turns(tree, "instrument_pointing"), tree["center_ephemeris_time"].number()
    own: dict[str, Any] = {}
    if kind != "frame" and "jitter" in tree:
        raise tree["jitter"].error("is known of frames alone")
    if kind == "line":
        drift = read_drift(keywords, instrument(tree, keywords))
        lines = read_lines(tree, center)
        own["lines"], own["remarks"] = fitting(lines, size[1], pointing.times, drift)
    elif kind == "push frame":
        own["framelets"] = _framelets(tree, size[1], float(detector.summing[1]))
    elif "jitter" in tree:
        own["jitter"] = _jitter(tree["jitter"])
    return Isd(
        path,
        kind,
        tree["name_platform"].text(),
        tree["name_sensor"].text(),
        size,
        _radii(tree["radii"]),
        focal_length,
        detector,
        read_lens(tree, focal_length),
        _positions(tree["instrument_position"]),
        pointing,
        _turns(tree, "body_rotation"),
        center,
        **own,
    )


def _check_frames(tree: Tree) -> None:
    """Refuse tables whose inertial axes are not the same."""
    tables = [tree[name] for name in ("instrument_position", "instrument_pointing", "body_rotation")]
    frames = {each["reference_frame"].whole(-(2**31)) for each in tables if "reference_frame" in each}
    if len(frames) > 1:
        raise tables[0].error(
            f"reference_frame of position, pointing and body differ: {', '.join(map(str, sorted(frames)))}"
        )


def _unit(tree: Tree) -> float:
    unit = tree.get("unit", "km")
    if unit.text() not in UNITS:
        raise unknown(unit, "the unit", UNITS)
    return UNITS[unit.text()]


def _radii(tree: Tree) -> tuple[float, float]:
    """Return semi-axes in metres."""
    a, b = (tree[name].number() * _unit(tree) for name in ("semimajor", "semiminor"))
    if not 0 < b <= a:
        raise tree.error(f"are no semi-axes with 0 < semiminor <= semimajor: {a}, {b} m")
    return a, b


def _rows(tree: Tree, width: int) -> Floats:
    """Return (k, width) numbers."""
    try:
        found = np.array(tree.value, dtype=float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.ndim != 2 or found.shape[1] != width or not np.isfinite(found).all():
        # Row by row, so that the message names the one that is at fault.
        found = np.array([row.numbers(width) for row in tree])
    if not len(found):
        raise tree.error("is empty")
    return found


def _times(tree: Tree, count: int) -> Floats:
    """Return as many times as there are records."""
    times = tree["ephemeris_times"]
    found = times.numbers(count)
    try:
        return increasing("ephemeris_times", found)
    except InputError as error:
        raise times.error(error.message) from None


def _positions(tree: Tree) -> Positions:
    places = _rows(tree["positions"], 3)
    velocities = _rows(tree["velocities"], 3) if tree.get("velocities", []).value else None
    if velocities is not None and len(velocities) != len(places):
        raise tree["velocities"].error(f"has {len(velocities)} records, positions {len(places)}")
    unit = _unit(tree)
    speeds = None if velocities is None else unit * velocities
    return Positions(_times(tree, len(places)), unit * places, speeds)


def _turns(tree: Tree, name: str) -> Turns:
    """Return K R(t): rotations of records, then the constant one."""
    own = tree[name]
    quaternions = _rows(own["quaternions"], 4)
    lengths = np.linalg.norm(quaternions, axis=1)
    if not (np.abs(lengths - 1) < 1e-3).all():
        worst = int(np.argmax(np.abs(lengths - 1)))
        raise own["quaternions"].error(f"record {worst} has the length {lengths[worst]:.6g}, not 1")
    constant = np.eye(3)
    if "constant_rotation" in own:
        given = own["constant_rotation"]
        try:
            constant = rotations("constant_rotation", given.numbers(9).reshape(1, 3, 3), 1)[0]
        except InputError as error:
            raise given.error(error.message) from None
    return Turns(_times(own, len(quaternions)), constant @ of_quaternions(quaternions))


def _framelets(tree: Tree, lines: int, summing: float) -> Framelets:
    """Return the framelets of a push frame camera: each is exposed about its own time."""
    height = tree["framelet_height"].number() / summing
    every = tree["interframe_delay"].number()
    if not (height > 0 and every > 0):
        raise tree["framelet_height"].error("is not positive, or interframe_delay is not")
    if lines % height or lines / height > FRAMELETS:
        raise tree["framelet_height"].error(
            f"does not divide the {lines} lines of the image, or into more than {FRAMELETS} framelets"
        )
    first = tree["starting_ephemeris_time"].number() + 0.5 * tree["exposure_duration"].number()
    backwards, flipped = (
        _truth(tree.get(name, False)) for name in ("framelet_order_reversed", "framelets_flipped")
    )
    return Framelets(height, round(lines / height), first, every, backwards, flipped)


def _truth(tree: Tree) -> bool:
    if not isinstance(tree.value, bool):
        raise tree.error("is neither true nor false")
    return tree.value


def _jitter(tree: Tree) -> Jitter:
    coefficients = [
        [each.number() for each in tree[f"{axis}JitterCoefficients"]] for axis in ("sample", "line")
    ]
    times = np.array([each.number() for each in tree["lineExposureTimes"]])
    if len(coefficients[0]) != len(coefficients[1]) or not len(times):
        raise tree.error("has not as many coefficients of samples as of lines, or no lineExposureTimes")
    return Jitter(np.array(coefficients), times)
