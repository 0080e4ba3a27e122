"""What a plan promises of motion: readout times, velocities and rates of photos, trajectories."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.trajectories import Readout
from photogram.results.result import Result
from photogram.results.trajectories import AdjustedTrajectory

__all__ = ["MotionQuality", "motion_quality", "photo_redundancy", "with_known_readout"]

PLACES = 25
"""Times at which a trajectory is looked at, evenly between its first image and its last."""


@dataclass(frozen=True)
class MotionQuality:
    """What is expected of a motion that all photos, or all trajectories, have.

    Attributes
    ----------
    unknown
        "readout time" with its name, "velocity", "rate" (of photos with motions of their own), "position of
        trajectories" or "rotation of trajectories" (anywhere between their images).
    unit
        "s", the linear unit a second, "rad/s", the linear unit or "rad".
    rms_sd, max_sd
        Root mean square and largest of the expected standard deviations of its components.
    """

    unknown: str
    unit: str
    rms_sd: float
    max_sd: float


def motion_quality(result: Result) -> list[MotionQuality]:
    """Return what a predicted block promises of motions; nothing where nothing moves."""
    block = result.block
    if not block.timed:
        return []
    found = [
        MotionQuality(f"readout time, {each.name}", "s", float(each.sd[0]), float(each.sd[0]))
        for each in result.unknowns
        if isinstance(each.given, Readout) and not each.given.is_held
    ]
    own = [result.trajectories[each.photo] for each in block.timed if each.trajectory is None]
    linear = block.linear_unit
    if own:
        found.append(_quality("velocity", f"{linear}/s", np.array([each.position_sd[1] for each in own])))
        found.append(_quality("rate", "rad/s", np.array([each.rotation_sd[1] for each in own])))
    if sds := [result.trajectories[name].poses(times).sd for name, times in _looked_at(block).items()]:
        sd = np.concatenate(sds)
        found.append(_quality("position of trajectories", linear, sd[:, :3]))
        found.append(_quality("rotation of trajectories", "rad", sd[:, 3:]))
    return found


def _quality(unknown: str, unit: str, sd: Floats) -> MotionQuality:
    return MotionQuality(unknown, unit, math.sqrt((sd**2).mean()), float(sd.max()))


def _looked_at(block: Block) -> dict[str, Floats]:
    """Return the times at which the trajectories that photos share are looked at, by their names."""
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    order = np.argsort(block.image_photos, kind="stable")
    bounds = np.searchsorted(block.image_photos[order], np.arange(len(rows) + 1))
    spans: dict[str, tuple[float, float]] = {}
    for each in block.timed:
        row = rows[each.photo]
        own = order[bounds[row] : bounds[row + 1]]
        if each.trajectory is None or not len(own):
            continue
        time, since, _ = each.images(block.image_xy[own])
        scale = 1.0 if each.readout is None else float(each.readout.position[0])
        times = time + scale * since
        first, last = spans.get(each.trajectory.name, (math.inf, -math.inf))
        spans[each.trajectory.name] = min(first, float(times.min())), max(last, float(times.max()))
    return {name: np.linspace(*span, PLACES) for name, span in spans.items()}


def photo_redundancy(result: Result) -> Floats:
    """(P, 6) redundancy numbers of what is given of positions and attitudes, of photos that move too."""
    own = {each.photo for each in result.block.timed if each.trajectory is None}
    found = result.photo_redundancy.copy()
    for row, name in enumerate(result.block.photo_ids):
        if name in own:
            found[row] = _first(result.trajectories[name])
    return found


def _first(trajectory: AdjustedTrajectory) -> Floats:
    return np.concatenate([trajectory.position_redundancy[0], trajectory.rotation_redundancy[0]])


def with_known_readout(block: Block) -> Block | None:
    """Return a block whose readout times are known; None where all of them are."""
    known: dict[int, Readout] = {}
    timed = []
    for each in block.timed:
        own = each.readout
        if each.shutter is not None and own is not None and not own.is_held:
            readout = known.setdefault(id(own), Readout(own.name, own.value, 0.0))
            each = replace(each, shutter=replace(each.shutter, readout=readout))
        timed.append(each)
    return block.replace(timed=timed) if known else None
