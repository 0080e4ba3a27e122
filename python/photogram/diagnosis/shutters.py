"""Wrong parameters of rolling shutters: direction, unit, or rows instead of columns."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.diagnosis.mistakes import Adjuster, Proposal, explain
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.moving_photos import Direction, Shutter
from photogram.network.trajectories import Readout
from photogram.results.result import Result
from photogram.words import phrase

SIGNIFICANT = 5.0  # Standard deviations of a negative readout time
LONGEST = 1.0  # Seconds: longest readout; a larger number is in milliseconds
MILLISECOND = 1e-3
OTHER: dict[Direction, Direction] = {"down": "up", "up": "down", "right": "left", "left": "right"}


def readout_hints(block: Block, adjusted: Adjuster) -> list[Message]:
    """Try other rolling shutter readouts if the adjustment failed or fits badly."""
    if not any(each.shutter is not None for each in block.timed):
        return []
    found = explain(block, _proposals(block), adjusted)
    return [Message(found.message())] if found is not None and found.is_certain else []


def backward_readouts(result: Result) -> list[Message]:
    """Report negative readout times, which fit but mean the opposite direction."""
    own = {id(each.shutter.readout) for each in result.block.timed if each.shutter is not None}
    return [
        Message(
            phrase(
                "moving.backward-readout",
                readout=each.given.title,
                value=float(each.position[0]),
                sd=float(each.sd[0]),
            )
        )
        for each in result.unknowns
        if id(each.given) in own and each.position[0] < -SIGNIFICANT * each.sd[0]
    ]


def _proposals(block: Block) -> Iterator[Proposal]:
    ends = {True: _ends(block, 0), False: _ends(block, 1)}

    def opposite(own: Shutter) -> Shutter:
        return replace(own, edges=own.edges[::-1], direction=OTHER[own.direction])

    def across(own: Shutter) -> Shutter:
        rows = own.direction in ("down", "up")
        return replace(own, edges=ends[rows], direction="right" if rows else "down")

    shutters = [own.shutter for own in block.timed if own.shutter is not None]
    readouts = {id(own.readout): own.readout for own in shutters if isinstance(own.readout, Readout)}
    code = "columns" if any(own.direction in ("down", "up") for own in shutters) else "rows"
    changes: dict[str, Callable[[Shutter], Shutter]] = {"opposite": opposite, f"{code}.first": across}
    if not all(np.isinf(own.sd).all() for own in readouts.values()):
        # A free readout time adopts the sign that fits.
        changes[f"{code}.last"] = lambda own: opposite(across(own))
    if any(abs(float(own.position[0])) > LONGEST for own in readouts.values()):
        thousandth = {
            key: replace(own, value=MILLISECOND * own.value, sd=MILLISECOND * np.asarray(own.sd))
            for key, own in readouts.items()
        }
        changes["milliseconds"] = lambda own: replace(own, readout=thousandth[id(own.readout)])
    for name, change in changes.items():
        yield Proposal(name, phrase(f"mistake.shutter.{name}"), partial(_changed, change=change))


def _changed(block: Block, change: Callable[[Shutter], Shutter]) -> Block:
    return block.replace(
        timed=[
            each if each.shutter is None else replace(each, shutter=change(each.shutter))
            for each in block.timed
        ]
    )


def _ends(block: Block, axis: int) -> tuple[float, float]:
    """Return the left and right, or upper and lower, limit of the observations."""
    low, high = float(block.image_xy[:, axis].min()), float(block.image_xy[:, axis].max())
    down = any(each.image_y == "down" for each in block.cameras)
    return (low, high) if axis == 0 or down else (high, low)
