"""Offsets of clocks that are differences of scales of time; lines of scanners that are counted otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from photogram.diagnosis.adjusting import Adjuster
from photogram.diagnosis.findings import Finding
from photogram.diagnosis.time_bases import named
from photogram.messages import Message, listed
from photogram.network.block import Block
from photogram.network.moving_photos import Timed
from photogram.network.trajectories import Clock
from photogram.results.result import Result

__all__ = ["counted_lines", "known_offsets"]

SIGNIFICANT = 5.0
HALVES, NEARLY = (0.5, 1.0), 0.1
"""Lines."""


def known_offsets(result: Result) -> list[Message]:
    """Name offsets of clocks that are known differences of scales of time."""
    found = []
    for each in result.unknowns:
        offset = float(each.position[0])
        if isinstance(each.given, Clock) and abs(offset) > SIGNIFICANT * each.sd[0] and named(offset):
            found.append(
                Message(
                    f"{each.given.title} is {offset:.4f} s, the difference {named(offset)}: are its times and"
                    " those of the trajectories in different scales?"
                )
            )
    return found


def counted_lines(block: Block, adjusted: Adjuster) -> list[Finding]:
    """Look for scanners whose lines are counted half a line, or one, off: a free offset of their time.

    Scanners with as many seconds per line have one offset; those with an offset of their own are left out.
    """
    clocks: dict[float, Clock] = {}

    def freed(own: Timed) -> Timed:
        if own.lines is None or own.offset is not None:
            return own
        rate = float(np.median(np.asarray(own.lines.table)[:, 2]))
        return replace(own, offset=clocks.setdefault(rate, Clock(f"lines of {rate:g} s")))

    timed = [freed(each) for each in block.timed]
    result = adjusted.tried(block.replace(timed=timed)) if clocks else None
    if result is None or not result.converged:
        return []
    return list(_off(result, clocks, timed))


def _off(result: Result, clocks: dict[float, Clock], timed: list[Timed]) -> Iterator[Finding]:
    values = {id(each.given): each for each in result.unknowns}
    for rate, clock in clocks.items():
        lines, sd = (
            float(each[0] / abs(rate)) for each in (values[id(clock)].position, values[id(clock)].sd)
        )
        near = any(abs(abs(lines) - half) < NEARLY for half in HALVES)
        if near and abs(lines) > SIGNIFICANT * sd:
            names = [each.photo for each in timed if each.offset is clock]
            text = (
                f"lines of {listed(names)} are {lines:+.2f} lines off: is the first counted as 0, 0.5 or 1 in"
                " its middle?"
            )
            yield Finding("line-count", "look", text, names, values={"lines": lines, "sd": sd})
