"""Mistakes in the data of photos on trajectories, found by trial.

Observations are predicted from given tables, points and cameras. The misfit of observed positions is their
difference from the trajectory at their time, relative to their spread.

    m = rms(observed - predicted) / rms(observed - mean)          (:mod:`photogram.diagnosis.predictions`)

Samples and lines of scanners are image coordinates as well. A wrong time or attitude of their trajectory
shifts them by many lines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.conventions import quaternion_readings
from photogram.diagnosis.mistakes import Change, Proposal
from photogram.diagnosis.moving import shifts
from photogram.diagnosis.predictions import MOST, UNKNOWN, eligible, given_points, predict, relative
from photogram.diagnosis.sets import arm_of
from photogram.errors import InputError
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.geometry import Cartesian
from photogram.network.motion import given_poses, kept_images, timed_images, timed_photos
from photogram.network.moving_photos import Lines, Moment, Timed
from photogram.network.observations import Position
from photogram.network.projecting import projected_images
from photogram.network.rays import image_directions, meet_rays
from photogram.network.trajectories import Table, Trajectory
from photogram.words import Phrase, phrase


def flown_hints(block: Block) -> list[Message]:
    """Return mistakes in tables and times of trajectories, and in scan line numbers."""
    with np.errstate(all="ignore"):
        found = [predict(_of_times("records", _shifted_records), block, _records_misfit, what="records")]
        if block.timed:
            looked, photos = flown_view(block)
            tried = flown_hypotheses(looked, photos)
            found.insert(0, predict(tried, looked, partial(flown_misfits, photos=photos)))
        return [Message(each.message) for each in found if each is not None]


def _records_misfit(block: Block) -> Floats:
    """(1,) m of positions on trajectories; 0 without any, very large if most are outside."""
    records: dict[int, list[tuple[Moment, Position]]] = {}
    for each in block.observations.of_type(Position):
        if (moment := each.moment) is not None:
            records.setdefault(id(moment.trajectory), []).append((moment, each))
    observed, computed, inside = list[Floats](), list[Floats](), list[bool]()
    for own in records.values():
        trajectory = own[0][0].trajectory
        clocks = [0.0 if at.clock is None else float(at.clock.position[0]) for at, _ in own]
        times = np.array([at.time for at, _ in own]) + clocks
        clipped = np.clip(times, *trajectory.reach)
        centres, turned = given_poses(trajectory, clipped)
        computed += [
            *(centres + np.einsum("nij,nj->ni", turned, np.array([arm_of(each) for _, each in own])))
        ]
        observed += [np.asarray(each.position) for _, each in own]
        inside += [*(times == clipped)]
    if not observed:
        return np.zeros(1)
    return np.array([relative(np.array(observed), np.array(computed)) if np.mean(inside) >= 0.5 else UNKNOWN])


KILOMETRE = 1000.0


def flown_hypotheses(block: Block, photos: Indices) -> Iterator[Proposal]:
    """Yield possible mistakes for `photos` on trajectories, without observations."""
    if any(each.trajectory is not None for each in block.timed):
        yield from _of_tables()
        yield from _of_times("images", _shifted_images)
    if block.principal_distances is not None or any("c" in each.names for each in block.cameras):
        yield Proposal("sign of c", phrase("mistake.sign of c"), _looking_back)
    if any(each.lines is not None for each in block.timed):
        # Lines, samples or both are counted from the other end. With l the observed, p the predicted lines,
        # l = s - p; s is the median of l + p.
        predicted = flown_predictions(block, photos)
        for name, axes in (("reversed", (1,)), ("turned", (0, 1)), ("mirrored samples", (0,))):
            change: Change = partial(_counted_back, predicted=predicted, axes=axes)
            yield Proposal(name, phrase(f"mistake.scanner.{name}"), change, exact=False)


def _of_times(of: str, change: Callable[..., Block]) -> Iterator[Proposal]:
    """Yield possible time scales of `images` or `records`."""
    for scale, table, seconds in shifts():
        message = phrase(f"mistake.times.{of}", scale=scale, table=table, seconds=seconds)
        yield Proposal(f"{of} {seconds:+g} s", message, partial(change, seconds=seconds))


def _of_tables() -> Iterator[Proposal]:
    changes: dict[str, tuple[Phrase, Callable[[Table], Table]]] = {
        "inverse": (
            phrase("mistake.table.inverse"),
            lambda table: replace(table, attitudes=np.swapaxes(table.attitudes, 1, 2)),
        ),
        "kilometres": (phrase("mistake.table.kilometres"), partial(_scaled, factor=KILOMETRE)),
        "metres": (phrase("mistake.table.metres"), partial(_scaled, factor=1 / KILOMETRE)),
    }
    for name, (cause, _) in quaternion_readings(np.eye(3)[np.newaxis]).items():
        changes[name] = phrase("mistake.table.quaternions", cause=cause), partial(_read_as, name=name)
    for name, (message, change) in changes.items():
        yield Proposal(name, message, partial(_with_tables, change=change))


def _read_as(table: Table, name: str) -> Table:
    return replace(table, attitudes=quaternion_readings(table.attitudes)[name][1])


def _scaled(table: Table, factor: float) -> Table:
    velocities = None if table.velocities is None else table.velocities * factor
    return replace(table, positions=table.positions * factor, velocities=velocities)


def _with_tables(block: Block, change: Callable[[Table], Table]) -> Block:
    known: dict[int, Trajectory] = {}

    def meant(given: Trajectory) -> Trajectory:
        return known.setdefault(id(given), replace(given, table=change(given.table)))

    timed = [
        each if each.trajectory is None else replace(each, trajectory=meant(each.trajectory))
        for each in block.timed
    ]
    return block.replace(timed=timed)


def _looking_back(block: Block) -> Block:
    """Return a block whose principal distances have the opposite sign."""
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
    """Return a block with later times of its photos on given trajectories."""

    def later(own: Timed) -> Timed:
        if own.trajectory is None:
            return own
        time = None if own.time is None and own.lines is not None else (own.time or 0.0) + seconds
        lines = None if own.lines is None else Lines(np.add(own.lines.table, [0.0, seconds, 0.0]))
        return replace(own, time=time, lines=lines)

    return block.replace(timed=[later(each) for each in block.timed])


def _shifted_records(block: Block, seconds: float) -> Block:
    """Return a block with later times of its observed positions on trajectories."""
    return block.replace(
        observations=[
            replace(each, time=each.time + seconds)
            if isinstance(each, Position) and each.moment is not None and each.time is not None
            else each
            for each in block.observations
        ]
    )


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


LEAST = 4  # Predictable points that a photo needs
POINTS = 300  # Points per photo
SEEN = 0.8  # Least part of the points of a photo that its trajectory passes


def flown_view(block: Block) -> tuple[Block, Indices]:
    """Return the part of a block for comparing photos on trajectories, and these photos."""
    moving = kept_images(block, timed_photos(block)[block.image_photos])
    photos = eligible(moving, LEAST, MOST)
    points = np.unique(moving.image_points[np.isin(moving.image_photos, photos)])
    points = points[:: max(1, len(points) // (POINTS * max(len(photos), 1)))]
    looked = kept_images(moving, np.isin(moving.image_points, points))
    return looked.replace(observations=(), refraction=None), photos


def flown_misfits(block: Block, photos: Indices) -> Floats:
    """(k,) m of some photos, of all points or of given ones; the larger one.

    Points without given positions fit any scale. Very large if many points are not visible.
    """
    apart = np.linalg.norm(block.image_xy - flown_predictions(block, photos), axis=1)
    given = given_points(block)[block.image_points]
    found = np.full(len(photos), UNKNOWN)
    for k, photo in enumerate(photos.tolist()):
        rows = np.flatnonzero(block.image_photos == photo)
        extent = float(np.sqrt(block.image_xy[rows].var(axis=0).sum()))
        parts = [apart[own] for own in (rows, rows[given[rows]]) if len(own)]
        if extent > 0 and all(np.isfinite(own).mean() > SEEN for own in parts):
            found[k] = max(float(np.sqrt(np.nanmean(own**2))) for own in parts) / extent
    return found


def flown_predictions(block: Block, photos: Indices) -> Floats:
    """(m, 2) predicted image coordinates of some photos; NaN if invisible."""
    own = np.isin(block.image_photos, photos)
    found = np.full(block.image_xy.shape, np.nan)
    with suppress(InputError):  # The trajectory of a scanner has a single record
        found[own] = projected_images(kept_images(block.replace(point_positions=_places(block)), own))
    return found


def _places(block: Block) -> Floats:
    """(n, 3) given or intersected points."""
    given = given_points(block)
    if given.all():
        return block.point_positions
    inner = image_directions(block)
    centres, directions = np.full(inner.shape, np.nan), np.full(inner.shape, np.nan)
    for own, trajectory, _, images in timed_images(block):
        times = np.clip(own.times(block.image_xy[images]), *trajectory.reach)
        at, turned = given_poses(trajectory, times)
        if own.sensor is not None:
            at, turned = at + turned @ own.sensor.position, turned @ own.sensor.attitude
        centres[images], directions[images] = at, np.einsum("mij,mj->mi", turned, inner[images])
    seen = np.isfinite(directions).all(axis=1)
    met = meet_rays(block.image_points[seen], len(given), centres[seen], directions[seen])
    positions = Cartesian(block.spheroid).from_cartesian(met)
    return np.where(given[:, np.newaxis], block.point_positions, positions)
