"""What may be wrong with photos on trajectories: tables, times, how lines of scanners are counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.hypotheses import Change, Hypothesis, quaternion_readings
from photogram.diagnosis.time_bases import differences
from photogram.diagnosis.trajectory_images import flown_predictions
from photogram.network.block import Block
from photogram.network.motion import timed_images
from photogram.network.moving_photos import Lines, Timed
from photogram.network.observations import Position
from photogram.network.trajectories import Table, Trajectory

__all__ = ["flown_hypotheses", "shifted_records", "shifts"]

KILOMETRE = 1000.0


def flown_hypotheses(block: Block, photos: Indices) -> Iterator[Hypothesis]:
    """Propose mistakes for a block without observations; `photos` on trajectories are looked at."""
    if any(each.trajectory is not None for each in block.timed):
        yield from _of_tables()
        for text, seconds in shifts("images"):
            yield Hypothesis(f"images {seconds:+g} s", text, partial(_shifted_images, seconds=seconds))
    if block.principal_distances is not None or any("c" in each.names for each in block.cameras):
        yield Hypothesis("sign of c", "the principal distance has the wrong sign", _looking_back)
    if any(each.lines is not None for each in block.timed):
        yield from _of_scanners(block, photos)


def shifts(of: str) -> Iterator[tuple[str, float]]:
    """Return in which scale times of something may be, and what they lack in seconds."""
    for ahead, behind, seconds in differences():
        for sign, own, table in ((1, behind, ahead), (-1, ahead, behind)):
            yield (
                f"times of the {of} are {own}, those of the trajectories' tables {table}: they lack"
                f" {sign * seconds:+g} s",
                sign * seconds,
            )


def _of_tables() -> Iterator[Hypothesis]:
    def changed(name: str, text: str, change: Callable[[Table], Table]) -> Hypothesis:
        return Hypothesis(name, text, partial(_with_tables, change=change))

    inverse = "attitudes of the trajectories are matrices from object to photo, not from photo to object"
    yield changed("inverse", inverse, lambda table: _turned(table, np.swapaxes(table.attitudes, 1, 2)))
    for name in quaternion_readings(np.eye(3)[np.newaxis]):

        def read(table: Table, name: str = name) -> Table:
            return _turned(table, quaternion_readings(table.attitudes)[name][1])

        text, _ = quaternion_readings(np.eye(3)[np.newaxis])[name]
        yield changed(name, f"{text} (attitudes of the trajectories)", read)
    for name, factor, text in (
        ("kilometres", KILOMETRE, "in kilometres, all else in metres"),
        ("metres", 1 / KILOMETRE, "in metres, all else in kilometres"),
    ):
        said = f"positions of the trajectories are {text}"
        yield changed(name, said, partial(_scaled, factor=factor))


def _turned(table: Table, attitudes: Floats) -> Table:
    return replace(table, attitudes=attitudes)


def _scaled(table: Table, factor: float) -> Table:
    velocities = None if table.velocities is None else table.velocities * factor
    return replace(table, positions=table.positions * factor, velocities=velocities)


def _with_tables(block: Block, change: Callable[[Table], Table]) -> Block:
    """Return a block without observations whose trajectories have other tables."""
    known: dict[int, Trajectory] = {}

    def meant(given: Trajectory) -> Trajectory:
        return known.setdefault(id(given), replace(given, table=change(given.table)))

    timed = [
        each if each.trajectory is None else replace(each, trajectory=meant(each.trajectory))
        for each in block.timed
    ]
    return block.replace(timed=timed)


def _looking_back(block: Block) -> Block:
    """Return a block whose principal distances have the other sign."""
    if block.principal_distances is not None:
        return block.replace(principal_distances=-block.principal_distances)
    cameras = [
        each.replace(parameters={**each.parameters, "c": -each.parameters["c"]})
        if "c" in each.names
        else each
        for each in block.cameras
    ]
    return block.replace(cameras=cameras)


def _shifted_images(block: Block, seconds: float) -> Block:
    """Return a block whose photos on given trajectories were taken later."""

    def later(own: Timed) -> Timed:
        if own.trajectory is None:
            return own
        time = None if own.time is None and own.lines is not None else (own.time or 0.0) + seconds
        lines = None if own.lines is None else Lines(np.add(own.lines.table, [0.0, seconds, 0.0]))
        return replace(own, time=time, lines=lines)

    return block.replace(timed=[later(each) for each in block.timed])


def shifted_records(block: Block, seconds: float) -> Block:
    """Return a block whose observed positions on trajectories are of later times."""
    return block.replace(
        observations=[
            replace(each, time=each.time + seconds)
            if isinstance(each, Position) and each.moment is not None and each.time is not None
            else each
            for each in block.observations
        ]
    )


def _of_scanners(block: Block, photos: Indices) -> Iterator[Hypothesis]:
    """Propose that lines, samples or both are counted from the other end.

    With l the observed and p the predicted lines, l = s - p where they are; s is the middle one of l + p.
    """
    predicted = flown_predictions(block, photos)
    for name, axes, text in (
        ("reversed", (1,), "lines of the scanners are counted against the scan, from the last one"),
        ("turned", (0, 1), "images of the scanners are turned by 180 degrees"),
        ("mirrored samples", (0,), "samples of the scanners are counted from the other end"),
    ):
        change: Change = partial(_counted_back, predicted=predicted, axes=axes)
        yield Hypothesis(name, text, change, exact=False)


def _counted_back(block: Block, predicted: Floats, axes: tuple[int, ...]) -> Block:
    xy = block.image_xy.copy()
    for own, _, _, images in timed_images(block):
        if own.lines is None or own.line_sensor is None:
            continue
        known = images[np.isfinite(predicted[images]).all(axis=1)]
        if 0 in axes:
            xy[images, 0] = 2 * own.line_sensor.s0 - xy[images, 0]
        if 1 in axes and len(known):
            ends = float(np.median(block.image_xy[known, 1] + predicted[known, 1]))
            xy[images, 1] = ends - xy[images, 1]
    return block.replace(image_xy=xy)
