"""What moves, where an adjustment has ended: the start of another."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from photogram.network.block import Block
from photogram.network.moving_photos import Timed
from photogram.network.observations import Observation, Prior, Smoothness
from photogram.network.trajectories import Coefficient, Trajectory
from photogram.results.trajectories import AdjustedTrajectory

__all__ = ["restarted_motion"]


def restarted_motion(block: Block, adjusted: Iterable[AdjustedTrajectory]) -> Block:
    """Return a block whose free coefficients of trajectories are the adjusted ones; others stay as given.

    Parameters
    ----------
    block
        The block that was adjusted.
    adjusted
        All its trajectories.
    """
    found = {id(each.given): each for each in adjusted}
    # A prior observes the value that its unknown was given.
    observed = {id(each.unknown) for each in block.observations if isinstance(each, Prior)}
    moved = {key: each.restarted(observed) for key, each in found.items()}
    coefficients: dict[int, Coefficient] = {}
    for key, each in found.items():
        for before, after in zip(each.given.coefficients, moved[key].coefficients, strict=True):
            coefficients |= {id(one): other for one, other in zip(before, after, strict=True)}
    return block.replace(
        timed=[
            _flown(each, found[id(own)], moved)
            for each, own in zip(block.timed, block.trajectories, strict=True)
        ],
        observations=[_observed(each, moved, coefficients) for each in block.observations],
    )


def _flown(own: Timed, adjusted: AdjustedTrajectory, moved: dict[int, Trajectory]) -> Timed:
    if own.trajectory is not None:
        return replace(own, trajectory=moved[id(own.trajectory)])
    velocity, rate = adjusted.position[1], adjusted.rotation[1]
    return replace(
        own,
        velocity=np.where(np.isinf(own.sd_velocity), velocity, own.velocity),
        rotation_rate=np.where(np.isinf(own.sd_rate), rate, own.rotation_rate),
    )


def _observed(
    own: Observation, moved: dict[int, Trajectory], coefficients: dict[int, Coefficient]
) -> Observation:
    if isinstance(own, Smoothness):
        return replace(own, coefficients=[coefficients[id(each)] for each in own.coefficients])
    if isinstance(own, Prior) and isinstance(own.unknown, Coefficient):
        return replace(own, unknown=coefficients[id(own.unknown)])
    if own.moment is not None:
        changes: dict[str, Any] = {"trajectory": moved[id(own.moment.trajectory)]}
        return replace(own, **changes)
    return own
