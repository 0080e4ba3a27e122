"""Conversion of a block to the arrays of the core."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.memory import available_memory
from photogram.network.block import Block
from photogram.network.motion import timed_images
from photogram.network.moving_photos import Moment
from photogram.network.observations import moments
from photogram.network.unknowns import Unknown

CoreNetwork = _photocore.BlockNetwork | _photocore.CollectionNetwork

TimedRow = tuple[int, int, float, int | None, int | None]
"""Indices of photo and trajectory, time, and indices of the unknown rate and offset."""


@dataclass(frozen=True)
class CoreOptions:
    """Options of :func:`photogram.adjust` for the core.

    The criterion of a collection is `decrease`: the minimum relative decrease of the objective function in a
    step. `points_given` starts points at their given coordinates, if known, instead of the intersection of
    their rays. It is used for a block that continues another adjustment.
    """

    criterion: str
    limit: float
    max_iterations: int
    covariance: bool
    loss: tuple[str, float] | None
    ordering: str
    unit_variance: str
    minimum: tuple[int, tuple[int, int] | None] | None
    points_given: bool = False


def block_network(
    block: Block, options: CoreOptions, further: Sequence[Unknown] = ()
) -> _photocore.BlockNetwork:
    """Create the core network that adjusts a block and evaluates it afterwards.

    `further` are shared unknowns of a larger block that this part does not observe. They follow its own.
    """
    unknowns = [*block.unknowns, *further]
    places = {id(each): row for row, each in enumerate(unknowns)}
    flown, image_xy, records = _flown(block, places)
    # On a trajectory, a photo represents its own frame.
    mounts = [(each.photo, each.frame, each.sensor) for each in block.mounts]
    mounts += [(each.photo, each.photo, each.sensor) for each in block.timed if each.sensor is not None]
    cameras, photo_cameras = block.core_cameras()
    positions, attitudes = block.photo_positions_observed, block.photo_attitudes_observed
    known = np.zeros_like(records)
    if len(records):
        # Records have a camera of their own, and only their trajectory is unknown.
        cameras = [*cameras, ("perspective", [-1.0], [0.0], None, None)]
        photo_cameras = np.append(photo_cameras, np.full(len(records), len(cameras) - 1))
    return _photocore.block_network(
        _and(block.photo_positions, records),
        _and(block.photo_attitudes, known),
        _and(block.photo_positions if positions is None else positions, records),
        _and(block.photo_attitudes if attitudes is None else attitudes, known),
        _and(block.photo_position_sd, known),
        _and(block.photo_attitude_sd, known),
        photo_cameras,
        cameras,
        block.point_positions,
        block.point_sd,
        block.image_photos,
        block.image_points,
        image_xy,
        block.image_sd,
        observation_groups=block.observation_groups,
        unknowns=[each.row() for each in unknowns],
        mounts=[
            (block._photo_rows[photo], block._photo_rows[frame], places[id(sensor)])
            for photo, frame, sensor in mounts
        ],
        **flown,
        passages=[
            (
                each.KIND,
                [places[id(own)] for own in each.unknowns],
                each.of(block._point_rows, block._photo_rows),
                each.numbers(),
            )
            for each in block.all_passages
        ],
        records=len(records),
        spheroid=(block.spheroid.a, block.spheroid.b) if block.spheroid else None,
        photo_to_ground=block.photo_to_ground,
        refraction=block.refraction.row(block.linear_unit) if block.refraction else None,
        **vars(options),
        memory=None if fits_anywhere(block) else available_memory(),
    )


def _flown(block: Block, places: dict[int, int]) -> tuple[dict[str, Any], Floats, Floats]:
    """Return trajectory arguments, focal-plane images (m, 2) and record positions (r, 3).

    Records follow the photos of the block. `places` are indices of unknowns by object identity.
    """
    records = moments(block.observations)
    if not block.timed and not records:
        return {"trajectories": [], "timed": [], "image_times": np.zeros(0)}, block.image_xy, np.zeros((0, 3))
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
    shared = [each.row(places) for each in trajectories]
    near = np.array([_about(block, each) for each in records]).reshape(-1, 3)
    return {"trajectories": shared, "timed": timed, "image_times": image_times}, image_xy, near


def _about(block: Block, moment: Moment) -> Floats:
    """Return an approximate position of a record in object space, which is all the core needs."""
    if block.geographic:
        return np.nanmean(block.photo_positions, axis=0) if len(block.photo_ids) else np.zeros(3)
    table = moment.trajectory.table
    return np.asarray(table.positions[np.argmin(np.abs(table.times - moment.time))])


def _and(photos: Floats, records: Floats) -> Floats:
    return np.vstack([photos, records]) if len(records) else photos


def fits_anywhere(block: Block) -> bool:
    """Return whether a block is too small for a useful check of the available memory.

    A full factor of 100 photos takes 3 MB, and 10,000 image points with all their results 10 MB.
    """
    others = len(block.observations) <= 100
    return others and len(block.photo_ids) <= 100 and len(block.image_xy) <= 10_000
