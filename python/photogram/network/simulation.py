"""Simulated blocks: vertical photographs in strips over gentle relief.

The block is laid out in a plane: x along the strips, y across them, z up, the origin in its centre on the
mean terrain. Ground points stand on a grid locked to the photographs, a column under every projection centre
and a row in the middle of every side overlap, so that neighbouring photographs and strips are tied, and so
that the points a photograph may see are known beforehand.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import number, one_of, shaped, shown, truth_value, whole_number
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.memory import available_memory
from photogram.messages import counted
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.cameras import Camera, checked_cameras
from photogram.network.geometry import Spheroid
from photogram.network.refraction import Refraction
from photogram.network.simulated_cameras import photographed

__all__ = ["Blunders", "Simulation", "simulate"]


_HUGE = 1e12
_TINY = 1e-3
"""What no length of a block exceeds, and what none falls below."""
_NARROWEST, _WIDEST = 1e-6, 1.4
"""Radians from the vertical: what photos show beyond it is too far away to simulate."""
_FAR_MORE = 10.0
"""Times as many points as were asked for are too many."""
_AT_ONCE = 2**22
"""Pairs of photo and point that may see each other, that are looked at together."""
_CANDIDATE_BYTES, _IMAGE_BYTES = 300, 240
"""Memory for such a pair, and for an image of the block, at the peak."""
_JITTER = 0.15  # of a grid cell, either way: small enough to keep the middle of an overlap in the overlap


@dataclass(frozen=True)
class Blunders:
    """Gross errors put into image observations.

    Attributes
    ----------
    images
        (k,) rows of the block's image arrays.
    amounts
        (k, 2) what was added to x and y, in millimetres.
    """

    images: Indices
    amounts: Floats


@dataclass(frozen=True)
class Simulation:
    """A simulated block and the truth behind it.

    Attributes
    ----------
    block
        What would have been measured: noisy image coordinates, control and, where they are weighted,
        positions and attitudes of the photos; besides their coarse initial values. Check points have their
        true positions, unheld and known without error; pass points have none.
    truth
        The same block with true positions and attitudes everywhere and image coordinates free of errors.
    blunders
        The gross errors in `block`.
    """

    block: Block
    truth: Block
    blunders: Blunders


@dataclass(frozen=True)
class _Plan:
    """The plan of the flight: metres, counts and the point grid."""

    strips: int
    photos_per_strip: int
    base: float  # between photographs of a strip
    separation: float  # of neighbouring strips
    columns_per_base: int
    rows_per_strip: int
    reach: float  # how far from the point below it a photograph may see, in x or y

    @property
    def length(self) -> float:
        return (self.photos_per_strip - 1) * self.base

    @property
    def width(self) -> float:
        return (self.strips - 1) * self.separation

    @property
    def cell(self) -> tuple[float, float]:
        return self.base / self.columns_per_base, self.separation / self.rows_per_strip


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
    seed: int | np.random.Generator = 0,
) -> Simulation:
    """Simulate a block of vertical photographs.

    Parameters
    ----------
    strips, photos_per_strip
        Their numbers; neighbouring strips are flown in opposite directions.
    forward_overlap, side_overlap
        Of neighbouring photographs and strips, as parts of the frame: above 0.5 and above 0 respectively,
        below 1.
    principal_distance
        Millimetres; negative for the positive (diapositive) plane.
    frame_size
        Side of the square frame, millimetres.
    flying_height, relief
        Above the mean terrain, and the largest height of the smooth terrain above or below its mean; metres.
    points_per_photo
        Mean number of image points on a photograph, nearly: the grid has whole numbers of points in a base
        and in a strip.
    crab, tilt
        Largest deviations of kappa from the heading, and of omega and phi from zero (uniform, either sign);
        radians.
    control
        "perimeter": full control around the block every `control_spacing` bases and chains of height control
        across it, as far apart; "corners": four full control points; "none". Control points are pass points
        near these places.
    control_sd
        Standard deviation of every held component, metres; 0 gives fixed control.
    check_points
        How many points, chosen at random, carry their true position without being held.
    image_sd
        Standard deviation of image coordinates, millimetres: of their noise and in the block.
    position_error, attitude_error
        Standard deviation of the errors in the initial values of the photos, metres and radians.
    position_sd, attitude_sd
        Standard deviations of observed positions and attitudes (GNSS, inertial), metres and radians: of their
        noise and in the block. Infinite: none are observed; 0: they are fixed at the truth.
    blunders, blunder_size
        How many image points get a gross error, and its size in millimetres, in x or y, of either sign.
    spheroid
        None: rectangular space, x and y of the plan being X and Y. Else geographic space in metres: the plan
        touches the spheroid at the origin, its x pointing east there; heights count from the spheroid,
        photographs look down the local vertical.
    origin
        The centre of the block on the mean terrain: X, Y, Z in metres, or longitude (rad), latitude (rad),
        height (m).
    photo_to_ground
        The sense of the attitude angles.
    refraction
        What bends the rays, in the images and in the block; None: they are straight.
    cameras
        Take the photos in turn: with distortion, in millimetres or pixels; `frame_size` and
        `principal_distance` then only say what they see, and errors of image coordinates are as large in
        angle. None given: a camera without distortion, with the principal distance.
    start_cameras
        What the block knows of them: where it starts from, and which parameters are free or weighted. None:
        they are known.
    seed
        Equal seeds and equal arguments give equal blocks.

    Returns
    -------
    Simulation
        Photos strip by strip, named by strip and photo ("0203"); images sorted by photo, then point. Points
        seen on one photo only are left out. Names of control points begin with C, of check points with K, of
        pass points with P.

    Raises
    ------
    InputError
        Arguments outside their ranges.
    """
    _check_types(locals())
    truth_value("photo_to_ground", photo_to_ground)
    one_of("control", control, ("perimeter", "corners", "none"))
    centre = shaped("origin", origin, (3,))
    footprint = frame_size / abs(principal_distance or math.nan) * flying_height
    _check(
        {
            "strips": (strips >= 1, "at least 1"),
            "photos_per_strip": (photos_per_strip >= 2, "at least 2"),
            "forward_overlap": (0.5 < forward_overlap < 1, "between 0.5 and 1"),
            "side_overlap": (0 < side_overlap < 1, "between 0 and 1"),
            "principal_distance": (math.isfinite(footprint), "finite and not 0"),
            "frame_size": (frame_size > 0, "positive"),
            "flying_height": (flying_height > _TINY, f"above {_TINY:g}"),
            "relief": (0 <= relief < flying_height, "between 0 and the flying height"),
            "points_per_photo": (4 <= points_per_photo < math.inf, "at least 4"),
            "crab": (0 <= crab < math.pi / 4, "between 0 and pi/4"),
            "tilt": (0 <= tilt < 0.1, "between 0 and 0.1"),
            "control_spacing": (control_spacing >= 1, "at least 1"),
            "control_sd": (0 <= control_sd < math.inf, "finite and not negative"),
            "check_points": (check_points >= 0, "not negative"),
            "image_sd": (0 < image_sd < math.inf, "finite and positive"),
            "position_error": (0 <= position_error < math.inf, "finite and not negative"),
            "attitude_error": (0 <= attitude_error < math.inf, "finite and not negative"),
            "position_sd": (position_sd >= 0, "not negative"),
            "attitude_sd": (attitude_sd >= 0, "not negative"),
            "origin": (bool((np.abs(centre) < _HUGE).all()), f"below {_HUGE:g}"),
            "blunders": (blunders >= 0, "not negative"),
            "blunder_size": (0 <= blunder_size < math.inf, "finite and not negative"),
        }
    )
    streams = _generator(seed).spawn(7)
    terrain_random, flight_random, initial_random, image_random, control_random, blunder_random = streams[:6]

    half_angle = math.atan(frame_size / 2 / abs(principal_distance) * (math.cos(crab) + math.sin(crab)))
    if not _NARROWEST < half_angle < _WIDEST - 2 * tilt:
        raise InputError("principal_distance and frame_size: the photos see too little, or to the horizon")
    if 2 * tilt > _FAR_MORE * half_angle:
        raise InputError(
            f"tilt: photos that see {half_angle:.2g} rad to either side and look up to {2 * tilt:.2g} rad"
            " aside do not overlap"
        )
    reach = 1.02 * (flying_height + relief) * math.tan(half_angle + 2 * tilt)
    plan = _plan(strips, photos_per_strip, forward_overlap, side_overlap, footprint, points_per_photo, reach)
    terrain = _terrain(plan, relief, footprint, terrain_random)
    photos, rotations = _flight(plan, flying_height, crab, tilt, flight_random)
    positions, attitudes = _into_object_space(photos, rotations, origin, spheroid, photo_to_ground)
    ground, _ = _into_object_space(terrain, None, origin, spheroid, photo_to_ground)

    image_photos, image_points, xy = _photograph(
        plan,
        ground,
        positions,
        attitudes,
        principal_distance,
        frame_size,
        spheroid,
        photo_to_ground,
        refraction,
    )
    if not len(image_points):
        raise InputError("no point is seen on two photos")
    used, image_points = np.unique(image_points, return_inverse=True)
    ground, terrain = ground[used], terrain[used]

    held = _control(plan, terrain, control, control_spacing)
    free = np.flatnonzero(~held.any(axis=1))
    checks = control_random.choice(free, min(check_points, len(free)), replace=False)
    known = held.copy()
    known[checks] = True
    metres = geometry.lengths_of_units(ground, spheroid)
    point_sd = np.where(held, control_sd / metres, np.inf)
    control_noise = control_sd / metres * control_random.standard_normal(ground.shape)

    metres = geometry.lengths_of_units(positions, spheroid)
    truth = Block(
        photo_ids=_photo_ids(plan),
        photo_positions=positions,
        photo_attitudes=attitudes,
        principal_distances=np.full(len(positions), principal_distance),
        point_ids=_point_ids(held, checks),
        point_positions=ground,
        image_photos=image_photos,
        image_points=image_points,
        image_xy=xy,
        image_sd=np.array(image_sd),
        photo_position_sd=position_sd / metres,
        photo_attitude_sd=np.array(attitude_sd),
        point_sd=point_sd,
        spheroid=spheroid,
        photo_to_ground=photo_to_ground,
        refraction=refraction,
        title=f"simulated block, {counted(strips, 'strip')} of {counted(photos_per_strip, 'photograph')}",
    )
    faults = _blunders(len(xy), blunders, blunder_size, blunder_random)
    measured = xy + image_sd * image_random.standard_normal(xy.shape)
    measured[faults.images] += faults.amounts
    position_draw, attitude_draw = (initial_random.standard_normal(positions.shape) for _ in range(2))
    block = truth.replace(
        photo_positions=positions + (position_error if position_sd else 0.0) / metres * position_draw,
        photo_attitudes=attitudes + (attitude_error if attitude_sd else 0.0) * attitude_draw,
        photo_positions_observed=_observed(positions, truth.photo_position_sd, streams[6]),
        photo_attitudes_observed=_observed(attitudes, truth.photo_attitude_sd, streams[6]),
        point_positions=np.where(known, ground + np.where(held, control_noise, 0.0), np.nan),
        point_check_sd=np.where(known & ~held, 0.0, np.nan) if len(checks) else None,
        image_xy=measured,
    )
    if taking := checked_cameras(cameras):
        truth, block = photographed(truth, block, taking, start_cameras)
    return Simulation(block, truth, faults)


def _observed(truth: Floats, sd: Floats, random: np.random.Generator) -> Floats | None:
    """Draw observations of the truth; None where nothing is observed."""
    draw = random.standard_normal(truth.shape)
    return truth + sd * draw if np.isfinite(sd).all() else None


_WHOLE_NUMBERS = ("strips", "photos_per_strip", "control_spacing", "check_points", "blunders")
_CLASSES = {"spheroid": Spheroid, "refraction": Refraction}
_OTHERS = ("control", "origin", "photo_to_ground", "cameras", "start_cameras", "seed")


def _check_types(arguments: Mapping[str, object]) -> None:
    """Refuse arguments of another type: all are numbers but for a few."""
    for name, value in arguments.items():
        if name in _WHOLE_NUMBERS:
            whole_number(name, value)
        elif name in _CLASSES:
            if value is not None and not isinstance(value, _CLASSES[name]):
                raise InputError(f"{name} is a {_CLASSES[name].__name__} or None, not {shown(value)}")
        elif name not in _OTHERS and _HUGE < abs(number(name, value)) < math.inf:
            raise InputError(f"{name} must be below {_HUGE:g}")


def _generator(seed: int | np.random.Generator) -> np.random.Generator:
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError) as error:
        raise InputError(f"seed: {error}") from None


def _check(ranges: dict[str, tuple[bool, str]]) -> None:
    for name, (fine, expected) in ranges.items():
        if not fine:
            raise InputError(f"{name} must be {expected}")


def _plan(
    strips: int,
    photos_per_strip: int,
    forward_overlap: float,
    side_overlap: float,
    footprint: float,
    points_per_photo: float,
    reach: float,
) -> _Plan:
    base, separation = (1 - forward_overlap) * footprint, (1 - side_overlap) * footprint
    # Points on one photo are left out: where one photo of one strip sees, the images are lost.
    photos = strips * photos_per_strip
    lost = _covered_once(photos_per_strip, base, footprint) * _covered_once(strips, separation, footprint)
    density = points_per_photo * photos / (photos * footprint**2 - lost)
    columns = max(1, round(base * math.sqrt(density)))
    rows = max(1, round(density * base * separation / columns))
    plan = _Plan(strips, photos_per_strip, base, separation, columns, rows, reach)
    _check_size(plan, footprint, points_per_photo)
    return plan


def _check_size(plan: _Plan, footprint: float, points_per_photo: float) -> None:
    """Refuse a plan with far more image points than were asked for, or than there is memory for."""
    dx, dy = plan.cell
    fewest = footprint**2 / (dx * dy)
    if fewest > _FAR_MORE * points_per_photo:
        raise InputError(
            "forward_overlap and side_overlap: with a column of points under every photo and a row in every"
            f" side overlap a photo shows about {fewest:.0f} points, not {points_per_photo:g}"
        )
    photos = plan.strips * plan.photos_per_strip
    needed, available = _CANDIDATE_BYTES * _AT_ONCE + _IMAGE_BYTES * photos * fewest, available_memory()
    if available is not None and needed > available:
        gib = [f"{size / 2**30:.1f} GiB" for size in (needed, available)]
        raise InputError(f"the simulation takes {gib[0]} of memory, and {gib[1]} are free")


def _covered_once(count: int, step: float, length: float) -> float:
    """How much of a line only one of `count` overlapping intervals covers, their starts a step apart."""
    if count == 1:
        return length
    return 2 * step + (count - 2) * max(0.0, 2 * step - length)


def _window(plan: _Plan) -> tuple[Indices, Indices]:
    """Grid columns and rows a photograph may see, counted from the column and half-strip below it."""
    dx, dy = plan.cell
    columns = math.ceil(plan.reach / dx + _JITTER)
    middle, rows = -plan.rows_per_strip / 2, plan.reach / dy + _JITTER
    return np.arange(-columns, columns + 1), np.arange(
        math.floor(middle - rows), math.ceil(middle + rows) + 1
    )


def _grid(plan: _Plan) -> tuple[Indices, Indices]:
    """All grid columns and rows: those of the first photograph to those of the last."""
    columns, rows = _window(plan)
    last_column = (plan.photos_per_strip - 1) * plan.columns_per_base + columns[-1]
    last_row = (plan.strips - 1) * plan.rows_per_strip + rows[-1]
    return np.arange(columns[0], last_column + 1), np.arange(rows[0], last_row + 1)


def _candidates(plan: _Plan) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of photo and grid point that may see each other, by photo, then point: some photos at a time."""
    columns, rows = _window(plan)
    _, all_rows = _grid(plan)
    step = max(1, _AT_ONCE // (len(columns) * len(rows)))
    count = plan.strips * plan.photos_per_strip
    for first in range(0, count, step):
        some = np.arange(first, min(first + step, count))
        strip, number = np.divmod(some, plan.photos_per_strip)
        column = (number * plan.columns_per_base)[:, None, None] + (columns - columns[0])[:, None]
        row = (strip * plan.rows_per_strip)[:, None, None] + (rows - rows[0])
        points = column * len(all_rows) + row
        yield np.broadcast_to(some[:, None, None], points.shape).ravel(), points.ravel()


def _photograph(
    plan: _Plan,
    ground: Floats,
    positions: Floats,
    attitudes: Floats,
    principal_distance: float,
    frame_size: float,
    spheroid: Spheroid | None,
    photo_to_ground: bool,
    refraction: Refraction | None,
) -> tuple[Indices, Indices, Floats]:
    """Photos, points and coordinates of the images in the frame whose points are seen at least twice."""
    found = []
    for photos, points in _candidates(plan):
        xy = geometry.project(
            ground[points],
            positions[photos],
            attitudes[photos],
            np.full(len(photos), principal_distance),
            spheroid=spheroid,
            photo_to_ground=photo_to_ground,
            refraction=refraction,
        )
        seen = (np.abs(xy) <= frame_size / 2).all(axis=1)
        found.append((photos[seen], points[seen], xy[seen]))
    photos, points, xy = (np.concatenate(each) for each in zip(*found, strict=True))
    seen = np.bincount(points)[points] >= 2
    return photos[seen], points[seen], xy[seen]


def _terrain(plan: _Plan, relief: float, footprint: float, random: np.random.Generator) -> Floats:
    """Ground points in the plan, (n, 3), column by column: a jittered grid on long waves."""
    dx, dy = plan.cell
    columns, rows = _grid(plan)
    x, y = np.meshgrid(
        columns * dx - plan.length / 2, (rows + plan.rows_per_strip / 2) * dy - plan.width / 2, indexing="ij"
    )
    jitter = random.uniform(-_JITTER, _JITTER, (2, *x.shape))
    x, y = x + dx * jitter[0], y + dy * jitter[1]
    waves = 8
    heading, phase = random.uniform(0, 2 * math.pi, (2, waves))
    wave_number = 2 * math.pi / (footprint * random.uniform(1.0, 5.0, waves))
    z = np.zeros_like(x)
    for h, k, p in zip(heading, wave_number, phase, strict=True):
        z += relief / waves * np.sin(k * (math.cos(h) * x + math.sin(h) * y) + p)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def _flight(
    plan: _Plan, flying_height: float, crab: float, tilt: float, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Projection centres in the plan and rotations from the plan to the photos."""
    strip, number = np.divmod(np.arange(plan.strips * plan.photos_per_strip), plan.photos_per_strip)
    x, y = number * plan.base - plan.length / 2, strip * plan.separation - plan.width / 2
    deviation = random.uniform(-1.0, 1.0, (len(strip), 3)) * [tilt, tilt, crab]
    deviation[:, 2] += math.pi * (strip % 2)
    return np.stack([x, y, np.full(len(x), flying_height)], axis=1), geometry.rotation_matrix(deviation)


def _into_object_space(
    plan_positions: Floats,
    rotations: Floats | None,
    origin: tuple[float, float, float],
    spheroid: Spheroid | None,
    photo_to_ground: bool,
) -> tuple[Floats, Floats]:
    """Positions and, given the rotations from the plan to the photos, attitudes in the object space."""
    positions = plan_positions + np.asarray(origin)
    if spheroid is not None:
        tangent_point = np.array([[origin[0], origin[1], 0.0]])
        frame = geometry.local_frames(tangent_point)[0]
        plane = plan_positions * [1.0, 1.0, 0.0]
        xyz = geometry.geographic_to_geocentric(tangent_point, spheroid) + plane @ frame
        positions = geometry.geocentric_to_geographic(xyz, spheroid)
        positions[:, 2] = plan_positions[:, 2] + origin[2]
    if rotations is None:
        return positions, np.empty((0, 3))
    if spheroid is not None:
        # East at the station, seen from the plan: turned about the vertical by the convergence of the
        # meridians.
        in_plan = geometry.local_frames(positions)[:, 0] @ frame.T
        convergence = np.zeros_like(positions)
        convergence[:, 2] = -np.arctan2(in_plan[:, 1], in_plan[:, 0])
        rotations = rotations @ geometry.rotation_matrix(convergence)
    return positions, geometry.rotation_angles(rotations.transpose(0, 2, 1) if photo_to_ground else rotations)


def _control(plan: _Plan, terrain: Floats, pattern: str, spacing: int) -> NDArray[np.bool_]:
    """Which components of which points are held, (n, 3)."""
    held = np.zeros(terrain.shape, dtype=bool)
    if pattern == "none":
        return held
    right, top = plan.length / 2, (plan.width + plan.separation) / 2
    along, across = 2, 2
    if pattern == "perimeter":
        along = max(2, round(2 * right / (spacing * plan.base)) + 1)
        across = max(2, round(2 * top / (spacing * plan.base)) + 1)
    xs, ys = np.linspace(-right, right, along), np.linspace(-top, top, across)
    full = [(x, y) for x in xs for y in (-top, top)] + [(x, y) for x in (-right, right) for y in ys[1:-1]]
    height = []
    if pattern == "perimeter":
        overlaps = np.linspace(-top, top, plan.strips + 1)[1:-1]
        height = [(x, y) for x in xs[1:-1] for y in overlaps]
    # Along the longer side few points are near a place.
    axis = int(top > right)
    order = np.argsort(terrain[:, axis])
    along_axis = terrain[order, axis]
    for places, components in ((height, slice(2, 3)), (full, slice(0, 3))):
        for place in places:
            low, high = np.searchsorted(along_axis, [place[axis] - plan.reach, place[axis] + plan.reach])
            near = order[low:high]
            held[near[np.argmin(((terrain[near, :2] - place) ** 2).sum(axis=1))], components] = True
    return held


def _blunders(images: int, count: int, size: float, random: np.random.Generator) -> Blunders:
    rows = np.sort(random.choice(images, min(count, images), replace=False))
    amounts = np.zeros((len(rows), 2))
    amounts[np.arange(len(rows)), random.integers(0, 2, len(rows))] = size * random.choice([-1, 1], len(rows))
    return Blunders(rows.astype(np.int64), amounts)


def _photo_ids(plan: _Plan) -> list[str]:
    strip_digits, number_digits = (max(2, len(str(count))) for count in (plan.strips, plan.photos_per_strip))
    return [
        f"{strip:0{strip_digits}d}{number:0{number_digits}d}"
        for strip in range(1, plan.strips + 1)
        for number in range(1, plan.photos_per_strip + 1)
    ]


def _point_ids(held: NDArray[np.bool_], checks: Indices) -> list[str]:
    kind = np.where(held.any(axis=1), "C", "P")
    kind[checks] = "K"
    return [f"{letter}{number:06d}" for number, letter in enumerate(kind, start=1)]
