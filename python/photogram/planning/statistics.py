"""The figures of a plan: what groups of points, photos, control and motions promise.

Points are grouped by their place in the block, not by their distance to control: it is the same for every
pattern of control, so that the rows of two patterns hold the same points, and it is how the accuracy of
blocks is usually tabulated: weak at the border, where rays are few and come from one side, uniform inside.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.hull import hull
from photogram.network.trajectories import Readout
from photogram.results.result import Result
from photogram.statistics.reliability import TESTABLE, largest_effect, minimal_detectable_error

LOCATIONS = ("corner", "edge", "interior")


def locations(points: Floats, stations: Floats) -> NDArray[np.str_]:
    """Return the location of each of (n, 2) points in plan, (n,): one of `LOCATIONS`.

    The block is the smallest rectangle around its (P, 2) photo stations, P at least 1. A point in it lies in
    the interior, one beyond a side of it at an edge, one beyond two sides in a corner. So a single strip has
    flanks and ends, but hardly an interior.
    """
    axes = _axes(stations)
    turned, extent = points @ axes.T, stations @ axes.T
    beyond = (turned < extent.min(axis=0)) | (turned > extent.max(axis=0))
    return np.asarray(np.array(LOCATIONS)[2 - beyond.sum(axis=1)])


def _axes(points: Floats) -> Floats:
    """Rows: the unit vectors along the sides of the smallest rectangle around points in plan.

    One of its sides lies along a side of the convex hull (Freeman and Shapira, 1975).
    """
    corners = hull(points)
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    if not (lengths > 0).any():
        return np.eye(2)
    c, s = (sides[lengths > 0] / lengths[lengths > 0, np.newaxis]).T
    frames = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
    extents = np.ptp(np.einsum("kij,nj->kin", frames, corners), axis=2)
    return np.asarray(frames[np.argmin(extents.prod(axis=1))])


PLACES = 25  # Evenly spaced times of a trajectory


@dataclass(frozen=True)
class MotionQuality:
    """What is expected of a motion that all photos, or all trajectories, have.

    Attributes
    ----------
    unknown
        "readout time" with its name, "velocity", "rate" (of photos with motions of their own), "position of
        trajectories" or "rotation of trajectories" (anywhere between their images).
    unit
        "s", the linear unit a second, "rad/s", the linear unit or "rad".
    rms_sd, max_sd
        Root mean square and largest of the expected standard deviations of its components.
    """

    unknown: str
    unit: str
    rms_sd: float
    max_sd: float


def motion_quality(result: Result) -> list[MotionQuality]:
    """Return what a predicted block promises of motions; nothing where nothing moves."""
    block = result.block
    if not block.timed:
        return []
    found = [
        MotionQuality(f"readout time, {each.name}", "s", float(each.sd[0]), float(each.sd[0]))
        for each in result.unknowns
        if isinstance(each.given, Readout) and not each.given.is_held
    ]
    own = [result.trajectories[each.photo] for each in block.timed if each.trajectory is None]
    linear = block.linear_unit
    if own:
        found.append(_quality("velocity", f"{linear}/s", np.array([each.position_sd[1] for each in own])))
        found.append(_quality("rate", "rad/s", np.array([each.rotation_sd[1] for each in own])))
    if sds := [result.trajectories[name].poses(times).sd for name, times in _looked_at(block).items()]:
        sd = np.concatenate(sds)
        found.append(_quality("position of trajectories", linear, sd[:, :3]))
        found.append(_quality("rotation of trajectories", "rad", sd[:, 3:]))
    return found


def _quality(unknown: str, unit: str, sd: Floats) -> MotionQuality:
    return MotionQuality(unknown, unit, math.sqrt((sd**2).mean()), float(sd.max()))


def _looked_at(block: Block) -> dict[str, Floats]:
    """Return the times at which the trajectories that photos share are looked at, by their names."""
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    order = np.argsort(block.image_photos, kind="stable")
    bounds = np.searchsorted(block.image_photos[order], np.arange(len(rows) + 1))
    spans: dict[str, tuple[float, float]] = {}
    for each in block.timed:
        row = rows[each.photo]
        own = order[bounds[row] : bounds[row + 1]]
        if each.trajectory is None or not len(own):
            continue
        time, since, _ = each.images(block.image_xy[own])
        scale = 1.0 if each.readout is None else float(each.readout.position[0])
        times = time + scale * since
        first, last = spans.get(each.trajectory.name, (math.inf, -math.inf))
        spans[each.trajectory.name] = min(first, float(times.min())), max(last, float(times.max()))
    return {name: np.linspace(*span, PLACES) for name, span in spans.items()}


def photo_redundancy(result: Result) -> Floats:
    """(P, 6) redundancy numbers of what is given of positions and attitudes, of photos that move too."""
    moving = {each.photo for each in result.block.timed if each.trajectory is None}
    found = result.photo_redundancy.copy()
    for row, name in enumerate(result.block.photo_ids):
        if name in moving:
            own = result.trajectories[name]
            found[row] = [*own.position_redundancy[0], *own.rotation_redundancy[0]]
    return found


def with_known_readout(block: Block) -> Block | None:
    """Return a block whose readout times are known; None where all of them are."""
    known: dict[int, Readout] = {}
    timed = []
    for each in block.timed:
        own = each.readout
        if each.shutter is not None and own is not None and not own.is_held:
            readout = known.setdefault(id(own), Readout(own.name, own.value, 0.0))
            each = replace(each, shutter=replace(each.shutter, readout=readout))
        timed.append(each)
    return block.replace(timed=timed) if known else None


Triple = tuple[float, float, float]

_CLASSES = (
    ("2 rays", 2, 2),
    ("3 rays", 3, 3),
    ("4 rays", 4, 4),
    ("5 rays", 5, 5),
    ("6 rays", 6, 6),
    ("7 to 9 rays", 7, 9),
    ("10 and more", 10, math.inf),
)
"""Classes of points: the least and the largest number of photos that show them."""


@dataclass(frozen=True)
class PointQuality:
    """What a group of new points promises.

    Attributes
    ----------
    grouping, group
        `rays`, `location` or `all`, and the name of the group.
    points
        Their number.
    rms_sd, max_sd
        Root mean square and largest of their expected standard deviations in the three coordinates, linear
        unit.
    redundancy
        Mean redundancy number of their image coordinates.
    unchecked
        Share of image coordinates with less redundancy than 0.01: gross errors there cannot be found.
    detectable
        Minimal detectable error of the other image coordinates, millimetres: the median; NaN for none.
    effect
        What such an error moves at most when it stays in, in standard deviations: the median; NaN for none.
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
class PhotoQuality:
    """What the photos promise in one unknown.

    Attributes
    ----------
    unknown
        Its name.
    rms_sd, max_sd
        Root mean square and largest of the expected standard deviations: linear unit, radians for angles.
    redundancy
        Mean redundancy number of the given values as observations; NaN where none is weighted.
    """

    unknown: str
    rms_sd: float
    max_sd: float
    redundancy: float


