"""Layout of simulated blocks: strips over gentle relief, a ground grid, and control points.

The block is laid out in a plane: x along the strips, y across, z up, origin at the centre on the mean
terrain. The grid of ground points is locked to the photographs: a column below each projection centre, and a
row in the centre of each side overlap. Neighbouring photographs and strips are therefore connected, and the
visible points of a photograph are predictable.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.memory import available_memory
from photogram.network import geometry
from photogram.network.simulation_options import SimulationOptions
from photogram.words import phrase

_FAR_MORE = 10.0  # Maximum ratio of generated to requested points
_AT_ONCE = 2**22  # Maximum number of pairs of photo and point that are processed together
_CANDIDATE_BYTES, _IMAGE_BYTES = 300, 240
"""Peak memory in bytes for such a pair, and for an image observation."""
_JITTER = 0.15  # maximum shift in grid cells: points in the centre of an overlap remain in the overlap


@dataclass(frozen=True)
class Layout:
    """Flight plan and point grid; lengths in metres."""

    strips: int
    photos_per_strip: int
    base: float  # between photographs of a strip
    separation: float  # of neighbouring strips
    columns_per_base: int
    rows_per_strip: int
    reach: float  # maximum distance in x or y of a visible point from the point below the photograph

    @property
    def length(self) -> float:
        """Length of a strip, from the first photograph to the last."""
        return (self.photos_per_strip - 1) * self.base

    @property
    def width(self) -> float:
        """Distance from the first strip to the last."""
        return (self.strips - 1) * self.separation

    @property
    def cell(self) -> tuple[float, float]:
        """Distance between columns and between rows of the grid."""
        return self.base / self.columns_per_base, self.separation / self.rows_per_strip


def laid_out(options: SimulationOptions, reach: float) -> Layout:
    """Lay out strips; lengths in metres.

    InputError if there are many more image points than requested, or too many for the memory.
    """
    strips, photos_per_strip = options.strips, options.photos_per_strip
    footprint, points_per_photo = options.footprint, options.points_per_photo
    base, separation = (1 - options.forward_overlap) * footprint, (1 - options.side_overlap) * footprint
    # Correct for points that only one photo of one strip sees, because they are removed.
    photos = strips * photos_per_strip
    lost = _covered_once(photos_per_strip, base, footprint) * _covered_once(strips, separation, footprint)
    density = points_per_photo * photos / (photos * footprint**2 - lost)
    columns = max(1, round(base * math.sqrt(density)))
    rows = max(1, round(density * base * separation / columns))
    plan = Layout(strips, photos_per_strip, base, separation, columns, rows, reach)
    dx, dy = plan.cell
    fewest = footprint**2 / (dx * dy)
    if fewest > _FAR_MORE * points_per_photo:
        raise InputError(phrase("simulation.many-points", points=fewest, wanted=points_per_photo))
    needed, available = _CANDIDATE_BYTES * _AT_ONCE + _IMAGE_BYTES * photos * fewest, available_memory()
    if available is not None and needed > available:
        sizes = {"needed": needed / 2**30, "available": available / 2**30}
        raise InputError(phrase("simulation.memory", **sizes))
    return plan


def _covered_once(count: int, step: float, length: float) -> float:
    """Return the length covered by one of `count` intervals only; their starts differ by `step`."""
    if count == 1:
        return length
    return 2 * step + (count - 2) * max(0.0, 2 * step - length)


def window(plan: Layout) -> tuple[Indices, Indices]:
    """Return grid columns and rows in view, relative to the column and half-strip below."""
    dx, dy = plan.cell
    columns = math.ceil(plan.reach / dx + _JITTER)
    middle, rows = -plan.rows_per_strip / 2, plan.reach / dy + _JITTER
    return np.arange(-columns, columns + 1), np.arange(
        math.floor(middle - rows), math.ceil(middle + rows) + 1
    )


def grid(plan: Layout) -> tuple[Indices, Indices]:
    """Return all grid columns and rows in view of any photograph."""
    columns, rows = window(plan)
    last_column = (plan.photos_per_strip - 1) * plan.columns_per_base + columns[-1]
    last_row = (plan.strips - 1) * plan.rows_per_strip + rows[-1]
    return np.arange(columns[0], last_column + 1), np.arange(rows[0], last_row + 1)


def candidates(plan: Layout) -> Iterator[tuple[Indices, Indices]]:
    """Yield pairs of photo and visible grid point in batches, sorted by photo, then point."""
    columns, rows = window(plan)
    _, all_rows = grid(plan)
    step = max(1, _AT_ONCE // (len(columns) * len(rows)))
    count = plan.strips * plan.photos_per_strip
    for first in range(0, count, step):
        some = np.arange(first, min(first + step, count))
        strip, number = np.divmod(some, plan.photos_per_strip)
        column = (number * plan.columns_per_base)[:, None, None] + (columns - columns[0])[:, None]
        row = (strip * plan.rows_per_strip)[:, None, None] + (rows - rows[0])
        points = column * len(all_rows) + row
        yield np.broadcast_to(some[:, None, None], points.shape).ravel(), points.ravel()


def ground_points(plan: Layout, options: SimulationOptions, random: np.random.Generator) -> Floats:
    """Generate ground points in the plan, (n, 3), column by column: a jittered grid on waves."""
    dx, dy = plan.cell
    columns, rows = grid(plan)
    x, y = np.meshgrid(
        columns * dx - plan.length / 2, (rows + plan.rows_per_strip / 2) * dy - plan.width / 2, indexing="ij"
    )
    jitter = random.uniform(-_JITTER, _JITTER, (2, *x.shape))
    x, y = x + dx * jitter[0], y + dy * jitter[1]
    waves = 8
    heading, phase = random.uniform(0, 2 * math.pi, (2, waves))
    wave_number = 2 * math.pi / (options.footprint * random.uniform(1.0, 5.0, waves))
    z = np.zeros_like(x)
    for h, k, p in zip(heading, wave_number, phase, strict=True):
        z += options.relief / waves * np.sin(k * (math.cos(h) * x + math.sin(h) * y) + p)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def flight(plan: Layout, options: SimulationOptions, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Return projection centres in the plan and rotations from the plan to the photos."""
    strip, number = np.divmod(np.arange(plan.strips * plan.photos_per_strip), plan.photos_per_strip)
    x, y = number * plan.base - plan.length / 2, strip * plan.separation - plan.width / 2
    deviation = random.uniform(-1.0, 1.0, (len(strip), 3)) * [options.tilt, options.tilt, options.crab]
    deviation[:, 2] += math.pi * (strip % 2)
    positions = np.stack([x, y, np.full(len(x), options.flying_height)], axis=1)
    return positions, geometry.rotation_matrix(deviation)


