"""Least-squares fit of another lens model to the projections of a camera, over pixels.

The motion of its axes may be fitted with it, or alone for the comparison of two cameras.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import compress
from types import MappingProxyType
from typing import Literal, Self

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import unknown_name
from photogram.network.cameras import Camera
from photogram.network.passages import KNOTTED
from photogram.targets.sightings import nearest_rotations
from photogram.targets.uncertainty import image_grid
from photogram.targets.vision import (
    TURNED,
    imaged,
    motion_partials,
    moved_by,
    names_of,
    points_at,
    rays,
    transformed,
    unknown_of,
    values_of,
)
from photogram.words import phrase

MAX_STEPS, TOLERANCE, SPLINE_TOLERANCE = 100, 1e-10, 1e-6  # relative decrease of the sum of squares
MIN_DAMPING, FIRST_DAMPING, MAX_DAMPING = 1e-14, 1e-6, 1e8
MAX_UNKNOWNS_WITH_RANK = 100  # the rank is not tested for more unknowns
NO_MOTION = slice(0, 0)  # of the six parameters (dt, w)


@dataclass(frozen=True, eq=False)
class Moved:
    """Lens, and (4, 4) motion from the axes of another one to its own, in vision axes."""

    camera: Camera
    motion: Floats = field(default_factory=lambda: np.eye(4))

    def stepped(self, free: Sequence[int], moving: slice, step: Floats) -> Self:
        """Return the lens after a step of free parameters and of the motion."""
        values = values_of(self.camera).copy()
        values[free] += step[: len(free)]
        own = self.camera
        k = len(own.names)
        camera = own.replace(
            parameters=dict(zip(own.names, values[:k].tolist(), strict=True)),
            knots=None if own.knots is None else values[k:].reshape(own.knots.shape),
        )
        six = np.zeros(6)
        six[moving] = step[len(free) :]
        return type(self)(camera, moved_by(self.motion, six))


@dataclass(frozen=True, eq=False)
class Points:
    points: Floats  # (m, 3) in axes of the other lens; directions if the points are not finite
    xy: Floats  # (m, 2) pixels
    finite: bool = False  # whether the points are at finite distances
    roots: Floats | None = None  # (m, 2, 2) W with W'W the weights of pixels; None: equal weights

    def least(self, start: Moved, free: Sequence[int], moving: slice = NO_MOTION) -> Moved:
        """Return the least-squares lens from an initial one (Levenberg-Marquardt).

        `free` contains the numbers of free parameters, `moving` the free steps of the motion (dt, w), e.g.
        `slice(3, 6)` for rotations.
        """
        # Projections are linear in knots: one step finds them.
        at, damping, close = start, FIRST_DAMPING, TOLERANCE
        if len(free) > MAX_UNKNOWNS_WITH_RANK:
            damping, close = MIN_DAMPING, SPLINE_TOLERANCE
        cost, rows, misses = self.linearized(at, free, moving)
        for _ in range(MAX_STEPS):
            scale = np.linalg.norm(rows, axis=0)
            scale[scale == 0] = 1.0
            scaled = rows / scale
            normal, right = scaled.T @ scaled, scaled.T @ misses
            normal[np.diag_indices(len(normal))] += damping
            # Damping separates the many knots at the edge, which the data do not.
            many = len(normal) > MAX_UNKNOWNS_WITH_RANK
            found = np.linalg.solve(normal, right) if many else np.linalg.lstsq(normal, right, rcond=None)[0]
            step = found / scale
            trial = at.stepped(free, moving, step) if np.isfinite(step).all() else at
            lower, *others = self.linearized(trial, free, moving)
            if not lower < cost:
                damping *= 10
                if damping > MAX_DAMPING:
                    break
                continue
            fall, at, cost, (rows, misses) = cost - lower, trial, lower, others
            damping = max(damping / 10, MIN_DAMPING)
            if fall <= close * cost:
                break
        return at

    def linearized(self, at: Moved, free: Sequence[int], moving: slice) -> tuple[float, Floats, Floats]:
        """Return the sum of squares (infinite if undefined), partials and misfits."""
        images, by_point, by_values = self.imaged(at)
        by_motion = by_point @ motion_partials(transformed(at.motion, self.points), self.finite)[..., moving]
        partials = np.concatenate([by_values[..., free], by_motion], axis=2)
        misses = (self.xy - images)[:, :, np.newaxis]
        if self.roots is not None:
            partials, misses = self.roots @ partials, self.roots @ misses
        rows, apart = partials.reshape(2 * len(self.xy), -1), misses.reshape(-1)
        cost = float(apart @ apart)
        if not (math.isfinite(cost) and np.isfinite(rows).all()):
            cost = math.inf
        return cost, rows, apart

    def imaged(self, at: Moved) -> tuple[Floats, Floats, Floats]:
        """Return (m, 2) projections, partials by points (m, 2, 3) and values (m, 2, p)."""
        images, by_u, by_values = at.camera.partials(transformed(at.motion, self.points) * TURNED)
        return images, by_u * TURNED, by_values


# `opencv_pinhole` with this number of free lens terms
LENS_TERMS: Mapping[str, int] = MappingProxyType({"opencv4": 4, "opencv5": 5, "opencv8": 8, "opencv12": 12})
GRID = (60, 40)  # columns and rows of pixels
MIN_AXIS_COSINE = math.cos(math.radians(89.0))  # of rays with an image in a perspective camera
_FIRST = frozenset({"f", "fx", "fy", "cx", "cy"})
# Terms in the order of release, after focal lengths and principal point
_STAGES = (frozenset({"k", "k0", "k1", "r1"}), frozenset({"k2", "r2"}), frozenset({"p0", "p1", "p2"}))
_FIXED_TERMS = frozenset({"r0"})  # fx and fy have the same effect
_INITIAL_TERMS = (("alpha", 0.5), ("beta", 1.0), ("omega", 0.5))  # terms whose partials vanish at 0
KNOTS, ORDER = (30, 20), 3.0  # along columns and rows, and the order of a spline
FIELD_MARGIN = 1.1  # ratio of splined lens field and data field


def grid_of_pixels(size: tuple[int, int], radius: float = math.inf) -> Floats:
    """Return (m, 2) pixels over an image, to its edges, within a radius of its centre."""
    _, _, found = image_grid(size, GRID)
    return np.asarray(found[within(found, size, radius)])


def within(pixels: Floats, size: tuple[int, int], radius: float) -> Bools:
    """Return (m,) whether pixels are within a radius of the image centre."""
    return np.asarray(np.hypot(*(pixels - (np.array(size) - 1) / 2).T) <= radius)


def is_perspective(camera: Camera) -> bool:
    """Return whether a camera projects only points in front of its projection plane."""
    # A perspective camera projects rear points to the other side, or not at all.
    column = camera.project(np.array([[1.0, 0.0, 0.01]]))[0, 0]
    return not column > camera.parameters["cx"]


def lens_of(model: str, source: Camera, size: tuple[int, int], knots: tuple[int, int] = KNOTS) -> Camera:
    """Return an undistorted camera with focal length and principal point of another.

    The model is one of `docs/cameras.md`, or a name of `LENS_TERMS`. Its terms are free; for a splined model,
    the `knots` are free instead. The splined field covers all source pixels plus a tenth. Name and unit are
    copied from the source, `size` is the image width and height.
    """
    own, count = ("opencv_pinhole", LENS_TERMS[model]) if model in LENS_TERMS else (model, None)
    models = dict(_photocore.camera_models())
    if own not in models:
        raise InputError(unknown_name("lens model", model, [*LENS_TERMS, *models]))
    names = [name for name, _ in models[own][1]]
    splined = own == KNOTTED
    constants = {*()} if splined else {*names[len(names) - models[own][2] :]} - {"w", "h"}
    if not ({"f", "fx"} & {*names} and "cx" in names):
        raise InputError(phrase("targets.no-lens", model=model))
    if constants:
        raise InputError(phrase("targets.constants", model=model, names=sorted(constants)))
    given = source.parameters
    if "cx" not in given or not ({"f", "fx"} & {*given}):
        raise InputError(phrase("targets.no-focal", camera=source.title, model=source.model))
    fx, fy = given.get("fx", given.get("f", 0.0)), given.get("fy", given.get("f", 0.0))
    start = {"f": fx, "fx": fx, "fy": fy, "w": size[0], "h": size[1], **dict(_INITIAL_TERMS)}
    # cx and cy count from the first pixel, or in models with w and h from the image centre
    shifts = ("w" in source.names) - ("w" in names)
    start |= {"cx": given["cx"] + shifts * size[0] / 2, "cy": given["cy"] + shifts * size[1] / 2}
    free = {*names} - {"w", "h", *_FIXED_TERMS} if count is None else {*names[: 4 + count]}
    if splined:
        if min(knots) < ORDER + 1:
            raise InputError(phrase("targets.knots", order=ORDER, least=ORDER + 1, value=min(knots)))
        field = min(FIELD_MARGIN * field_of(source.rays(grid_of_pixels(size)), knots), 359.0)
        start |= {"order": ORDER, "nx": knots[0], "ny": knots[1], "fov_x_deg": field}
        free = set()
    return Camera(
        own,
        {name: value for name, value in start.items() if name in names},
        {name: math.inf for name in names if name in free},
        name=source.name,
        unit="px",
        knot_sd=math.inf if splined else None,
    )


def field_of(rays: Floats, knots: tuple[int, int], order: float = ORDER) -> float:
    """Return the fov_x_deg (degrees) of knots that cover (n, 3) rays in photo axes."""
    places = 2 * rays[:, :2] / (1 - rays[:, 2:])
    inner = np.array(knots) - order
    reach = float(np.nanmax(np.nanmax(np.abs(places), axis=0) * inner[0] / inner))
    return math.degrees(4 * math.atan(reach / 2))


def fitted(
    source: Camera,
    model: str,
    size: tuple[int, int],
    *,
    radius: float = math.inf,
    knots: tuple[int, int] = KNOTS,
) -> Camera:
    """Return a camera of another model fitted to the projections of a camera.

    The sum of squares of the differences is minimised over 60 x 40 source pixels, within `radius` of the
    image centre. Focal length and principal point are fitted first, then the lens terms in the order k1, k2,
    p, all others. `model` and `knots` are defined in :func:`lens_of`.
    """
    start = lens_of(model, source, size, knots)
    xy = grid_of_pixels(size, radius)
    shown = Points(rays(source, xy), xy)
    there = shows(start, shown.points)
    free = free_names(start)
    if 2 * np.count_nonzero(there) < len(free) and start.knots is None:
        raise InputError(phrase("targets.shows-nothing", model=model, camera=source.title))
    return fitted_in_stages(Moved(start), Points(shown.points[there], xy[there]), free).camera.replace(
        sd=dict.fromkeys([name for name in free if name in start.names], math.inf)
    )


def shows(camera: Camera, points: Floats) -> Bools:
    """Return (m,) whether a camera can project (m, 3) directions in vision axes."""
    there = np.isfinite(points).all(axis=1)
    if is_perspective(camera):
        there = there & (points[:, 2] > MIN_AXIS_COSINE * np.linalg.norm(points, axis=1))
    return np.asarray(there)


def free_names(camera: Camera) -> list[str]:
    """Return the free parameters of a camera, followed by its free knots."""
    return [*compress(names_of(camera), unknown_of(camera))]


def fitted_in_stages(start: Moved, points: Points, free: Sequence[str], moving: slice = NO_MOTION) -> Moved:
    """Fit a lens with a growing set of free parameters, and finally its motion."""
    at = start
    numbers = {name: k for k, name in enumerate(names_of(at.camera))}
    allowed, before = set(_FIRST), list[str]()
    for more in ({*()}, *_STAGES, {*free}):
        allowed |= more
        stage = [name for name in free if name in allowed]
        if stage != before:
            at, before = points.least(at, [numbers[name] for name in stage]), stage
    if moving != NO_MOTION:
        at = points.least(at, [numbers[name] for name in free], moving)
    return at


Criterion = Literal["pixels", "mrcal"]  # squares of pixel differences, or mrcal 2: fourth powers of angles

MOTION_STEPS = 200
MOTION_TOLERANCE = 1e-11  # relative to radians and the shortest distance
MIN_PIXELS = 10
HUBER_THETA_SQUARED = np.radians(5.0) ** 2  # the criterion of mrcal increases more slowly beyond


@dataclass(frozen=True, eq=False)
class Fitted:
    motion: Floats  # (4, 4) axes of camera a -> axes of camera b; without translation unless finite
    finite: bool  # whether the translation was fitted: all distances are finite


def fitted_motion(
    a: Camera,
    b: Camera,
    pixels: Floats,
    distances: Sequence[float],
    criterion: Criterion = "pixels",
    weights: Floats | None = None,
) -> Fitted:
    """Return the motion that minimises the differences at (n, 2) pixels of camera a.

    Pixels that are not visible in both are ignored. A translation is fitted if all distances are finite; with
    one distance it is arbitrary along the rays. Weights of each pixel are ordered by distance: (D n, 2, 2) W
    of pixel differences, or (D n,) w of the mrcal criterion. NaN excludes a pixel, None means equal weights.
    """
    finite = bool(np.isfinite(distances).all())
    towards = points_at(a, pixels, distances)
    aims, places = (np.concatenate([each] * len(distances)) for each in (rays(b, pixels), pixels))
    if weights is None:
        weights = np.tile(np.eye(2), (len(towards), 1, 1)) if criterion == "pixels" else np.ones(len(towards))
    numbers = np.column_stack([towards, aims, weights.reshape(len(towards), -1)])
    usable = np.isfinite(numbers).all(axis=1)
    if (count := int(np.count_nonzero(usable))) < MIN_PIXELS:
        raise InputError(phrase("targets.few-pixels", count=count, least=MIN_PIXELS))
    towards, aims, places, weights = towards[usable], aims[usable], places[usable], weights[usable]
    motion, free = np.eye(4), slice(0 if finite else 3, 6)
    unit = towards / np.linalg.norm(towards, axis=1)[:, np.newaxis]
    motion[:3, :3] = nearest_rotations((aims.T @ unit)[np.newaxis])[0]
    if criterion == "pixels":
        known = np.isfinite(imaged(b, transformed(motion, towards)).xy).all(axis=1)
        roots = np.linalg.cholesky(weights[known]).transpose(0, 2, 1)
        shown = Points(towards[known], places[known], finite, roots)
        return Fitted(shown.least(Moved(b, motion), [], free).motion, finite)
    for _ in range(MOTION_STEPS):
        moved = transformed(motion, towards)
        by_motion = motion_partials(moved, finite)[:, :, free]
        step = np.zeros(6)
        step[free] = np.linalg.solve(*_angle_step(moved, aims, weights**2, by_motion))
        motion = moved_by(motion, step)
        turn, shift = np.abs(step[3:]).max(), np.abs(step[:3]).max()
        if turn < MOTION_TOLERANCE and shift < MOTION_TOLERANCE * np.min(distances):
            break
    return Fitted(motion, finite)


def _angle_step(moved: Floats, aims: Floats, weights: Floats, by_motion: Floats) -> tuple[Floats, Floats]:
    """Return Newton's equations of sum w^2 rho(theta^4), theta^2 = |u - v|^2.

    For unit vectors u, v with e = theta^2 and D = du, the gradient of e^2 is 4 e D' (u - v). Its second
    derivatives are 8 (D' (u - v))^2 + 4 e D' D, without the curvature of u. Huber: beyond k, e^2 becomes 2 k
    |e| - k^2.
    """
    length = np.linalg.norm(moved, axis=1)
    unit = moved / length[:, np.newaxis]
    across = (np.eye(3) - unit[:, :, np.newaxis] * unit[:, np.newaxis]) / length[:, np.newaxis, np.newaxis]
    turned = across @ by_motion
    apart = unit - aims
    e = (apart**2).sum(axis=1)
    slope = np.einsum("nij,ni->nj", turned, apart)
    inside = e < HUBER_THETA_SQUARED
    level = weights * np.where(inside, e, HUBER_THETA_SQUARED)
    normal = 2 * np.einsum("n,ni,nj->ij", weights * inside, slope, slope)
    normal += np.einsum("n,nki,nkj->ij", level, turned, turned)
    return normal, -np.einsum("n,ni->i", level, slope)
