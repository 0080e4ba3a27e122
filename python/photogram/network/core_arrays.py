"""A block as the core takes it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.memory import available_memory
from photogram.network.block import Block
from photogram.network.passages import passage_rows
from photogram.network.rigs import mount_rows
from photogram.network.trajectory_arrays import flown
from photogram.network.unknowns import Unknown
from photogram.show.methods import Way

__all__ = ["CoreNetwork", "CoreOptions", "block_network", "core_network"]

CoreNetwork = _photocore.BlockNetwork | _photocore.CollectionNetwork


@dataclass(frozen=True)
class CoreOptions:
    """How the core adjusts a network: the options of :func:`photogram.adjust` as it knows them.

    The criterion of a collection is `decrease`: the fraction by which a step must lower what is minimised.
    With `points_given` points start from their given coordinates where these are known, not from the
    intersection of their rays: of a block that starts where another adjustment has ended.
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


@Way
def core_network(given: object, options: CoreOptions) -> CoreNetwork:
    """Return a network of any class as the core adjusts it, and answers questions about it afterwards."""
    raise NotImplementedError(type(given).__name__)


@core_network.register
def _(given: Block, options: CoreOptions) -> CoreNetwork:
    return block_network(given, options)


def block_network(
    block: Block, options: CoreOptions, further: Sequence[Unknown] = ()
) -> _photocore.BlockNetwork:
    """Return a block as the core adjusts it, and answers questions about it afterwards.

    `further` are common unknowns of a larger block, of which this one is a part that does not observe them;
    they stand behind its own.
    """
    unknowns = [*block.unknowns, *further]
    own = flown(block, unknowns)
    cameras, photo_cameras = block.core_cameras()
    positions, attitudes = block.photo_positions_observed, block.photo_attitudes_observed
    known = np.zeros_like(own.positions)
    if own.records:
        # They have a camera of their own, and are known but for their trajectory.
        cameras = [*cameras, ("perspective", [-1.0], [0.0], None, None)]
        photo_cameras = np.append(photo_cameras, np.full(own.records, len(cameras) - 1))
    return _photocore.block_network(
        _and(block.photo_positions, own.positions),
        _and(block.photo_attitudes, known),
        _and(block.photo_positions if positions is None else positions, own.positions),
        _and(block.photo_attitudes if attitudes is None else attitudes, known),
        _and(block.photo_position_sd, known),
        _and(block.photo_attitude_sd, known),
        photo_cameras,
        cameras,
        block.point_positions,
        block.point_sd,
        block.image_photos,
        block.image_points,
        own.image_xy,
        block.image_sd,
        observation_groups=[group for _, group in block.observation_groups],
        unknowns=[each.row() for each in unknowns],
        mounts=mount_rows(block.mounts, block.timed, block.photo_ids, unknowns),
        trajectories=own.trajectories,
        timed=own.timed,
        image_times=own.image_times,
        passages=passage_rows(block.all_passages, block.point_ids, block.photo_ids, unknowns),
        records=own.records,
        spheroid=(block.spheroid.a, block.spheroid.b) if block.spheroid else None,
        photo_to_ground=block.photo_to_ground,
        refraction=block.refraction.row(block.linear_unit) if block.refraction else None,
        criterion=options.criterion,
        limit=options.limit,
        max_iterations=options.max_iterations,
        covariance=options.covariance,
        loss=options.loss,
        ordering=options.ordering,
        unit_variance=options.unit_variance,
        minimum=options.minimum,
        points_given=options.points_given,
        memory=None if fits_anywhere(block) else available_memory(),
    )


def _and(photos: Floats, records: Floats) -> Floats:
    """Return rows of photos, then those of records."""
    return np.vstack([photos, records]) if len(records) else photos


def fits_anywhere(block: Block) -> bool:
    """Whether a block is so small that asking how much memory there is would take longer than it needs.

    A full factor of 100 photos takes 3 MB, and 10,000 image points with all their results 10 MB.
    """
    others = len(block.observations) <= 100
    return others and len(block.photo_ids) <= 100 and len(block.image_xy) <= 10_000
