"""Rolling shutters whose readout is given wrongly: its direction, its unit, rows for columns."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from photogram.diagnosis.adjusting import Adjuster, put_right
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.moving_photos import Direction, Shutter, Timed
from photogram.network.trajectories import Readout
from photogram.results.fixed_tests import is_suspected
from photogram.results.result import Result

SIGNIFICANT = 5.0
"""Standard deviations of a readout time below zero."""
LONGEST = 1.0
"""Seconds: no shutter reads for longer; such a number is one of milliseconds."""
MILLISECOND = 1e-3
OTHER: dict[Direction, Direction] = {"down": "up", "up": "down", "right": "left", "left": "right"}


def shutter_hints(block: Block, first: Result | None, adjusted: Adjuster) -> list[Message]:
    """Try other readouts of rolling shutters where the adjustment has failed, or residuals are too large.

    Parameters
    ----------
    block
        The block.
    first
        Its adjustment; None where that has failed.
    adjusted
        Adjusts what is tried.
    """
    if not any(each.shutter is not None for each in block.timed):
        return []
    if first is not None and first.converged and (first.loss or not is_suspected(first)):
        return []
    found = put_right(first, _tried(block), adjusted)
    if found is None:
        return []
    text, _, verdict = found
    return [Message(f"probably {text}: residuals would be {verdict.fall:.3g} times smaller")]


def backward_readouts(result: Result) -> list[Message]:
    """Name readout times that are negative: what fits, but is read the other way."""
    own = {id(each.shutter.readout) for each in result.block.timed if each.shutter is not None}
    return [
        Message(
            f"{each.given.title} is {each.position[0]:.4g} s (sd {each.sd[0]:.2g}): the shutter reads against"
            " the direction that is given, from the other edge"
        )
        for each in result.unknowns
        if id(each.given) in own and each.position[0] < -SIGNIFICANT * each.sd[0]
    ]


def _tried(block: Block) -> Iterator[tuple[str, Block]]:
    """Return what may have been meant by the shutters of a block."""
    ends = {True: _ends(block, 0), False: _ends(block, 1)}

    def opposite(own: Shutter) -> Shutter:
        return replace(own, edges=own.edges[::-1], direction=OTHER[own.direction])

    def across(own: Shutter) -> Shutter:
        rows = own.direction in ("down", "up")
        return replace(own, edges=ends[rows], direction="right" if rows else "down")

    def across_back(own: Shutter) -> Shutter:
        return opposite(across(own))

    yield "shutters read in the other direction, from the other edge", _changed(block, opposite)
    rows = any(own.shutter.direction in ("down", "up") for own in block.timed if own.shutter is not None)
    other = "columns, not rows" if rows else "rows, not columns"
    yield f"shutters read {other}, from the beginning", _changed(block, across)
    if not all(_is_free(each) for each in block.timed if each.shutter is not None):
        # A free readout time has the sign that fits.
        yield f"shutters read {other}, from the end", _changed(block, across_back)
    if any(_seconds(each) > LONGEST for each in block.timed):
        known: dict[int, Readout] = {}

        def thousandth(own: Shutter) -> Shutter:
            readout = own.readout
            if not isinstance(readout, Readout):
                return replace(own, readout=MILLISECOND * readout)
            meant = replace(
                readout, value=MILLISECOND * readout.value, sd=MILLISECOND * np.asarray(readout.sd)
            )
            return replace(own, readout=known.setdefault(id(readout), meant))

        yield "readout times are milliseconds, not seconds", _changed(block, thousandth)


def _is_free(own: Timed) -> bool:
    return own.readout is not None and bool(np.isinf(own.readout.sd).all())


def _seconds(own: Timed) -> float:
    """Return the readout time of a photo, 0 without a shutter."""
    if own.shutter is None or own.readout is None:
        return 0.0
    return abs(float(own.readout.position[0]))


def _changed(block: Block, change: Callable[[Shutter], Shutter]) -> Block:
    """Return a block with other shutters."""
    return block.replace(
        timed=[
            each if each.shutter is None else replace(each, shutter=change(each.shutter))
            for each in block.timed
        ]
    )


def _ends(block: Block, axis: int) -> tuple[float, float]:
    """Return the left and right edge, or the upper and lower one, as far as images reach."""
    low, high = float(block.image_xy[:, axis].min()), float(block.image_xy[:, axis].max())
    down = any(each.image_y == "down" for each in block.cameras)
    return (low, high) if axis == 0 or down else (high, low)