def into_object_space(
    plan_positions: Floats, rotations: Floats | None, options: SimulationOptions
) -> tuple[Floats, Floats]:
    """Transform positions and, if given, rotations from the plan to the object space."""
    origin, spheroid = options.origin, options.spheroid
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
        # East at the station, seen from the plan, is rotated about the vertical by meridian convergence.
        in_plan = geometry.local_frames(positions)[:, 0] @ frame.T
        convergence = np.zeros_like(positions)
        convergence[:, 2] = -np.arctan2(in_plan[:, 1], in_plan[:, 0])
        rotations = rotations @ geometry.rotation_matrix(convergence)
    matrices = rotations.transpose(0, 2, 1) if options.photo_to_ground else rotations
    return positions, geometry.rotation_angles(matrices)


def control_pattern(plan: Layout, terrain: Floats, pattern: str, spacing: int) -> NDArray[np.bool_]:
    """Return (n, 3) which components of points are control."""
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
    # Along the longer side, few points are close to a control position.
    axis = int(top > right)
    order = np.argsort(terrain[:, axis])
    along_axis = terrain[order, axis]
    for places, components in ((height, slice(2, 3)), (full, slice(0, 3))):
        for place in places:
            low, high = np.searchsorted(along_axis, [place[axis] - plan.reach, place[axis] + plan.reach])
            near = order[low:high]
            held[near[np.argmin(((terrain[near, :2] - place) ** 2).sum(axis=1))], components] = True
    return held


def photo_ids(plan: Layout) -> list[str]:
    strip_digits, number_digits = (max(2, len(str(count))) for count in (plan.strips, plan.photos_per_strip))
    return [
        f"{strip:0{strip_digits}d}{number:0{number_digits}d}"
        for strip in range(1, plan.strips + 1)
        for number in range(1, plan.photos_per_strip + 1)
    ]


def point_ids(held: NDArray[np.bool_], checks: Indices) -> list[str]:
    """Return point names: C for control points, K for check points, P for pass points."""
    kind = np.where(held.any(axis=1), "C", "P")
    kind[checks] = "K"
    return [f"{letter}{number:06d}" for number, letter in enumerate(kind, start=1)]
