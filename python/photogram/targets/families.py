"""Which lens shows boards as they are: trial families and fields of view, without any start value."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.targets.homographies import (
    angles_apart,
    focal_lengths,
    homographies,
    poses,
    ray_homographies,
)
from photogram.targets.sightings import Sightings
from photogram.targets.small_block import Adjusted, adjusted_views

__all__ = ["POOR", "Trial", "adjusted_family", "misfits", "perspective", "rays_of", "trials", "wide"]

FIELDS = np.linspace(60.0, 200.0, 15)
"""Degrees of horizontal field that are tried; then what is between them is halved."""
ENOUGH = 24
"""Pictures that fields are tried by, at the most."""
FINEST = 0.5
"""Degrees of field to which the best is found."""
RIVALS = 1.5
"""Families whose misfits differ by a smaller factor are adjusted, each."""
POOR = 5.0
"""A view that fits so many times worse than the median view does not fit."""
NO_FOCUS = 1.2
"""Focal length over the width of the picture, where nothing says it."""

FAMILIES: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {"fisheye": lambda field: 1 / field, "stereographic": lambda field: 1 / (4 * math.tan(field / 4))}
)
"""Wide families: focal length over the width of the picture, of the horizontal field (rad)."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A lens that was tried.

    Attributes
    ----------
    camera
        Its focal length and principal point, free.
    orders
        (P,) in which order the corners of each picture fit best.
    misfits
        (P,) median angles (rad) between rays and the board in each.
    """

    camera: Camera
    orders: Indices
    misfits: Floats

    @property
    def angle(self) -> float:
        """Median over the pictures, radians."""
        return float(np.median(self.misfits))

    @property
    def pixels(self) -> float:
        """The same near the axis, pixels: what families are compared by."""
        return self.angle * self.camera.scale


def rays_of(camera: Camera, xy: Floats) -> Floats:
    """Return (P, n, 3) rays, axes of vision, of (P, n, 2) pixels; NaN where there are none."""
    found: Floats = (camera.rays(xy.reshape(-1, 2)) * [1.0, -1.0, -1.0]).reshape(*xy.shape[:2], 3)
    return found


def misfits(seen: Sightings, rays: Floats) -> Floats:
    """Return (P,) the median angle (rad) between the rays of each picture and those of the board."""
    found = ray_homographies(seen.coordinates, rays)
    return np.asarray(np.nanmedian(angles_apart(seen.coordinates, rays, found), axis=1))


def _tried(seen: Sightings, camera: Camera) -> Trial:
    """Return how a lens fits, each picture in the order that fits best; one without rays does not."""
    own = []
    for order in seen.listings.shapes:
        listed = seen.listed(np.full(len(seen.xy), order))
        rays = rays_of(camera, listed.xy)
        if np.isnan(rays[np.isfinite(listed.xy).all(axis=2)]).any():
            return Trial(camera, np.zeros(len(seen.xy), dtype=np.int64), np.full(len(seen.xy), np.inf))
        own.append(misfits(listed, rays))
    best = np.argmin(own, axis=0)
    return Trial(camera, np.array(seen.listings.shapes)[best], np.min(own, axis=0))


def _camera(family: str, fx: float, fy: float, size: tuple[int, int]) -> Camera:
    parameters = {"fx": fx, "fy": fy, "cx": (size[0] - 1) / 2, "cy": (size[1] - 1) / 2}
    return Camera(family, parameters, dict.fromkeys(parameters, math.inf), unit="px")


def perspective(seen: Sightings, size: tuple[int, int]) -> Trial:
    """Return the perspective lens of the homographies of pixels; of 1.2 widths where these say nothing."""
    first = _tried(seen, _camera("pinhole", size[0], size[0], size))
    found = homographies(seen.coordinates, seen.listed(first.orders).xy)
    fx, fy, f = focal_lengths(found, (np.array(size) - 1) / 2)
    if not (fx > 0 and fy > 0):
        fx = fy = f if f > 0 else NO_FOCUS * size[0]
    return _tried(seen, _camera("pinhole", fx, fy, size))


def wide(seen: Sightings, size: tuple[int, int], family: str) -> Trial:
    """Return the lens of a wide family that fits best: fields of 60 to 200 degrees, then halved."""

    def tried(field: float) -> Trial:
        f = FAMILIES[family](math.radians(field)) * size[0]
        return _tried(seen, _camera(family, f, f, size))

    fields: dict[float, Trial] = {field: tried(field) for field in FIELDS.tolist()}
    step = float(FIELDS[1] - FIELDS[0])
    while step > FINEST:
        step /= 2
        best = min(fields, key=lambda field: fields[field].angle)
        fields |= {field: tried(field) for field in (best - step, best + step)}
    return min(fields.values(), key=lambda trial: trial.angle)


def trials(seen: Sightings, size: tuple[int, int]) -> list[Trial]:
    """Return the families that fit, the best first: those within a factor of it."""
    some = seen.of(np.arange(0, len(seen.xy), math.ceil(len(seen.xy) / ENOUGH)))
    few = [perspective(some, size), *(wide(some, size, family) for family in FAMILIES)]
    found = [_tried(seen, trial.camera) for trial in few]
    found.sort(key=lambda trial: trial.pixels)
    return [trial for trial in found if trial.pixels <= RIVALS * found[0].pixels]


def adjusted_family(seen: Sightings, found: list[Trial]) -> tuple[Trial, Adjusted | None]:
    """Return the family whose adjustment ends lowest, by the views that fit; the best, if none can be."""
    ended = []
    for trial in found:
        fit = trial.misfits <= POOR * trial.angle
        own = seen.of(fit).listed(trial.orders[fit])
        start = poses(ray_homographies(own.coordinates, rays_of(trial.camera, own.xy)))
        adjusted = adjusted_views(trial.camera, own, start)
        if adjusted is not None:
            ended.append((trial, adjusted))
    if not ended:
        return found[0], None
    return min(ended, key=lambda each: each[1].variance)
