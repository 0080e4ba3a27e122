"""Trajectories of a block that is to be divided: what is found of all its photos and images is told."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.lazy_dataclasses import replace
from photogram.network.block import Block, flown_by
from photogram.network.motion import timed_photos
from photogram.network.observations import Observation
from photogram.network.trajectories import Spline, Trajectory
from photogram.network.trajectory_arrays import timed_images
from photogram.results.block_files import KeptTrajectory

__all__ = ["with_flights"]


def with_flights(block: Block) -> Block:
    """Return a block whose photos are on the same trajectories, at the same times, whatever it is without.

    A photo that moves by itself is on a trajectory that is given; a scanner has a time, the middle of all its
    images; coefficients are smooth by observations alone, each of which is at home in one node.
    """
    if not flown_by(block):
        return block
    told = {id(each): _unsmoothed(each) for each in block.all_trajectories}
    timed = [
        replace(own, trajectory=told[id(trajectory)], time=own.images(block.image_xy[rows])[0])
        for own, trajectory, _, rows in timed_images(block)
    ]
    on_trajectories = timed_photos(block)[:, np.newaxis]
    return block.replace(
        timed=timed,
        observations=[_told(each, told) for each in block.observations],
        photo_position_sd=np.where(on_trajectories, np.inf, block.photo_position_sd),
        photo_attitude_sd=np.where(on_trajectories, np.inf, block.photo_attitude_sd),
    )


def _told(observation: Observation, trajectories: dict[int, Trajectory]) -> Observation:
    moment = observation.moment
    if moment is None or trajectories[id(moment.trajectory)] is moment.trajectory:
        return observation
    changes: dict[str, Any] = {"trajectory": trajectories[id(moment.trajectory)]}
    return replace(observation, **changes)


def _unsmoothed(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory with the same coefficients, of which it says nothing together."""
    changes: dict[str, Any] = {
        name: replace(basis, smooth=None, correlation=None)
        for name in ("position", "rotation")
        if isinstance(basis := getattr(trajectory, name), Spline) and basis.smoothed
    }
    return replace(KeptTrajectory.of(trajectory), **changes).original() if changes else trajectory
