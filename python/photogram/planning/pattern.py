"""One pattern of a plan: predicted block, deviations, locations, scale.

Points are grouped by their location in the block, not by their distance to control. So groups of different
patterns contain the same points. The accuracy of blocks is usually tabulated this way: it is low at the
border, with few rays from one side, and uniform inside.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from photogram.adjustment.prediction import image_depths
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.motion import on_shared, timed_images
from photogram.network.point_sets import hull
from photogram.network.rays import local_axes
from photogram.network.trajectories import Readout
from photogram.results.evaluation import evaluated
from photogram.results.hypotheses import Hypotheses
from photogram.results.network_trial import block_facts
from photogram.results.result import Result
from photogram.statistics.reliability import TESTABLE, largest_effect, minimal_detectable_error

LOCATIONS = ("corner", "edge", "interior")
PLACES = 25  # Evenly spaced times of a trajectory
CLASSES = (*((f"{n} rays", n, n) for n in range(2, 7)), ("7 to 9 rays", 7, 9), ("10 and more", 10, math.inf))
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class UnknownQuality:
    """Expected quality of one unknown of all photos or trajectories.

    Attributes
    ----------
    unknown
        Name of the unknown; of motions "readout time" with its name, "velocity", "rate" (of photos with
        motions of their own), "position of trajectories" or "rotation of trajectories" (anywhere between
        their observations).
    unit
        The linear unit, "rad", "s", the linear unit a second, or "rad/s".
    rms_sd, max_sd
        Root mean square and largest of the expected standard deviations.
    redundancy
        Mean redundancy number of the given values as observations; NaN if none is weighted, and of motions.
    """

    unknown: str
    unit: str
    rms_sd: float
    max_sd: float
    redundancy: float = math.nan


@dataclass(frozen=True)
class PointQuality:
    """Expected quality of a group of new points.

    Attributes
    ----------
    grouping, group
        `rays`, `location` or `all`, and the name of the group.
    points
        Number of points.
    rms_sd, max_sd
        Root mean square and largest of their expected standard deviations in the three coordinates, linear
        unit.
    redundancy
        Mean redundancy number of their image coordinates.
    unchecked
        Share of image coordinates with a redundancy below 0.01, whose gross errors cannot be detected.
    detectable
        Median minimal detectable error of the other image coordinates, millimetres; NaN for none.
    effect
        Median of the largest effect of such an undetected error, in standard deviations; NaN for none.
    """

    grouping: str
    group: str
    points: int
    rms_sd: Triple
    max_sd: Triple
    redundancy: float
    unchecked: float
    detectable: float
    effect: float


@dataclass(frozen=True)
class ControlQuality:
    """Reliability of one component of control.

    Attributes
    ----------
    component
        Name of the component.
    held
        Number of control points with this component weighted or fixed.
    sd
        Root mean square of its a priori standard deviations, linear unit.
    redundancy
        Mean redundancy number of the weighted (not fixed) ones; NaN for none.
    detectable
        Median minimal detectable error, linear unit; NaN for none.
    effect
        Median of the largest effect of such an undetected error, in standard deviations; NaN for none.
    """

    component: str
    held: int
    sd: float
    redundancy: float
    detectable: float
    effect: float


@dataclass(frozen=True, eq=False)
class Pattern:
    """A planned network with its expected quality.

    Attributes
    ----------
    name
        Name of the pattern, for tables.
    result
        The predicted block (a priori unit weight).
    known
        The prediction for known readout times; None if they are known or do not exist.
    """

    name: str
    result: Result
    known: Result | None = None

    @property
    def block(self) -> Block:
        """The planned block."""
        return self.result.block

    @property
    def axes(self) -> tuple[str, str, str]:
        """Component names of positions: X, Y, Z, or E (east), N (north), h (height)."""
        return ("E", "N", "h") if self.block.geographic else ("X", "Y", "Z")

    @cached_property
    def point_sd(self) -> Floats:
        """(n, 3) expected standard deviations along `axes`, linear unit; NaN for excluded points."""
        return self.result.point_sd * self._point_units

    @cached_property
    def photo_sd(self) -> Floats:
        """(P, 6) expected standard deviations: along `axes` in the linear unit, then angles in radians."""
        sd = self.result.photo_sd.copy()
        sd[:, :3] *= geometry.lengths_of_units(self.result.photo_positions, self.block.spheroid)
        return sd

    @property
    def new_points(self) -> NDArray[np.bool_]:
        """(n,) mask of points to be determined: used points that are not control."""
        return np.asarray(self.result.used_points & (self.result.point_kinds != "control"))

    @cached_property
    def point_plan(self) -> Floats:
        """(n, 2) points in plan, linear unit: X, Y, or the tangent plane at the photos, x to the east."""
        return self._plan(self.result.point_positions)

    @cached_property
    def photo_plan(self) -> Floats:
        """(P, 2) photo stations in plan, like `point_plan`."""
        return self._plan(self.result.photo_positions)

    @cached_property
    def point_locations(self) -> NDArray[np.str_]:
        """(n,) `corner`, `edge` or `interior`; see :func:`~photogram.planning.pattern.locations`."""
        stations = [self.photo_plan]
        if on_shared(self.block).any():
            # A strip of a scanner is as long as its trajectory.
            flown = {id(each): each for each in self.block.all_trajectories}
            axes = geometry.Cartesian(self.block.spheroid)
            stations += [self._plan(axes.from_cartesian(each.table.positions)) for each in flown.values()]
        return locations(self.point_plan, np.concatenate(stations))

    @cached_property
    def scale(self) -> float:
        """Mean length on the ground of one millimetre in the photo, linear unit."""
        return float(self._scales.mean())

    @cached_property
    def unit(self) -> float:
        """Mean standard deviation of image coordinates on the ground, linear unit."""
        rms = np.sqrt((self.result.block.image_sd[self.result.used_images] ** 2).mean(axis=1))
        return float((self._scales * rms).mean())

    @cached_property
    def points(self) -> list[PointQuality]:
        """New points and their images, by number of rays, by location, and all."""
        rays = self.result.point_rays
        groups = [("rays", name, (rays >= low) & (rays <= high)) for name, low, high in CLASSES]
        groups += [("location", name, self.point_locations == name) for name in LOCATIONS]
        groups.append(("all", "all", np.ones(len(rays), dtype=np.bool_)))
        return [self._group(grouping, name, self.new_points & chosen) for grouping, name, chosen in groups]

    @cached_property
    def photos(self) -> list[UnknownQuality]:
        """Positions (linear unit) and attitudes (radians) of the photos."""
        block, redundancy = self.block, self.result.photo_redundancy.copy()
        moving = {each.photo for each in block.timed if each.trajectory is None}
        for row, name in enumerate(block.photo_ids):
            if name in moving:
                own = self.result.trajectories[name]
                redundancy[row] = [*own.position_redundancy[0], *own.rotation_redundancy[0]]
        given_sd = np.hstack([block.photo_position_sd, block.photo_attitude_sd])
        weighted = np.isfinite(given_sd) & (given_sd > 0)
        unknowns = (*self.axes, "omega", "phi", "kappa")
        units = [block.linear_unit] * 3 + ["rad"] * 3
        return [
            UnknownQuality(name, unit, _rms(sd), _of(np.max, sd), _of(np.mean, numbers[rows]))
            for name, unit, sd, numbers, rows in zip(
                unknowns, units, self.photo_sd.T, redundancy.T, weighted.T, strict=True
            )
        ]

    @cached_property
    def motion(self) -> list[UnknownQuality]:
        """Readout times, velocities and rates; empty without motion."""
        block, trajectories = self.block, self.result.trajectories
        if not block.timed:
            return []
        unknowns, linear = self.result.unknowns, block.linear_unit
        free = [each for each in unknowns if isinstance(each.given, Readout) and not each.given.is_held]
        found = [(f"readout time, {each.name}", "s", each.sd[:1]) for each in free]
        if own := [trajectories[each.photo] for each in block.timed if each.trajectory is None]:
            found.append(("velocity", f"{linear}/s", np.array([each.position_sd[1] for each in own])))
            found.append(("rate", "rad/s", np.array([each.rotation_sd[1] for each in own])))
        times = _times_on_trajectories(block).items()
        if sds := [trajectories[name].poses(own).sd for name, own in times]:
            sd = np.concatenate(sds)
            found.append(("position of trajectories", linear, sd[:, :3]))
            found.append(("rotation of trajectories", "rad", sd[:, 3:]))
        return [UnknownQuality(name, unit, _rms(sd), float(sd.max())) for name, unit, sd in found]

    @cached_property
    def hypotheses(self) -> Hypotheses | None:
        """Undetected errors and their effects without check points; None without redundancy."""
        if not self.result.degrees_of_freedom > 0:
            return None
        # In a plan, all points have given coordinates, but these check nothing.
        facts = block_facts(self.block, self.result.photo_positions)
        found = evaluated(self.result, self.result.reliability(), facts)[0]
        return replace(found, planned=True)

    @property
    def known_rms_sd(self) -> tuple[float, float, float] | None:
        """`rms_sd` of all new points for known readout times; None if they are known."""
        if self.known is None or not self.new_points.any():
            return None
        return _triple(_rms, (self.known.point_sd * self._point_units)[self.new_points])

    @cached_property
    def control(self) -> list[ControlQuality]:
        """Weighted or fixed components of control, by axis."""
        qualities, given_sd = [], self.block.point_sd * self._point_units
        for name, sd, numbers in zip(self.axes, given_sd.T, self.result.point_redundancy.T, strict=True):
            held = self.result.used_points & np.isfinite(sd)
            weighted = held & (sd > 0)
            redundancy = numbers[weighted]
            detectable = _of(np.median, minimal_detectable_error(sd[weighted], redundancy))
            effect, mean = _of(np.median, largest_effect(redundancy)), _of(np.mean, redundancy)
            qualities.append(ControlQuality(name, int(held.sum()), _rms(sd[held]), mean, detectable, effect))
        return qualities

    def _group(self, grouping: str, group: str, chosen: Bools) -> PointQuality:
        block, sd = self.block, self.point_sd[chosen]
        images = chosen[block.image_points]
        redundancy = self.result.redundancy[images]
        checked = redundancy >= TESTABLE
        detectable = minimal_detectable_error(block.image_sd[images], redundancy)[checked]
        return PointQuality(
            grouping=grouping,
            group=group,
            points=int(chosen.sum()),
            rms_sd=_triple(_rms, sd),
            max_sd=_triple(lambda column: _of(np.max, column), sd),
            redundancy=_of(np.mean, redundancy),
            unchecked=1 - _of(np.mean, checked),
            detectable=_of(np.median, detectable),
            effect=_of(np.median, largest_effect(redundancy[checked])),
        )

    @cached_property
    def _point_units(self) -> Floats:
        """(n, 3) lengths of the units of point coordinates, linear unit."""
        return geometry.lengths_of_units(self.result.point_positions, self.block.spheroid)

    @cached_property
    def _scales(self) -> Floats:
        photos = self.block.image_photos[self.result.used_images]
        depths = image_depths(self.block)[self.result.used_images]
        return np.asarray(depths / self.block.camera_scales()[photos])

    def _plan(self, positions: Floats) -> Floats:
        local = local_axes(self.block).positions if self.block.geographic else np.asarray
        return local(positions)[:, :2]


def with_known_readout(block: Block) -> Block | None:
    """Return a block with known readout times; None if all are known."""
    known: dict[int, Readout] = {}
    timed = []
    for each in block.timed:
        own = each.readout
        if each.shutter is not None and own is not None and not own.is_held:
            readout = known.setdefault(id(own), Readout(own.name, own.value, 0.0))
            each = replace(each, shutter=replace(each.shutter, readout=readout))
        timed.append(each)
    return block.replace(timed=timed) if known else None


def locations(points: Floats, stations: Floats) -> NDArray[np.str_]:
    """Return the location of each of (n, 2) points in plan, (n,): one of `LOCATIONS`.

    The block is the smallest rectangle around its (P, 2) photo stations, P at least 1. Points inside are in
    the interior, points beyond one side at an edge, and points beyond two sides in a corner. So a single
    strip has flanks and ends, but hardly an interior.
    """
    # One of its sides is on the convex hull (Freeman and Shapira, 1975).
    corners, axes = hull(stations), np.eye(2)
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    if (lengths > 0).any():
        c, s = (sides[lengths > 0] / lengths[lengths > 0, np.newaxis]).T
        frames = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
        extents = np.ptp(np.einsum("kij,nj->kin", frames, corners), axis=2)
        axes = frames[np.argmin(extents.prod(axis=1))]
    turned, extent = points @ axes.T, stations @ axes.T
    beyond = (turned < extent.min(axis=0)) | (turned > extent.max(axis=0))
    return np.asarray(np.array(LOCATIONS)[2 - beyond.sum(axis=1)])


def _times_on_trajectories(block: Block) -> dict[str, Floats]:
    found: dict[str, list[float]] = {}
    for each, trajectory, _, own in timed_images(block):
        if each.trajectory is not None and len(own):
            found.setdefault(trajectory.name, []).extend(each.times(block.image_xy[own]).tolist())
    return {name: np.linspace(min(times), max(times), PLACES) for name, times in found.items()}


def _triple(reduce: Callable[[Floats], float], sd: Floats) -> Triple:
    return cast("Triple", tuple(reduce(column) for column in sd.T))


def _rms(values: Floats) -> float:
    return math.sqrt(_of(np.mean, values**2))


def _of(reduce: Callable[[Any], Any], values: Floats | Bools) -> float:
    return float(reduce(values)) if values.size else math.nan
