"""A lens of another model that shows what a given camera shows: least squares over pixels of its image."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import shown
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.messages import nearest
from photogram.network.cameras import Camera

__all__ = ["LENS_TERMS", "fitted", "grid_of_pixels", "is_perspective", "lens_of"]

LENS_TERMS: Mapping[str, int] = MappingProxyType({"opencv4": 4, "opencv5": 5, "opencv8": 8, "opencv12": 12})
"""Names for `opencv_pinhole` with so many of its lens terms free."""
GRID = (60, 40)
"""Columns and rows of the pixels that a fit compares."""
NEARLY_ACROSS = math.cos(math.radians(89.0))
"""Rays further from the axis have no image in a perspective camera."""
_FIRST = frozenset({"f", "fx", "fy", "cx", "cy"})
_STAGES = (frozenset({"k", "k0", "k1"}), frozenset({"k2"}), frozenset({"p0", "p1", "p2"}))
"""Terms in the order in which they are freed, after these; the rest follow together."""
_STARTS = (("alpha", 0.5), ("beta", 1.0), ("omega", 0.5))
"""Where terms begin that say nothing at 0."""
STEPS, CLOSE = 100, 1e-10
"""Steps of a fit at the most, and the relative fall of the sum of squares with which it ends."""


def grid_of_pixels(size: tuple[int, int], radius: float = math.inf) -> Floats:
    """Return (m, 2) pixels over a picture, the outermost included, within a radius of its middle."""
    last = np.array(size, dtype=np.float64) - 1
    columns, rows = (np.linspace(0, end, count) for end, count in zip(last, GRID, strict=True))
    found = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    kept: Floats = found[np.hypot(*(found - last / 2).T) <= radius]
    return kept


def is_perspective(camera: Camera) -> bool:
    """Return whether a camera sees nothing beside and behind the plane of its projection centre."""
    # Through a perspective camera what is behind comes out on the other side, or not at all.
    column = camera.project(np.array([[1.0, 0.0, 0.01]]))[0, 0]
    return not column > camera.parameters["cx"]


def lens_of(model: str, source: Camera, size: tuple[int, int]) -> Camera:
    """Return a camera of a model with focal length and principal point of another, and no distortion.

    Parameters
    ----------
    model
        A model of `docs/cameras.md`, or a name of `LENS_TERMS`; its terms are free.
    source
        The camera that focal length, principal point, name and unit are taken from.
    size
        Width and height of its pictures, pixels.

    Raises
    ------
    InputError
        A model that there is not, or one that counts no columns and rows of pixels.
    """
    own, count = ("opencv_pinhole", LENS_TERMS[model]) if model in LENS_TERMS else (model, None)
    models = dict(_photocore.camera_models())
    if own not in models:
        raise InputError(f"model: there is no lens {shown(model)}{nearest(model, [*LENS_TERMS, *models])}")
    names = [name for name, _ in models[own][1]]
    constants = {*names[len(names) - models[own][2] :]} - {"w", "h"}
    if not ({"f", "fx"} & {*names} and "cx" in names) or constants:
        raise InputError(
            f"model: {model} has no focal length and principal point in pixels to begin with"
            + "".join(f", and a constant {each} that nothing says" for each in sorted(constants))
        )
    given = source.parameters
    fx, fy = given.get("fx", given.get("f")), given.get("fy", given.get("f"))
    start = {"f": fx, "fx": fx, "fy": fy, "w": size[0], "h": size[1]} | dict(_STARTS)
    start |= _principal_point(source, "w" in names, size)
    free = {*names} - {"w", "h"}
    if count is not None:
        free = {*names[: 4 + count]}
    return Camera(
        own,
        {name: value for name, value in start.items() if name in names and value is not None},
        {name: math.inf for name in names if name in free},
        name=source.name,
        unit="px",
    )


def _principal_point(source: Camera, from_middle: bool, size: tuple[int, int]) -> dict[str, float]:
    """Return cx and cy as a model counts them: from the first pixel, or from the middle of w by h."""
    shift = [0.0, 0.0]
    for on, sign in (("w" in source.names, 1), (from_middle, -1)):
        if on:
            shift = [own + sign * side / 2 for own, side in zip(shift, size, strict=True)]
    return {name: source.parameters[name] + own for name, own in zip(("cx", "cy"), shift, strict=True)}


def fitted(
    source: Camera,
    model: str,
    size: tuple[int, int],
    held: Collection[str] = (),
    *,
    radius: float = math.inf,
) -> Camera:
    """Return the camera of another model that shows the rays of a camera where this shows them.

    The sum of squares of what both images of a ray are apart, over 60 x 40 pixels of the source, is made
    least: first by focal length and principal point, then with the terms of the lens in the order k1, k2, p,
    all others.

    Parameters
    ----------
    source
        The camera; what of its image has no ray does not count.
    model
        A model of `docs/cameras.md`, or `opencv4`, `opencv5`, `opencv8`, `opencv12`.
    size
        Width and height of the pictures, pixels.
    held
        Parameters that stay: focal length and principal point those of the source, terms of the lens 0.
    radius
        Pixels farther from the middle of the picture do not count.

    Returns
    -------
    The camera; what was fitted is free in it.

    Raises
    ------
    InputError
        A model that there is not, terms that it has not, or nothing of the picture that it can show.
    """
    start = lens_of(model, source, size)
    if unknown := sorted({*held} - {*start.names}):
        raise InputError(f"held: {start.model} has no {', '.join(unknown)}, but {', '.join(start.names)}")
    xy = grid_of_pixels(size, radius)
    rays = source.rays(xy)
    there = np.isfinite(rays).all(axis=1)
    if is_perspective(start):
        there &= -rays[:, 2] > NEARLY_ACROSS
    fit = _Fit(start.model, rays[there], xy[there])
    free = [name for name in start.names if start.deviations[start.names.index(name)] and name not in held]
    if 2 * len(fit.xy) < len(free):
        raise InputError(f"model: {model} shows nothing of what the camera {source.title} shows")
    values = start.values
    for stage in _stages(free):
        values = fit.least(values, [start.names.index(name) for name in stage])
    return start.replace(
        parameters=dict(zip(start.names, values.tolist(), strict=True)),
        sd=dict.fromkeys(free, math.inf),
    )


def _stages(free: list[str]) -> list[list[str]]:
    """Return what is free in each fit: more and more of it."""
    allowed = set(_FIRST)
    found = []
    for more in ({*()}, *_STAGES, {*free}):
        allowed |= more
        own = [name for name in free if name in allowed]
        if own and own not in found:
            found.append(own)
    return found


@dataclass(frozen=True, eq=False)
class _Fit:
    """What a lens of a model is to show: (m, 3) rays at (m, 2) pixels."""

    model: str
    rays: Floats
    xy: Floats

    def least(self, values: Floats, free: list[int]) -> Floats:
        """Return parameters with the least sum of squares, of free ones (Levenberg-Marquardt)."""
        cost, rows, misses = self._linearized(values, free)
        damping = 1e-6
        for _ in range(STEPS):
            scale = np.linalg.norm(rows, axis=0)
            scale[scale == 0] = 1.0
            normal = (rows / scale).T @ (rows / scale)
            right = (rows / scale).T @ misses
            trial = values.copy()
            damped = normal + damping * np.eye(len(free))
            trial[free] += np.linalg.lstsq(damped, right, rcond=None)[0] / scale
            found, *others = self._linearized(trial, free)
            if not found < cost:
                damping *= 10
                if damping > 1e8:
                    break
                continue
            fall, values, cost, (rows, misses) = cost - found, trial, found, others
            damping = max(damping / 10, 1e-14)
            if fall <= CLOSE * cost:
                break
        return values

    def _linearized(self, values: Floats, free: list[int]) -> tuple[float, Floats, Floats]:
        """Return the sum of squares, infinite where an image is missing, partials and what is missed."""
        images, _, by_values = _photocore.camera_partials(self.model, values, self.rays)
        misses = (self.xy - images).reshape(-1)
        cost = float(misses @ misses)
        rows = by_values.reshape(len(misses), -1)[:, free]
        if not (math.isfinite(cost) and np.isfinite(rows).all()):
            cost = math.inf
        return cost, rows, misses
