"""Wrong readouts of rolling shutters, clocks of another time scale, and wrong line counts of scanners."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import permutations

import numpy as np

from photogram.diagnosis.findings import Finding, finding
from photogram.diagnosis.mistakes import Adjuster, Proposal, explain
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.moving_photos import Direction, Shutter, Timed
from photogram.network.trajectories import Clock, Readout
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


LEAPS = range(13, 19)  # GPS - UTC in seconds from 1999 on; 18 since 2017
TAI_GPS, ET_TAI = 19.0, 32.184  # TAI - GPS and ET - TAI, seconds; ET as in SPICE, within 2 ms
WITHIN = 0.010  # Seconds within which a time shift equals a difference of scales


def shifts() -> Iterator[tuple[str, str, float]]:
    """Yield time scales of data and of a table, and the seconds that convert times of the data."""
    ahead_of_gps = {"TAI": TAI_GPS, "ET": TAI_GPS + ET_TAI, "GPS": 0.0}
    for leap in reversed(LEAPS):
        scales = {**ahead_of_gps, "UTC": -float(leap)}
        for of_data, of_table in permutations(scales, 2):
            if leap == LEAPS[-1] or "UTC" in (of_data, of_table):
                yield of_data, of_table, scales[of_table] - scales[of_data]


SIGNIFICANT = 5.0
HALVES, NEARLY = (0.5, 1.0), 0.1  # Lines


def known_offsets(result: Result) -> list[Message]:
    """Return messages on clock offsets that equal known differences of time scales."""
    found = []
    for each in result.unknowns:
        offset = float(each.position[0])
        scales = [
            phrase("moving.time-scales", first=table, second=scale, seconds=seconds)
            for scale, table, seconds in shifts()
            if abs(offset - seconds) < WITHIN
        ]
        if scales and isinstance(each.given, Clock) and abs(offset) > SIGNIFICANT * each.sd[0]:
            message = phrase("moving.clock-offset", clock=each.given.title, offset=offset, scales=scales)
            found.append(Message(message))
    return found


def counted_lines(block: Block, adjusted: Adjuster) -> list[Finding]:
    """Find scanners whose lines are off by one half or one, from a free time offset.

    Scanners with the same seconds per line share one offset, unless they have an offset of their own.
    """
    clocks: dict[float, Clock] = {}

    def freed(own: Timed) -> Timed:
        if own.lines is None or own.offset is not None:
            return own
        rate = float(np.median(np.asarray(own.lines.table)[:, 2]))
        return replace(own, offset=clocks.setdefault(rate, Clock(f"lines of {rate:g} s")))

    timed, found = [freed(each) for each in block.timed], list[Finding]()
    result = adjusted.converged(block.replace(timed=timed)) if clocks else None
    for own in () if result is None else result.unknowns:
        for rate, clock in clocks.items():
            lines, sd = float(own.position[0] / abs(rate)), float(own.sd[0] / abs(rate))
            near = any(abs(abs(lines) - half) < NEARLY for half in HALVES)
            if own.given is clock and near and abs(lines) > SIGNIFICANT * sd:
                names = [each.photo for each in timed if each.offset is clock]
                message = phrase("check.line-count", photos=names, lines=lines)
                found.append(finding("look", message, names, values={"lines": lines, "sd": sd}))
    return found
