"""Mistakes in what photos on trajectories are given, found by trying: the rule is that of photos at rest.

Images are predicted from the tables (:mod:`photogram.diagnosis.trajectory_images`), observed positions
likewise: their misfit is that from the trajectory at their time, in their spread.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from photogram.arguments.arrays import shaped
from photogram.arguments.types import Floats
from photogram.diagnosis.conventions import SUSPICION, Verdict, passing
from photogram.diagnosis.hypotheses import Hypothesis
from photogram.diagnosis.regression import UNKNOWN, relative
from photogram.diagnosis.trajectory_hypotheses import flown_hypotheses, shifted_records, shifts
from photogram.diagnosis.trajectory_images import flown_misfits, flown_view
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.moving_photos import Moment
from photogram.network.observations import Position
from photogram.network.unknowns import LeverArm

__all__ = ["flown_hints"]


def flown_hints(block: Block) -> list[Message]:
    """Look for mistakes in tables and times of trajectories, and in how the lines of scanners are counted.

    Returns
    -------
    Sentences that each name a mistake that would explain why images, or observed positions, do not fit their
    trajectories; none where they do. Nothing is corrected.
    """
    with np.errstate(all="ignore"):
        return [Message(each.text) for each in (*_of_images(block), *_of_records(block))]


def _of_images(block: Block) -> list[Verdict]:
    if not block.timed:
        return []
    looked, photos = flown_view(block)
    given = flown_misfits(looked, photos)
    if not len(photos) or np.median(given) <= SUSPICION:
        return []
    found = passing(flown_hypotheses(looked, photos), looked, given, partial(flown_misfits, photos=photos))
    return [Verdict(found, float(np.median(given)))] if found else []


def _of_records(block: Block) -> list[Verdict]:
    """Try other scales of time for observed positions."""
    given = _records_misfit(block)
    if not given[0] > SUSPICION:
        return []
    tried = (
        Hypothesis(f"records {seconds:+g} s", text, partial(shifted_records, seconds=seconds))
        for text, seconds in shifts("observed positions")
    )
    found = passing(tried, block, given, _records_misfit)
    return [Verdict(found, float(given[0]), what="observed positions")] if found else []


def _records_misfit(block: Block) -> Floats:
    """(1,) m of all observed positions on trajectories; 0 without any, very large where most are beyond."""
    records: dict[int, list[tuple[Moment, Position]]] = {}
    for each in block.observations:
        if isinstance(each, Position) and (moment := each.moment) is not None:
            records.setdefault(id(moment.trajectory), []).append((moment, each))
    apart, places, inside = [np.zeros((0, 3))], [np.zeros((0, 3))], 0
    for own in records.values():
        trajectory = own[0][0].trajectory
        clocks = [0.0 if at.clock is None else float(at.clock.position[0]) for at, _ in own]
        times = np.array([at.time for at, _ in own]) + clocks
        ends = trajectory.reach
        inside += int(np.count_nonzero((times >= ends[0]) & (times <= ends[1])))
        given = (np.array([each.position for each in part]) for part in trajectory.coefficients)
        centres, turned, *_ = trajectory.flown(np.clip(times, *ends), *given)
        arms = [
            each.lever_arm.position
            if isinstance(each.lever_arm, LeverArm)
            else shaped("lever arm", each.lever_arm, (3,))
            for _, each in own
        ]
        computed = centres + np.einsum("nij,nj->ni", turned.reshape(-1, 3, 3), np.array(arms))
        places.append(np.array([np.asarray(each.position) for _, each in own]))
        apart.append(places[-1] - computed)
    observed = np.concatenate(places)
    if not len(observed):
        return np.zeros(1)
    m = relative(np.concatenate(apart), observed) if 2 * inside >= len(observed) else UNKNOWN
    return np.array([m])
