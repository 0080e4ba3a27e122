"""Additional observations of simulated blocks: GNSS, inertial units, distances and rigs.

Each function returns a simulation with more observations. In the truth they are errorless and shared unknowns
are fixed. In the block shared unknowns are free and have other initial values.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import argument_error, number, shaped, truth_value, whole_number
from photogram.arguments.objects import require
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.geometry import Cartesian, photo_axes
from photogram.network.moving_photos import Mount
from photogram.network.observations import Attitude, Distance, Observation, Observations, Position
from photogram.network.simulated_images import photo_angles
from photogram.network.simulation import Simulation
from photogram.network.unknowns import Boresight, Drift, Instrument, LeverArm, Sensor, Shift
from photogram.words import phrase


def with_gnss(
    simulation: Simulation,
    *,
    sd: float = 0.05,
    lever_arm: ArrayLike = 0.0,
    lever_arm_sd: float = 0.0,
    shift_sd: float = 0.0,
    drift_sd: float = 0.0,
    seconds: float = 5.0,
    seed: int | np.random.Generator = 1,
) -> Simulation:
    """Add a GNSS position to every photo.

    Parameters
    ----------
    simulation
        Simulated block with photos strip by strip.
    sd
        Standard deviation of a coordinate in metres, for the noise and in the block.
    lever_arm
        (3,) from the projection centres to the antenna, in the axes of the photos, metres.
    lever_arm_sd
        Standard deviation of the lever arm: 0 fixed, infinite free.
    shift_sd, drift_sd
        Standard deviations of the true shifts (metres) and drifts (metres per second) of the strips, which
        are free in the block. 0: no shift or drift.
    seconds
        Time between photos, seconds.
    seed
        Equal seeds and equal arguments give equal observations.

    Raises
    ------
    InputError
        If an argument is outside its range, or the block has a rig.
    """
    _positive(sd=sd, seconds=seconds)
    number("shift_sd", shift_sd, "not-negative")
    number("drift_sd", drift_sd, "not-negative")
    if simulation.block.mounts:
        raise InputError(phrase("simulation.rig-first"))
    random, truth = np.random.default_rng(seed), simulation.truth
    arm = shaped("lever_arm", lever_arm, (3,))
    given = arm + (lever_arm_sd if math.isfinite(lever_arm_sd) else 1.0) * random.standard_normal(3)
    arms = LeverArm("antenna", arm, 0.0), LeverArm("antenna", given, lever_arm_sd)
    axes, (centres, turned) = Cartesian(truth.spheroid), _poses(truth)
    # The strip is the first half of the name of a photo.
    names = [name[: len(name) // 2] for name in truth.photo_ids]
    places = {name: row for row, name in enumerate(dict.fromkeys(names))}
    strips = np.array([places[name] for name in names], dtype=np.int64)
    times = seconds * np.arange(len(strips))
    shifts, drifts = (
        deviation * random.standard_normal((strips.max() + 1, 3)) for deviation in (shift_sd, drift_sd)
    )
    errors = sd * random.standard_normal(centres.shape)
    parts = []
    since = times - (np.bincount(strips, times) / np.bincount(strips))[strips]
    moved = shifts[strips] + since[:, np.newaxis] * drifts[strips]
    middle = np.median(truth.photo_positions, axis=0)[np.newaxis]
    antennas = centres + turned @ arm + axes.from_local(moved[:, :, np.newaxis], middle)[..., 0]
    own = [
        _of_strips(Shift, shifts) if shift_sd else None,
        _of_strips(Drift, drifts) if drift_sd else None,
    ]
    for which, noise in enumerate((np.zeros_like(errors), errors)):
        along = axes.from_local(noise[:, :, np.newaxis], truth.photo_positions)[..., 0]
        observed = axes.from_cartesian(antennas + along)
        shift, drift = (each and [each[which][strip] for strip in strips.tolist()] for each in own)
        unknowns = {"lever_arm": arms[which], "shift": shift, "drift": drift}
        parts.append(
            Position.from_arrays(photo=truth.photo_ids, position=observed, sd=sd, time=times, **unknowns)
        )
    return _observed(simulation, *parts)


def with_inertial(
    simulation: Simulation,
    *,
    sd: float = 1e-4,
    boresight: ArrayLike = 0.0,
    seed: int | np.random.Generator = 2,
) -> Simulation:
    """Add the attitude of every photo, from an inertial unit with unknown boresight.

    Parameters
    ----------
    simulation
        A simulated block.
    sd
        Standard deviation of a rotation about an axis of the unit, radians, for the noise and in the block.
    boresight
        (3,) rotation vector of the boresight, from the axes of the unit to the axes of the photos, radians.
        Its initial value is 0.
    seed
        Equal seeds and equal arguments give equal observations.

    Raises
    ------
    InputError
        If an argument is outside its range.
    """
    _positive(sd=sd)
    random, truth = np.random.default_rng(seed), simulation.truth
    turn = _photocore.vector_rotations(shaped("boresight", boresight, (3,))[np.newaxis])[0]
    local = photo_axes(truth.photo_attitudes, truth.photo_to_ground) @ turn
    errors = _photocore.vector_rotations(sd * random.standard_normal((len(local), 3)))
    known, unknown = Boresight("inertial unit", turn, 0.0), Boresight("inertial unit")
    exact, noisy = (
        Attitude.from_arrays(photo=truth.photo_ids, attitude=matrices, sd=sd, boresight=own)
        for matrices, own in ((local, known), (local @ errors, unknown))
    )
    return _observed(simulation, exact, noisy)


def with_distances(
    simulation: Simulation,
    *,
    count: int = 10,
    sd: float = 0.02,
    scale: float = 1.0,
    constant: float = 0.0,
    unknown: bool = False,
    seed: int | np.random.Generator = 3,
) -> Simulation:
    """Add distances between random pairs of points.

    Parameters
    ----------
    simulation
        A simulated block.
    count
        Number of distances.
    sd
        Standard deviation of a distance in metres, for the noise and in the block.
    scale, constant
        Scale and constant of the instrument; `constant` in metres.
    unknown
        Whether scale and constant are free, with the initial values 1 and 0. If False, they must be 1 and 0.
    seed
        Equal seeds and equal arguments give equal observations.

    Raises
    ------
    InputError
        If an argument is outside its range, or there are not enough points.
    """
    truth_value("unknown", unknown)
    _positive(sd=sd, scale=scale)
    truth = simulation.truth
    most = len(truth.point_ids) // 2
    require(0 <= whole_number("count", count) <= most, "count", "range", low=0, high=most, value=count)
    usual = scale == 1 and constant == 0
    require(unknown or usual, "distances", "requires", name="scale or constant", other="unknown=True")
    random = np.random.default_rng(seed)
    first, second = random.permutation(len(truth.point_ids))[: 2 * count].reshape(2, -1)
    places = Cartesian(truth.spheroid).positions(truth.point_positions)
    lengths = scale * np.linalg.norm(places[second] - places[first], axis=1) + constant
    names = {"first": [truth.point_ids[p] for p in first], "second": [truth.point_ids[q] for q in second]}
    known = Instrument("rangefinder", scale, constant, 0.0), Instrument("rangefinder")
    errors = sd * random.standard_normal(count)
    exact, noisy = (
        Distance.from_arrays(**names, length=values, sd=sd, instrument=own if unknown else None)
        for values, own in ((lengths, known[0]), (lengths + errors, known[1]))
    )
    return _observed(simulation, exact, noisy)


def with_rig(
    simulation: Simulation,
    positions: ArrayLike,
    rotations: ArrayLike,
    *,
    position_error: float = 0.01,
    rotation_error: float = 0.005,
    frame_size: float = 230.0,
    seed: int | np.random.Generator = 4,
) -> Simulation:
    """Add cameras to the camera frame of a block, e.g. oblique or stereo cameras.

    Each photo of the block gets one companion per sensor. Companions observe the points of the block inside
    their frames, with the same standard deviations. The poses of the sensors are free.

    Parameters
    ----------
    simulation
        Simulated block with principal distances and without refraction.
    positions, rotations
        (k, 3) positions of the k sensors in the axes of the photos, metres, and rotation vectors of their
        axes, radians.
    position_error, rotation_error
        Standard deviations of the errors of initial sensor poses, metres and radians.
    frame_size
        Side of the square frame, in the unit of image coordinates.
    seed
        Equal seeds and equal arguments give equal images.

    Raises
    ------
    InputError
        If an argument is outside its range, or the block has cameras or refraction.
    """
    _positive(frame_size=frame_size)
    random, truth = np.random.default_rng(seed), simulation.truth
    if truth.refraction is not None:
        raise argument_error("simulation of a rig", "not-applicable", name="refraction", other="rigs")
    distances = truth.known_distances("the simulation of a rig")
    offsets = np.atleast_2d(np.asarray(positions, dtype=np.float64))
    turns = np.atleast_2d(np.asarray(rotations, dtype=np.float64))
    good = offsets.shape == turns.shape and offsets.shape[1] == 3
    require(
        good, "positions, rotations", "shape", shape="(sensors, 3)", actual=f"{offsets.shape}, {turns.shape}"
    )
    axes, (centres, turned) = Cartesian(truth.spheroid), _poses(truth)
    mounts: tuple[list[Mount], list[Mount]] = ([], [])
    added: list[tuple[Floats, Floats, Indices, Indices, Floats]] = []
    for k, (offset, turn) in enumerate(zip(offsets, _photocore.vector_rotations(turns), strict=True)):
        start = _photocore.vector_rotations(rotation_error * random.standard_normal((1, 3)))[0]
        sensors = (
            Sensor(f"sensor {k + 2}", offset, turn, 0.0),
            Sensor(f"sensor {k + 2}", offset + position_error * random.standard_normal(3), turn @ start),
        )
        own = axes.from_cartesian(centres + turned @ offset)
        angles = photo_angles(axes.to_local(turned @ turn, own), truth.photo_to_ground)
        photos, points, xy = _seen(truth, own, angles, distances, frame_size)
        names = [f"{name} {k + 2}" for name in truth.photo_ids]
        for parts, sensor in zip(mounts, sensors, strict=True):
            parts.extend(
                Mount(name, frame, sensor) for name, frame in zip(names, truth.photo_ids, strict=True)
            )
        added.append((own, angles, photos + len(truth.photo_ids) * (k + 1), points, xy))
    names = [mount.photo for mount in mounts[0]]
    own, angles, photos, points, xy = (np.concatenate(parts) for parts in zip(*added, strict=True))
    sd = np.broadcast_to(truth.image_sd[:1], xy.shape)
    noise = sd * random.standard_normal(sd.shape)
    free = np.full((len(names), 3), np.inf)
    further = {
        "photo_positions": own,
        "photo_positions_observed": own,
        "photo_position_sd": free,
        "photo_attitudes": angles,
        "photo_attitudes_observed": angles,
        "photo_attitude_sd": free,
        "image_photos": photos,
        "image_points": points,
        "image_xy": xy,
        "image_sd": sd,
    }

    def grown(block: Block, own: Sequence[Mount], errors: Floats | float) -> Block:
        rows = further | {"image_xy": xy + errors}
        return block.replace(
            photo_ids=[*block.photo_ids, *names],
            principal_distances=np.tile(distances, len(offsets) + 1),
            mounts=[*block.mounts, *own],
            **{
                name: np.concatenate([given, extra])
                for name, extra in rows.items()
                if (given := getattr(block, name)) is not None
            },
        )

    block = grown(simulation.block, mounts[1], noise)
    return replace(simulation, truth=grown(truth, mounts[0], 0.0), block=block)


def _positive(**values: float) -> None:
    for name, value in values.items():
        number(name, value, "positive")


def _observed(
    simulation: Simulation, exact: Observations[Observation], noisy: Observations[Observation]
) -> Simulation:
    truth, block = simulation.truth, simulation.block
    return replace(
        simulation,
        truth=truth.replace(observations=[truth.observations, exact]),
        block=block.replace(observations=[block.observations, noisy]),
    )


def _of_strips(kind: type[Shift] | type[Drift], values: Floats) -> tuple[list[Any], list[Any]]:
    """Return true shifts or drifts of strips, and the free ones of the block."""
    names = [f"strip {k + 1}" for k in range(len(values))]
    known = [kind(name, value, 0.0) for name, value in zip(names, values, strict=True)]
    return known, [kind(name) for name in names]


def _poses(block: Block) -> tuple[Floats, Floats]:
    """Return cartesian positions of the photos, and their axes as columns."""
    axes, turned = Cartesian(block.spheroid), photo_axes(block.photo_attitudes, block.photo_to_ground)
    return axes.positions(block.photo_positions), axes.from_local(turned, block.photo_positions)


def _seen(
    block: Block, positions: Floats, angles: Floats, distances: Floats, frame_size: float
) -> tuple[Indices, Indices, Floats]:
    """Return photos, points and image coordinates of points in front and inside the frames."""
    photos, points, images = [], [], []
    everything = np.arange(len(block.point_ids))
    centres, axes = _poses(block.replace(photo_positions=positions, photo_attitudes=angles))
    places = Cartesian(block.spheroid).positions(block.point_positions)
    for photo in range(len(positions)):
        repeated = np.full(len(everything), photo)
        xy = geometry.project(
            block.point_positions,
            positions[repeated],
            angles[repeated],
            distances[repeated],
            spheroid=block.spheroid,
            photo_to_ground=block.photo_to_ground,
        )
        depth = (places - centres[photo]) @ axes[photo][:, 2]
        inside = (depth < 0) & (np.abs(xy).max(axis=1) < frame_size / 2)
        photos.append(repeated[inside])
        points.append(everything[inside])
        images.append(xy[inside])
    return np.concatenate(photos), np.concatenate(points), np.concatenate(images)
