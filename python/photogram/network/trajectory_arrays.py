"""Trajectories of a block, and what is on them, as the core takes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.moving_photos import Moment, Timed
from photogram.network.observations import moments
from photogram.network.trajectories import Trajectory
from photogram.network.unknowns import Unknown

if TYPE_CHECKING:
    from photogram import _photocore

__all__ = ["Flown", "flown", "timed_images"]

TimedRow = tuple[int, int, float, int | None, int | None]
"""Indices of a photo and a trajectory, the time there, indices of rate and offset among the unknowns."""


@dataclass(frozen=True)
class Flown:
    """What the core is given of trajectories.

    Attributes
    ----------
    trajectories
        All that photos and records are on.
    timed
        Photos, then records: these follow the photos of the block.
    image_xy, image_times
        (m, 2) coordinates in the focal plane, and (m,) times on the scale of their photos; none where no
        photo is timed.
    records, positions
        How many records there are, and (r, 3) where they are about.
    """

    trajectories: list[_photocore.TrajectoryRow]
    timed: list[TimedRow]
    image_xy: Floats
    image_times: Floats
    records: int
    positions: Floats


def flown(block: Block, unknowns: Sequence[Unknown]) -> Flown:
    """Return what the core is given of the trajectories of a block, whose common unknowns are these."""
    records = moments(block.observations)
    if not block.timed and not records:
        return Flown([], [], block.image_xy, np.zeros(0), 0, np.zeros((0, 3)))
    places = {id(each): row for row, each in enumerate(unknowns)}
    trajectories = block.all_trajectories
    numbers = {id(each): number for number, each in enumerate(trajectories)}
    image_xy, image_times = block.image_xy.copy(), np.zeros(len(block.image_xy))
    timed: list[TimedRow] = []
    for own, trajectory, photo, rows in timed_images(block):
        time, image_times[rows], image_xy[rows] = own.images(block.image_xy[rows])
        rate, offset = (None if each is None else places[id(each)] for each in (own.readout, own.offset))
        timed.append((photo, numbers[id(trajectory)], time - trajectory.origin, rate, offset))
    for row, moment in enumerate(records):
        clock = None if moment.clock is None else places[id(moment.clock)]
        time = moment.time - moment.trajectory.origin
        timed.append((len(block.photo_ids) + row, numbers[id(moment.trajectory)], time, None, clock))
    return Flown(
        [each.row(places) for each in trajectories],
        timed,
        image_xy,
        image_times,
        len(records),
        np.array([_about(block, each) for each in records]).reshape(-1, 3),
    )


def timed_images(block: Block) -> Iterator[tuple[Timed, Trajectory, int, Indices]]:
    """Return the timed photos of a block: each with its trajectory, its index, and those of its images."""
    if not block.timed:
        return
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    order = np.argsort(block.image_photos, kind="stable")
    ends = np.searchsorted(block.image_photos[order], np.arange(len(rows)), side="right")
    starts = np.append(0, ends)
    for own, trajectory in zip(block.timed, block.trajectories, strict=True):
        row = rows[own.photo]
        yield own, trajectory, row, order[starts[row] : ends[row]]


def _about(block: Block, moment: Moment) -> Floats:
    """Return where a record is about, in the object space: the core asks for no more than a place."""
    if block.geographic:
        return np.nanmean(block.photo_positions, axis=0) if len(block.photo_ids) else np.zeros(3)
    table = moment.trajectory.table
    return np.asarray(table.positions[np.argmin(np.abs(table.times - moment.time))])
