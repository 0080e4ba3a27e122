"""Clock offsets equal to time scale differences, and half-line offsets of scans."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np

from photogram.diagnosis.findings import Finding, finding
from photogram.diagnosis.mistakes import Adjuster
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.moving_photos import Timed
from photogram.network.trajectories import Clock
from photogram.results.result import Result
from photogram.words import phrase

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