@dataclass(frozen=True)
class ControlQuality:
    """How control is checked in one component.

    Attributes
    ----------
    component
        Its name.
    held
        How many control points hold it.
    sd
        Root mean square of its a priori standard deviations, linear unit.
    redundancy
        Mean redundancy number of those that are weighted (not fixed); NaN for none.
    detectable
        Minimal detectable error, linear unit: the median; NaN for none.
    effect
        What such an error moves at most when it stays in, in standard deviations: the median; NaN for none.
    """

    component: str
    held: int
    sd: float
    redundancy: float
    detectable: float
    effect: float


def point_quality(
    result: Result, point_sd: Floats, locations: NDArray[np.str_], new: Bools
) -> list[PointQuality]:
    """Return the quality of new points by number of rays, by location, and of all; groups without points too.

    Standard deviations are (n, 3) in the linear unit, locations (n,) of `LOCATIONS`; `new` (n,) are the
    points to be judged.
    """
    rays = result.point_rays
    groups = [("rays", name, (rays >= low) & (rays <= high)) for name, low, high in _CLASSES]
    groups += [("location", name, locations == name) for name in LOCATIONS]
    groups.append(("all", "all", np.ones(len(rays), dtype=np.bool_)))
    return [_group(result, point_sd, grouping, name, new & chosen) for grouping, name, chosen in groups]


def _group(result: Result, point_sd: Floats, grouping: str, group: str, chosen: Bools) -> PointQuality:
    images = chosen[result.block.image_points]
    redundancy = result.redundancy[images]
    checked = redundancy >= TESTABLE
    detectable = minimal_detectable_error(result.block.image_sd[images], redundancy)
    return PointQuality(
        grouping=grouping,
        group=group,
        points=int(chosen.sum()),
        rms_sd=cast("Triple", tuple(_rms(column) for column in point_sd[chosen].T)),
        max_sd=cast("Triple", tuple(_largest(column) for column in point_sd[chosen].T)),
        redundancy=_mean(redundancy),
        unchecked=1 - _mean(checked.astype(np.float64)),
        detectable=_median(detectable[checked]),
        effect=_median(largest_effect(redundancy[checked])),
    )


def photo_quality(result: Result, photo_sd: Floats, axes: tuple[str, str, str]) -> list[PhotoQuality]:
    """Return the quality of the photos in each unknown; `photo_sd` is (P, 6), linear unit and radians."""
    given_sd = np.hstack([result.block.photo_position_sd, result.block.photo_attitude_sd])
    weighted = np.isfinite(given_sd) & (given_sd > 0)
    redundancy = photo_redundancy(result)
    return [
        PhotoQuality(
            unknown=name,
            rms_sd=_rms(photo_sd[:, k]),
            max_sd=_largest(photo_sd[:, k]),
            redundancy=_mean(redundancy[weighted[:, k], k]),
        )
        for k, name in enumerate((*axes, "omega", "phi", "kappa"))
    ]


def control_quality(result: Result, control_sd: Floats, axes: tuple[str, str, str]) -> list[ControlQuality]:
    """Return how control is checked in each component; `control_sd` is (n, 3), linear unit."""
    qualities = []
    for k, name in enumerate(axes):
        held = result.used_points & np.isfinite(control_sd[:, k])
        weighted = held & (control_sd[:, k] > 0)
        redundancy = result.point_redundancy[weighted, k]
        qualities.append(
            ControlQuality(
                component=name,
                held=int(held.sum()),
                sd=_rms(control_sd[held, k]),
                redundancy=_mean(redundancy),
                detectable=_median(minimal_detectable_error(control_sd[weighted, k], redundancy)),
                effect=_median(largest_effect(redundancy)),
            )
        )
    return qualities


def _rms(values: Floats) -> float:
    return math.sqrt(_mean(values**2))


def _largest(values: Floats) -> float:
    return float(values.max()) if values.size else math.nan


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else math.nan


def _median(values: Floats) -> float:
    return float(np.median(values)) if values.size else math.nan
