"""Facts on a network that the core requires for hypotheses, besides the network."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.network.block import Block
from photogram.network.strips import strips_of

Facts = dict[str, Any]  # See `NetworkTrial.hypotheses`

MOST_SETS = 8  # Largest number of sets of positions or control that are tested

NO_FACTS: Facts = {
    "velocities": np.empty((0, 3)),
    "times": [],
    "position_sets": [],
    "control_sets": [],
    "readouts": [],
    "widths": [],
    "checks": [],
    "centre": None,
}


def block_facts(block: Block, places: Floats) -> Facts:
    """Return facts for hypotheses on a block: velocities, sets, sizes of images.

    `places` are the (P, 3) adjusted positions of photos.
    """
    count = len(block.photo_ids)
    cameras = np.zeros(count, dtype=np.int64) if block.photo_cameras is None else block.photo_cameras
    facts: Facts = {"widths": [], "readouts": []}
    of_images = cameras[block.image_photos]
    low, high = (np.full((max(len(block.cameras), 1), 2), end) for end in (math.inf, -math.inf))
    for axis, values in enumerate(block.image_xy.T):
        # Faster than both coordinates together, which numpy adds row by row.
        np.minimum.at(low[:, axis], of_images, values)
        np.maximum.at(high[:, axis], of_images, values)
    for camera, (width, height) in enumerate((high - low).tolist()):
        facts["widths"].append(width if width > 0 else math.nan)
        digital = bool(block.cameras) and block.cameras[camera].unit == "px" and height > 0
        middle = float(low[camera, 1] + high[camera, 1]) / 2
        facts["readouts"].append([0.0, 1 / height, -middle / height] if digital else None)
    if block.geographic:
        return facts
    seconds = np.full(count, math.nan)
    row = {name: k for k, name in enumerate(block.photo_ids)}
    for columns in block.observations.columns:
        if columns.kind.KIND == "position":
            for photos, time in zip(columns.table["photos"], columns.table["time"], strict=True):
                if photos and photos[0] in row:
                    seconds[row[photos[0]]] = time
    timed = bool(np.isfinite(seconds).all() and np.ptp(seconds) > 0)
    times = seconds if timed else np.arange(count, dtype=np.float64)
    velocities, sets = np.full((count, 3), math.nan), np.full(count, -1)
    strips = strips_of(places) if count > 1 else []
    for number, strip in enumerate(strips):
        sets[strip] = number
        if len(strip) > 1 and (np.diff(times[strip]) > 0).all():
            velocities[strip] = np.gradient(places[strip], times[strip], axis=0)
    facts["velocities"] = velocities
    if count > 1:
        # Without times, the order of the photos is used.
        facts |= {"times": times.tolist(), "timed": timed}
    if 1 < len(strips) <= MOST_SETS:
        facts["position_sets"] = sets.tolist()
    control = np.flatnonzero(np.isfinite(block.point_sd).any(axis=1))
    _, kinds, sizes = np.unique(block.point_sd[control], axis=0, return_inverse=True, return_counts=True)
    if 1 < len(sizes) <= MOST_SETS and (sizes > 1).all():
        control_sets: list[int | None] = [None] * len(block.point_sd)
        for point, kind in zip(control.tolist(), kinds.tolist(), strict=True):
            control_sets[point] = kind
        facts["control_sets"] = control_sets
    return facts
