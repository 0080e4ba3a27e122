"""Simulated blocks: vertical photographs, or strips of a line scanner, over gentle relief."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from photogram.arguments.arrays import argument_error, number, one_of, shaped, truth_value, whole_number
from photogram.arguments.objects import kind_error, require, require_kind
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import counted
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.geometry import Spheroid
from photogram.network.refraction import Refraction
from photogram.network.simulated_images import photograph, photographed, seen_side
from photogram.network.simulated_layout import (
    control_pattern,
    flight,
    ground_points,
    into_object_space,
    laid_out,
    point_ids,
)
from photogram.network.simulated_motion import LineScanner, RollingShutter, rolled
from photogram.network.tables import checked_cameras
from photogram.words import phrase

__all__ = ["Blunders", "Simulation", "simulate"]


_HUGE = 1e12
_TINY = 1e-3  # Largest and smallest length of a block
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


def simulate(
    *,
    strips: int = 4,
    photos_per_strip: int = 10,
    forward_overlap: float = 0.6,
    side_overlap: float = 0.3,
    principal_distance: float = -152.74,
    frame_size: float = 230.0,
    flying_height: float = 4500.0,
    relief: float = 150.0,
    points_per_photo: float = 100.0,
    crab: float = 0.03,
    tilt: float = 0.01,
    control: Literal["perimeter", "corners", "none"] = "perimeter",
    control_spacing: int = 4,
    control_sd: float = 0.05,
    check_points: int = 20,
    image_sd: float = 0.010,
    position_error: float = 30.0,
    attitude_error: float = 0.01,
    position_sd: float = math.inf,
    attitude_sd: float = math.inf,
    blunders: int = 0,
    blunder_size: float = 0.2,
    spheroid: Spheroid | None = None,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    photo_to_ground: bool = False,
    refraction: Refraction | None = None,
    cameras: Sequence[Camera] = (),
    start_cameras: Sequence[Camera] | None = None,
    motion: RollingShutter | LineScanner | None = None,
    seed: int | np.random.Generator = 0,
) -> Simulation:
    """Simulate a block of vertical photographs.

    Parameters
    ----------
    strips, photos_per_strip
        Number of strips and of photos in each; neighbouring strips are flown in opposite directions.
    forward_overlap, side_overlap
        Overlap of neighbouring photographs (above 0.5) and strips (above 0), as a fraction of the frame,
        below 1.
    principal_distance
        Principal distance in millimetres; negative for the positive (diapositive) plane.
    frame_size
        Side of the square frame, millimetres.
    flying_height, relief
        Height above the mean terrain, and maximum deviation of the smooth terrain from its mean; metres.
    points_per_photo
        Approximate mean number of image points per photograph; the grid has a whole number of points in a
        base and in a strip.
    crab, tilt
        Maximum deviations of kappa from the heading, and of omega and phi from zero (uniform, either sign);
        radians.
    control
        "perimeter": full control around the block every `control_spacing` bases, and chains of height control
        across it at the same distance. "corners": four full control points. "none": without control. Control
        points are the pass points nearest to these positions.
    control_sd
        Standard deviation of each control coordinate, metres; 0 for fixed control.
    check_points
        Number of random points with true positions that are not used as control.
    image_sd
        Standard deviation of image coordinates in millimetres, for the noise and in the block.
    position_error, attitude_error
        Standard deviations of the errors of initial photo positions and attitudes, metres and radians.
    position_sd, attitude_sd
        Standard deviations of observed positions and attitudes (GNSS, inertial) in metres and radians, for
        the noise and in the block. Infinite: not observed. 0: fixed at the true values.
    blunders, blunder_size
        Number of image points with a gross error, and its size in millimetres, in x or y, of either sign.
    spheroid
        None: rectangular space, with x and y of the plan as X and Y. Otherwise geographic space in metres:
        the plan touches the spheroid at the origin, with x to the east. Heights are ellipsoidal, and
        photographs look down the local vertical.
    origin
        Centre of the block on the mean terrain: X, Y, Z in metres, or longitude (rad), latitude (rad), height
        (m).
    photo_to_ground
        Direction of the attitude angles.
    refraction
        Refraction model, for the images and in the block; None for straight rays.
    cameras
        Cameras, assigned to photos cyclically, with distortion, in millimetres or pixels. `frame_size` and
        `principal_distance` then only define the field of view, and image errors have the same angular size.
        Default: one camera without distortion and with the principal distance.
    start_cameras
        Initial cameras of the block, which also define free and weighted parameters. None: cameras are fixed.
    motion
        Motion of the cameras during exposure: a rolling shutter, or line scanners. Trajectories of scanners
        have weighted errors of `position_error` and `attitude_error`, and records of `position_sd` and
        `attitude_sd`. Requires rectangular space without refraction. None: cameras are at rest.
    seed
        Equal seeds and equal arguments give equal blocks.

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
    _check_numbers(locals())
    require_kind("spheroid", spheroid, Spheroid, optional=True)
    require_kind("refraction", refraction, Refraction, optional=True)
    truth_value("photo_to_ground", photo_to_ground)
    one_of("control", control, ("perimeter", "corners", "none"))
    centre = shaped("origin", origin, (3,))
    require((np.abs(centre) < _HUGE).all(), "origin", "less", high=_HUGE, value=centre.tolist())
    require(relief < flying_height, "relief", "less", high=flying_height, value=relief)
    footprint = frame_size / abs(principal_distance or math.nan) * flying_height
    if not math.isfinite(footprint):
        raise InputError(phrase("block.not-zero", name="principal_distance", value=principal_distance))
    taking = checked_cameras(cameras)
    _check_motion(motion, plain=spheroid is None and refraction is None, cameras=bool(taking))
    streams = _generator(seed).spawn(7)
    terrain_random, flight_random, initial_random, image_random, control_random, blunder_random = streams[:6]
    motion_random = streams[6].spawn(1)[0]

    angles = tilt, crab
    half_angle, steepest = _looks(principal_distance, frame_size, angles, motion, attitude_error)
    reach = 1.02 * (flying_height + relief) * math.tan(half_angle + steepest)
    plan = laid_out(
        strips, photos_per_strip, forward_overlap, side_overlap, footprint, points_per_photo, reach
    )
    terrain = ground_points(plan, relief, footprint, terrain_random)
    ground, _ = into_object_space(terrain, None, origin, spheroid, photo_to_ground)
    if isinstance(motion, LineScanner):
        from photogram.network.simulated_scanner import Flown, scanned

        flown = Flown(
            scanner=motion,
            principal_distance=principal_distance,
            frame_size=frame_size,
            height=flying_height,
            crab=crab,
            tilt=tilt,
            image_sd=image_sd,
            errors=(position_error, attitude_error),
            sd=(position_sd, attitude_sd),
            origin=centre,
            photo_to_ground=photo_to_ground,
        )
        taken = scanned(plan, flown, ground, motion_random)
        # The standard deviations apply to trajectories.
        position_error = attitude_error = 0.0
        position_sd = attitude_sd = math.inf
    else:
        photos, rotations = flight(plan, flying_height, crab, tilt, flight_random)
        poses = into_object_space(photos, rotations, origin, spheroid, photo_to_ground)
        seen = seen_side(frame_size, principal_distance, motion, flying_height - relief, half_angle)
        taken = photograph(
            plan, ground, poses, principal_distance, seen, spheroid, photo_to_ground, refraction
        )
    if not len(taken.image_points):
        raise InputError(phrase("simulation.no-points"))
    used, image_points = np.unique(taken.image_points, return_inverse=True)
    ground, terrain = ground[used], terrain[used]

    held = control_pattern(plan, terrain, control, control_spacing)
    free = np.flatnonzero(~held.any(axis=1))
    checks = control_random.choice(free, min(check_points, len(free)), replace=False)
    known: Bools = held.copy()
    known[checks] = True
    metres = geometry.lengths_of_units(ground, spheroid)
    point_sd = np.where(held, control_sd / metres, np.inf)
    control_noise = control_sd / metres * control_random.standard_normal(ground.shape)

    positions, attitudes, xy = taken.positions, taken.attitudes, taken.image_xy
    metres = geometry.lengths_of_units(positions, spheroid)
    truth = Block(
        photo_ids=taken.photo_ids,
        photo_positions=positions,
        photo_attitudes=attitudes,
        principal_distances=np.full(len(positions), principal_distance),
        point_ids=point_ids(held, checks),
        point_positions=ground,
        image_photos=taken.image_photos,
        image_points=image_points,
        image_xy=xy,
        image_sd=np.array(image_sd),
        photo_position_sd=position_sd / metres,
        photo_attitude_sd=np.array(attitude_sd),
        point_sd=point_sd,
        spheroid=spheroid,
        photo_to_ground=photo_to_ground,
        refraction=refraction,
        title=_title(strips, photos_per_strip, motion),
    )
    faults = _blunders(len(xy), blunders, blunder_size, blunder_random)
    measured = xy + taken.in_images(image_sd * image_random.standard_normal(xy.shape), np.arange(len(xy)))
    measured[faults.images] += taken.in_images(faults.amounts, faults.images)
    position_draw, attitude_draw = (initial_random.standard_normal(positions.shape) for _ in range(2))
    block = truth.replace(
        photo_positions=positions + (position_error if position_sd else 0.0) / metres * position_draw,
        photo_attitudes=attitudes + (attitude_error if attitude_sd else 0.0) * attitude_draw,
        photo_positions_observed=_observed(positions, truth.photo_position_sd, streams[6]),
        photo_attitudes_observed=_observed(attitudes, truth.photo_attitude_sd, streams[6]),
        point_positions=np.where(known, ground + np.where(held, control_noise, 0.0), np.nan),
        point_check_sd=np.where(known & ~held, 0.0, np.nan) if len(checks) else None,
        image_xy=measured,
        **taken.given,
    )
    truth = truth.replace(**taken.true)
    if taking:
        truth, block = photographed(truth, block, taking, start_cameras)
    if isinstance(motion, RollingShutter):
        frame = frame_size / abs(principal_distance)
        truth, block = rolled(truth, block, motion, plan, frame, motion_random)
    return Simulation(block, truth, faults)


