"""The JSON document of the truth of a simulated block."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.io import json
from photogram.network.block import Block
from photogram.network.motion import given_poses
from photogram.network.trajectories import Readout


def _records(**columns: Iterable[object]) -> list[dict[str, object]]:
    """Return the rows of columns."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def truth_json(truth: Block, images: Indices, errors: Floats) -> bytes:
    """Return true positions, attitudes and motions, and gross errors of images, as a JSON document."""
    degrees = np.array([math.degrees(1), math.degrees(1), 1.0]) if truth.geographic else np.ones(3)
    position = "longitude and latitude in degrees, height in m" if truth.geographic else "X, Y, Z in m"
    turn = "photo-to-ground" if truth.photo_to_ground else "ground-to-photo"
    units = {
        "position": position,
        "attitude_rad": f"omega, phi, kappa, {turn}",
        "error_mm": "what was added to x and y",
    }
    if truth.timed:
        units["motion"] = "s, m/s, rad/s; axes of the photo as columns"
    rows = images.tolist()
    document = {
        "units": units,
        "photos": _records(
            id=truth.photo_ids,
            position=(truth.photo_positions * degrees).tolist(),
            attitude_rad=truth.photo_attitudes.tolist(),
        ),
        "points": _records(id=truth.point_ids, position=(truth.point_positions * degrees).tolist()),
        **_true_motion(truth),
        "blunders": _records(
            photo=[truth.photo_ids[truth.image_photos[row]] for row in rows],
            point=[truth.point_ids[truth.image_points[row]] for row in rows],
            error_mm=errors.tolist(),
        ),
    }
    return json.to_json(document)


def _true_motion(truth: Block) -> dict[str, object]:
    """Return times, motions and trajectories of a moving simulated block."""
    own = [each for each in truth.timed if each.trajectory is None]
    trajectories = []
    for each in {id(each.trajectory): each.trajectory for each in truth.timed}.values():
        if each is not None:
            times = each.table.times
            places, axes = (values.tolist() for values in given_poses(each, times))
            poses = {"times": times.tolist(), "positions": places, "axes": axes}
            trajectories.append({"trajectory": each.name, **poses})
    readouts = [each for each in truth.unknowns if isinstance(each, Readout)]
    found = {
        "readouts": [{"shutter": each.name, "seconds": each.value} for each in readouts],
        "motions": _records(
            photo=[each.photo for each in own],
            velocity=[np.asarray(each.velocity).tolist() for each in own],
            rate=[np.asarray(each.rotation_rate).tolist() for each in own],
        ),
        "trajectories": trajectories,
    }
    return {name: rows for name, rows in found.items() if rows}
