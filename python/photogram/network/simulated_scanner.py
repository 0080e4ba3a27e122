"""Simulated strips of a line scanner: trajectories with errors, images line by line, records."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.cameras import Camera
from photogram.network.motion import about, given_poses
from photogram.network.moving_photos import Lines, LineSensor, Timed
from photogram.network.observations import Attitude, Observations, Position
from photogram.network.projecting import projected, standing
from photogram.network.simulated_images import Layout, Taken, grid, photo_angles, photo_ids, window
from photogram.network.simulation_options import LineScanner, SimulationOptions
from photogram.network.trajectories import Polynomial, Spline, Table, Trajectory

_BETWEEN = 60.0  # Minimum time between two passes, seconds
_PERIODS = 8.0, 30.0  # Periods in seconds of the three waves of roll and pitch
_BEYOND = 2  # Lines before the first and after the last one within reach of trajectories
_SURE = 5.0
"""Maximum measurement error in standard deviations. At low ground speed, an error in the focal plane equals
many lines."""


@dataclass(frozen=True)
class _Pass:
    """A strip or a scene.

    It begins at `first` with direction `sense` in x, at `across` in y, metres of the plan. It lasts `seconds`
    from `start` on and covers `points` of the grid.
    """

    name: str
    start: float
    seconds: float
    sense: float
    first: float
    across: float
    points: Indices


def scanned(
    layout: Layout,
    options: SimulationOptions,
    scanner: LineScanner,
    ground: Floats,
    random: np.random.Generator,
) -> Taken:
    """Scan (n, 3) grid points of a layout in the object space with a line scanner."""
    pitch, distance = scanner.pitch, options.principal_distance
    # Seconds between lines, for equal ground distances of lines and samples
    line = pitch * options.flying_height / abs(distance) / scanner.speed
    middle = round(options.frame_size / pitch) / 2
    sensors = {
        name: LineSensor((pitch, 0.0), middle, y0=-distance * math.tan(angle))
        for name, angle in scanner.views.items()
    }
    cameras = [Camera("perspective", {"c": options.principal_distance}, name=name) for name in sensors]
    ids: list[str] = []
    poses: list[tuple[Floats, Floats]] = []
    found: list[tuple[Indices, Floats, Floats]] = []
    timed: tuple[list[Timed], list[Timed]] = ([], [])
    records: tuple[list[Observations[Any]], list[Observations[Any]]] = ([], [])
    for each in _passes(layout, options, scanner):
        lines = Lines([[0.0, each.start, line]])
        both = _trajectories(each, options, scanner, line, random)
        _record(records, each, both, options, scanner.every, random)
        pose = about(both[0], each.start + each.seconds / 2)
        for camera, (name, sensor) in zip(cameras, sensors.items(), strict=True):
            ids.append(each.name if len(cameras) == 1 else f"{each.name} {name}")
            for photos, trajectory in zip(timed, both, strict=True):
                photos.append(Timed(ids[-1], trajectory, lines=lines, line_sensor=sensor))
            found.append(_images(each, timed[0][-1], camera, ground, options.image_sd))
            poses.append(pose)
    of = np.repeat(np.arange(len(ids)), [len(points) for points, _, _ in found])
    points, xy, per_error = (np.concatenate(part) for part in zip(*found, strict=True))
    tied = np.bincount(points, minlength=1)[points] >= 2 if len(points) else np.zeros(0, dtype=bool)
    taken = {
        "principal_distances": None,
        "cameras": cameras,
        "photo_cameras": np.arange(len(ids)) % len(cameras),
    }
    return Taken(
        ids,
        np.array([place for place, _ in poses]),
        photo_angles(np.array([axes for _, axes in poses]), options.photo_to_ground),
        of[tied],
        points[tied],
        xy[tied],
        per_error[tied],
        {**taken, "timed": timed[0], "observations": records[0]},
        {**taken, "timed": timed[1], "observations": records[1]},
    )


def _passes(layout: Layout, options: SimulationOptions, scanner: LineScanner) -> Iterator[_Pass]:
    columns, rows = window(layout)
    all_columns, all_rows = grid(layout)
    half, scenes = options.footprint / 2, scanner.scenes
    # Maximum ground distance ahead of the camera in view of a line
    ahead = options.flying_height * math.tan(max(scanner.views.values()))
    digits = max(2, len(str(layout.strips)))
    strips = [f"{strip:0{digits}d}" for strip in range(1, layout.strips + 1)]
    names = photo_ids(layout) if scenes else strips
    start = 0.0
    for row, name in enumerate(names):
        strip, number = divmod(row, layout.photos_per_strip) if scenes else (row, 0)
        middle = number * layout.base - layout.length / 2 if scenes else 0.0
        reach = (half if scenes else layout.length / 2) + ahead
        sense = 1.0 - 2.0 * (strip % 2)
        own = number * layout.columns_per_base + np.arange(len(columns if scenes else all_columns))
        below = strip * layout.rows_per_strip + np.arange(len(rows))
        points = (own[:, np.newaxis] * len(all_rows) + below).ravel()
        seconds = 2 * reach / scanner.speed
        across = strip * layout.separation - layout.width / 2
        yield _Pass(name, start, seconds, sense, middle - sense * reach, across, points)
        start = math.ceil(start + seconds + _BETWEEN)


def _trajectories(
    each: _Pass, options: SimulationOptions, scanner: LineScanner, line: float, random: np.random.Generator
) -> tuple[Trajectory, Trajectory]:
    """Return the true trajectory and the known one, with the same table and other coefficients."""
    times = np.arange(-1.0, math.ceil(each.seconds / scanner.every) + 2) * scanner.every + each.start
    along = each.first + each.sense * scanner.speed * (times - each.start)
    places = np.column_stack(
        [along, np.full(len(times), each.across), np.full(len(times), options.flying_height)]
    )
    # Samples are to the right of the flight direction, y of the camera is ahead.
    heading = random.uniform(-options.crab, options.crab) - each.sense * math.pi / 2
    vectors = np.zeros((len(times), 3))
    for axis in (0, 1):
        periods, phases = random.uniform(*_PERIODS, 3), random.uniform(0, 2 * math.pi, 3)
        waves = np.sin(2 * math.pi * times[:, np.newaxis] / periods + phases)
        vectors[:, axis] = options.tilt * waves.mean(axis=1)
    turned = _photocore.vector_rotations(np.array([[0.0, 0.0, heading]]))
    axes = turned @ _photocore.vector_rotations(vectors)
    table = Table(times, places + np.asarray(options.origin), times, axes)
    true: list[Polynomial | Spline | None] = [None, None]
    given = true.copy()
    # Images would not determine the last coefficients of a spline that extends beyond them.
    beyond = _BEYOND * line
    bases = (
        (scanner.position, options.position_error, options.position_sd),
        (scanner.rotation, options.attitude_error, options.attitude_sd),
    )
    for which, (basis, error, sd) in enumerate(bases):
        # Fixed or errorless trajectories need no corrections.
        if error and sd:
            placed = basis.over(each.start - beyond, each.start + each.seconds + beyond)
            drawn = error * random.standard_normal((placed.count, 3))
            true[which] = replace(placed, value=drawn, sd=error)
            given[which] = replace(placed, value=0.0, sd=error)
    return (
        Trajectory(each.name, table, position=true[0], rotation=true[1]),
        Trajectory(each.name, table, position=given[0], rotation=given[1]),
    )


def _record(
    records: tuple[list[Observations[Any]], list[Observations[Any]]],
    each: _Pass,
    both: tuple[Trajectory, Trajectory],
    options: SimulationOptions,
    every: float,
    random: np.random.Generator,
) -> None:
    """Add errorless and noisy observations of positions and attitudes of a pass."""
    count = math.floor(each.seconds / every + 0.5)
    times = np.asarray(each.start + every * (np.arange(count) + 0.5), dtype=np.float64)
    places, axes = given_poses(both[0], times)
    draws = random.standard_normal((2, len(times), 3))
    for part, trajectory, error in zip(records, both, (0.0, 1.0), strict=True):
        common = {"photo": None, "trajectory": trajectory, "time": times}
        if 0 < (sd := options.position_sd) < math.inf:
            part.append(Position.from_arrays(position=places + error * sd * draws[0], sd=sd, **common))
        if 0 < (sd := options.attitude_sd) < math.inf:
            turned = axes @ _photocore.vector_rotations(error * sd * draws[1])
            part.append(Attitude.from_arrays(attitude=turned, sd=sd, **common))


def _images(
    each: _Pass, own: Timed, camera: Camera, ground: Floats, sd: float
) -> tuple[Indices, Floats, Floats]:
    """Return the points in an image of a pass, their samples and lines, and derivatives by errors."""
    assert own.trajectory is not None
    assert own.lines is not None
    assert own.line_sensor is not None
    xy = projected(own, own.trajectory, camera, ground[each.points])
    extent = np.array([2 * own.line_sensor.s0, own.lines.at(each.start + each.seconds)])
    seen = ((xy >= 0) & (xy <= extent)).all(axis=1)
    points, xy = each.points[seen], xy[seen]
    before, after = (
        standing(own, own.trajectory, camera, ground[points], own.lines.times(xy[:, 1] + half))
        for half in (-0.5, 0.5)
    )
    # v = position of the sample - image in the focal plane, by samples and lines.
    by = np.empty((len(points), 2, 2))
    by[:, :, 0] = own.line_sensor.pitch
    by[:, :, 1] = before - after
    per_error = np.asarray(np.linalg.inv(by), dtype=np.float64)
    # Measurements beyond the image are not part of it.
    apart = _SURE * sd * np.linalg.norm(per_error[:, 1], axis=1) - _BEYOND
    inside = (xy[:, 1] >= apart) & (xy[:, 1] <= extent[1] - apart)
    return points[inside], xy[inside], per_error[inside]