def _looks(
    principal_distance: float,
    frame_size: float,
    angles: tuple[float, float],
    motion: RollingShutter | LineScanner | None,
    attitude_error: float,
) -> tuple[float, float]:
    """Return half the angle of view and the maximum inclination of cameras, radians."""
    tilt, crab = angles
    spread = frame_size / 2 / abs(principal_distance) * (math.cos(crab) + math.sin(crab))
    steepest = 2 * tilt
    if isinstance(motion, LineScanner):
        spread += math.tan(motion.view_angle) * math.sin(crab)
        steepest += 4 * attitude_error
    half_angle, high = math.atan(spread), _WIDEST - steepest
    if not _NARROWEST < half_angle < high:
        raise InputError(phrase("simulation.view-angle", angle=half_angle, low=_NARROWEST, high=high))
    require(steepest <= _FAR_MORE * half_angle, "tilt", "most", high=_FAR_MORE * half_angle / 2, value=tilt)
    return half_angle, steepest


def _observed(truth: Floats, sd: Floats, random: np.random.Generator) -> Floats | None:
    """Draw observations of the true values; None if nothing is observed."""
    draw = random.standard_normal(truth.shape)
    return truth + sd * draw if np.isfinite(sd).all() else None


def _title(strips: int, photos_per_strip: int, motion: RollingShutter | LineScanner | None) -> str:
    of = counted(photos_per_strip, "photograph")
    if isinstance(motion, LineScanner):
        of = counted(motion.lines, "line")
        if motion.scenes:
            of = f"{counted(photos_per_strip, 'scene')} of {of}"
    return f"simulated block, {counted(strips, 'strip')} of {of}"


