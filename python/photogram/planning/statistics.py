"""The figures of a plan: standard deviations and reliability of groups of points, photos and control."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.planning.locations import LOCATIONS
from photogram.planning.motion import photo_redundancy
from photogram.results.result import Result
from photogram.statistics.reliability import TESTABLE, largest_effect, minimal_detectable_error

__all__ = [
    "ControlQuality",
    "PhotoQuality",
    "PointQuality",
    "control_quality",
    "photo_quality",
    "point_quality",
]

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

    Parameters
    ----------
    result
        The predicted block.
    point_sd
        (n, 3) standard deviations, linear unit.
    locations
        (n,) one of `LOCATIONS` each.
    new
        (n,) the points to be judged.
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
        rms_sd=_triple([_rms(column) for column in point_sd[chosen].T]),
        max_sd=_triple([_largest(column) for column in point_sd[chosen].T]),
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


def _triple(values: list[float]) -> Triple:
    x, y, z = values
    return x, y, z


def _rms(values: Floats) -> float:
    return math.sqrt(_mean(values**2))


def _largest(values: Floats) -> float:
    return float(values.max()) if values.size else math.nan


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else math.nan


def _median(values: Floats) -> float:
    return float(np.median(values)) if values.size else math.nan
