"""Simulated blocks: vertical photographs, or strips of a line scanner, over gentle relief."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from photogram.arguments.arrays import argument_error, shaped
from photogram.arguments.fields import options_of
from photogram.arguments.objects import kind_error, require, require_kind
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import counted
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.block_checks import checked_cameras
from photogram.network.geometry import Spheroid
from photogram.network.motion import given_poses
from photogram.network.refraction import Refraction
from photogram.network.simulated_images import (
    control_pattern,
    flight,
    ground_points,
    into_object_space,
    laid_out,
    photograph,
    photographed,
    point_ids,
    rolled,
    seen_side,
)
from photogram.network.simulation_options import LONGEST, LineScanner, RollingShutter, SimulationOptions
from photogram.network.trajectories import Readout
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.network.keywords import SimulationKeywords

_NARROWEST, _WIDEST = 1e-6, 1.4
"""Limits of the viewing angle from the vertical, radians; a wider view is too far away to simulate."""
_FAR_MORE = 10.0  # Maximum lateral distance relative to the range of view


@dataclass(frozen=True)
class Blunders:
    """Gross errors added to image observations.

    Attributes
    ----------
    images
        (k,) rows of the block's image arrays.
    amounts
        (k, 2) errors added to x and y, in millimetres.
    """

    images: Indices
    amounts: Floats


@dataclass(frozen=True)
class Simulation:
    """Simulated block with its true values.

    Attributes
    ----------
    block
        Simulated measurements: noisy image coordinates, control, weighted positions and attitudes of photos,
        and coarse initial values. Check points have true positions, but are free and errorless. Positions of
        pass points are missing.
    truth
        The same block with true positions and attitudes and errorless image coordinates. Readout times,
        motions and trajectories are true as well, and weighted as in `block`.
    blunders
        Gross errors in `block`.
    """

    block: Block
    truth: Block
    blunders: Blunders

    def to_json(self) -> bytes:
        """Return the truth as a JSON document, `truth.json` of `photogram simulate`."""
        from photogram.io import json

        truth = self.truth
        degrees = np.array([math.degrees(1), math.degrees(1), 1.0]) if truth.geographic else np.ones(3)
        position = "longitude and latitude in degrees, height in m" if truth.geographic else "X, Y, Z in m"
        turn = "photo-to-ground" if truth.photo_to_ground else "ground-to-photo"
        units = {
            "position": position,
            "attitude_rad": f"omega, phi, kappa, {turn}",
            "error_mm": "what was added to x and y",
        }
        if truth.timed:
            units["motion"] = "s, m/s, rad/s; axes of the photo as columns"
        rows = self.blunders.images.tolist()
        document = {
            "units": units,
            "photos": _records(
                id=truth.photo_ids,
                position=(truth.photo_positions * degrees).tolist(),
                attitude_rad=truth.photo_attitudes.tolist(),
            ),
            "points": _records(id=truth.point_ids, position=(truth.point_positions * degrees).tolist()),
            **_true_motion(truth),
            "blunders": _records(
                photo=[truth.photo_ids[truth.image_photos[row]] for row in rows],
                point=[truth.point_ids[truth.image_points[row]] for row in rows],
                error_mm=self.blunders.amounts.tolist(),
            ),
        }
        return json.to_json(document)


def simulate(options: SimulationOptions | None = None, **changes: Unpack[SimulationKeywords]) -> Simulation:
    """Simulate a block of vertical photographs.

    Parameters
    ----------
    options
        The options; None: the defaults.
    **changes
        Fields of :class:`photogram.network.SimulationOptions` with other values.

    Returns
    -------
    Simulation
        Photos strip by strip, named by strip and photo ("0203"); images sorted by photo, then point. Points
        with one image are removed. Names begin with C for control points, K for check points and P for pass
        points.

    Raises
    ------
    InputError
        If an argument is outside its range.
    """
    options = options_of(SimulationOptions, options, changes)
    spheroid, motion, distance = options.spheroid, options.motion, options.principal_distance
    require_kind("spheroid", spheroid, Spheroid, optional=True)
    require_kind("refraction", options.refraction, Refraction, optional=True)
    centre = shaped("origin", options.origin, (3,))
    require((np.abs(centre) < LONGEST).all(), "origin", "less", high=LONGEST, value=centre.tolist())
    high, relief = options.flying_height, options.relief
    require(relief < high, "relief", "less", high=high, value=relief)
    if not math.isfinite(options.footprint):
        raise argument_error("principal_distance", "not-zero", value=distance)
    taking = checked_cameras(options.cameras)
    _check_motion(motion, plain=spheroid is None and options.refraction is None, cameras=bool(taking))
    streams = _generator(options.seed).spawn(7)
    terrain_random, flight_random, initial_random, image_random, control_random, blunder_random = streams[:6]
    motion_random = streams[6].spawn(1)[0]

    half_angle, steepest = _looks(options)
    plan = laid_out(options, 1.02 * (high + relief) * math.tan(half_angle + steepest))
    terrain = ground_points(plan, options, terrain_random)
    ground, _ = into_object_space(terrain, None, options)
    if isinstance(motion, LineScanner):
        from photogram.network.simulated_scanner import scanned

        taken = scanned(plan, options, motion, ground, motion_random)
        # The standard deviations apply to trajectories.
        none: dict[str, Any] = {"position_error": 0.0, "attitude_error": 0.0, "position_sd": math.inf}
        options = replace(options, **none, attitude_sd=math.inf)
    else:
        photos, rotations = flight(plan, options, flight_random)
        poses = into_object_space(photos, rotations, options)
        taken = photograph(plan, ground, poses, options, seen_side(options, motion, half_angle))
    if not len(taken.image_points):
        raise InputError(phrase("simulation.no-points"))
    used, image_points = np.unique(taken.image_points, return_inverse=True)
    ground, terrain = ground[used], terrain[used]

    held = control_pattern(plan, terrain, options.control, options.control_spacing)
    free = np.flatnonzero(~held.any(axis=1))
    checks = control_random.choice(free, min(options.check_points, len(free)), replace=False)
    known: Bools = held.copy()
    known[checks] = True
    metres = geometry.lengths_of_units(ground, spheroid)
    control_noise = options.control_sd / metres * control_random.standard_normal(ground.shape)

    positions, attitudes, xy = taken.positions, taken.attitudes, taken.image_xy
    point_sd = np.where(held, options.control_sd / metres, np.inf)
    metres = geometry.lengths_of_units(positions, spheroid)
    truth = Block(
        photo_ids=taken.photo_ids,
        photo_positions=positions,
        photo_attitudes=attitudes,
        principal_distances=np.full(len(positions), distance),
        point_ids=point_ids(held, checks),
        point_positions=ground,
        image_photos=taken.image_photos,
        image_points=image_points,
        image_xy=xy,
        image_sd=np.array(options.image_sd),
        photo_position_sd=options.position_sd / metres,
        photo_attitude_sd=np.array(options.attitude_sd),
        point_sd=point_sd,
        spheroid=spheroid,
        photo_to_ground=options.photo_to_ground,
        refraction=options.refraction,
        title=_title(options),
    )
    rows = np.sort(blunder_random.choice(len(xy), min(options.blunders, len(xy)), replace=False))
    amounts, signs = np.zeros((len(rows), 2)), blunder_random.choice([-1, 1], len(rows))
    amounts[np.arange(len(rows)), blunder_random.integers(0, 2, len(rows))] = options.blunder_size * signs
    faults = Blunders(rows.astype(np.int64), amounts)
    noise = options.image_sd * image_random.standard_normal(xy.shape)
    measured = xy + taken.in_images(noise, np.arange(len(xy)))
    measured[faults.images] += taken.in_images(faults.amounts, faults.images)
    position_draw, attitude_draw = (initial_random.standard_normal(positions.shape) for _ in range(2))
    position_error = options.position_error if options.position_sd else 0.0
    attitude_error = options.attitude_error if options.attitude_sd else 0.0
    block = truth.replace(
        photo_positions=positions + position_error / metres * position_draw,
        photo_attitudes=attitudes + attitude_error * attitude_draw,
        photo_positions_observed=_observed(positions, truth.photo_position_sd, streams[6]),
        photo_attitudes_observed=_observed(attitudes, truth.photo_attitude_sd, streams[6]),
        point_positions=np.where(known, ground + np.where(held, control_noise, 0.0), np.nan),
        point_check_sd=np.where(known & ~held, 0.0, np.nan) if len(checks) else None,
        image_xy=measured,
        **taken.given,
    )
    truth = truth.replace(**taken.true)
    if taking:
        truth, block = photographed(truth, block, taking, options.start_cameras)
    if isinstance(motion, RollingShutter):
        truth, block = rolled(truth, block, motion, plan, options.frame_size / abs(distance), motion_random)
    return Simulation(block, truth, faults)


def _looks(options: SimulationOptions) -> tuple[float, float]:
    """Return half the angle of view and the maximum inclination of cameras, radians."""
    tilt, crab, motion = options.tilt, options.crab, options.motion
    spread = options.frame_size / 2 / abs(options.principal_distance) * (math.cos(crab) + math.sin(crab))
    steepest = 2 * tilt
    if isinstance(motion, LineScanner):
        spread += math.tan(motion.view_angle) * math.sin(crab)
        steepest += 4 * options.attitude_error
    half_angle, high = math.atan(spread), _WIDEST - steepest
    if not _NARROWEST < half_angle < high:
        raise InputError(phrase("simulation.view-angle", angle=half_angle, low=_NARROWEST, high=high))
    require(steepest <= _FAR_MORE * half_angle, "tilt", "most", high=_FAR_MORE * half_angle / 2, value=tilt)
    return half_angle, steepest


def _observed(truth: Floats, sd: Floats, random: np.random.Generator) -> Floats | None:
    """Draw observations of the true values; None if nothing is observed."""
    draw = random.standard_normal(truth.shape)
    return truth + sd * draw if np.isfinite(sd).all() else None


def _title(options: SimulationOptions) -> str:
    count, motion = options.photos_per_strip, options.motion
    of = counted(count, "photograph")
    if isinstance(motion, LineScanner):
        of = counted(motion.lines, "line")
        if motion.scenes:
            of = f"{counted(count, 'scene')} of {of}"
    return f"simulated block, {counted(options.strips, 'strip')} of {of}"


def _check_motion(motion: object, *, plain: bool, cameras: bool) -> None:
    """Reject objects that are not motions, and unsupported combinations."""
    if motion is None:
        return
    if not isinstance(motion, RollingShutter | LineScanner):
        raise kind_error("motion", "a RollingShutter, a LineScanner or None", motion)
    require(plain, "motion", "not-applicable", name="a spheroid or refraction", other="photos that move")
    scanner = isinstance(motion, LineScanner) and cameras
    require(
        not scanner,
        "motion",
        "not-applicable",
        name="cameras",
        other="a LineScanner, which has no distortion",
    )


def _generator(seed: int | np.random.Generator) -> np.random.Generator:
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError) as error:
        raise argument_error("seed", "value", value=error) from None


def _records(**columns: Iterable[object]) -> list[dict[str, object]]:
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _true_motion(truth: Block) -> dict[str, object]:
    """Return times, motions and trajectories of a moving simulated block."""
    own = [each for each in truth.timed if each.trajectory is None]
    trajectories = []
    for each in {id(each.trajectory): each.trajectory for each in truth.timed}.values():
        if each is not None:
            times = each.table.times
            places, axes = (values.tolist() for values in given_poses(each, times))
            poses = {"times": times.tolist(), "positions": places, "axes": axes}
            trajectories.append({"trajectory": each.name, **poses})
    readouts = [each for each in truth.unknowns if isinstance(each, Readout)]
    found = {
        "readouts": [{"shutter": each.name, "seconds": each.value} for each in readouts],
        "motions": _records(
            photo=[each.photo for each in own],
            velocity=[np.asarray(each.velocity).tolist() for each in own],
            rate=[np.asarray(each.rotation_rate).tolist() for each in own],
        ),
        "trajectories": trajectories,
    }
    return {name: rows for name, rows in found.items() if rows}