_WHOLE_NUMBERS = {"strips": 1, "photos_per_strip": 2, "control_spacing": 1, "check_points": 0, "blunders": 0}
"""Minimum values."""
_BETWEEN = {
    "forward_overlap": (0.5, 1),
    "side_overlap": (0, 1),
    "flying_height": (_TINY, _HUGE),
    "frame_size": (0, _HUGE),
    "image_sd": (0, _HUGE),
    "principal_distance": (-_HUGE, _HUGE),
}
"""Limits, both excluded."""
_FROM = {"crab": (0, math.pi / 4), "tilt": (0, 0.1), "points_per_photo": (4, _HUGE)}
_FROM |= dict.fromkeys(("relief", "control_sd", "position_error", "attitude_error"), (0, _HUGE))
_FROM |= dict.fromkeys(("blunder_size", "position_sd", "attitude_sd"), (0, _HUGE))
"""Limits; the lower one is included, and the last two arguments may be infinite."""


def _check_numbers(arguments: Mapping[str, Any]) -> None:
    for name, least in _WHOLE_NUMBERS.items():
        count = whole_number(name, arguments[name])
        require(count >= least, name, "least", low=least, value=count)
    for name, (low, high) in _BETWEEN.items():
        value = number(name, arguments[name])
        require(low < value < high, name, "range", low=low, high=high, value=value)
    for name, (low, high) in _FROM.items():
        value = number(name, arguments[name])
        good = low <= value < high or (value == math.inf and name in ("position_sd", "attitude_sd"))
        require(good, name, "range", low=low, high=high, value=value)


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


def _blunders(images: int, count: int, size: float, random: np.random.Generator) -> Blunders:
    rows = np.sort(random.choice(images, min(count, images), replace=False))
    amounts = np.zeros((len(rows), 2))
    amounts[np.arange(len(rows)), random.integers(0, 2, len(rows))] = size * random.choice([-1, 1], len(rows))
    return Blunders(rows.astype(np.int64), amounts)
