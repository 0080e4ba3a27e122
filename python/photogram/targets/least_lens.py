"""Least squares of a lens and of the motion of its axes: it is to image points where another lens has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Self

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.targets.housing import transformed
from photogram.targets.imaging import TURNED, motion_partials, values_of
from photogram.targets.vision import moved_by

__all__ = ["HELD", "Moved", "Points"]

STEPS, CLOSE, NEAR = 100, 1e-10, 1e-6
"""Steps of a fit at the most, and the relative fall of the sum of squares with which it ends; of knots."""
WEAKEST, FIRST, STRONGEST = 1e-14, 1e-6, 1e8
"""Damping of steps, relative to the normal equations: least, first, and the one with which a fit gives up."""
MANY = 100
"""Unknowns beyond which equations are solved without looking for their rank."""
HELD = slice(0, 0)
"""Of the six steps (dt, w) of a motion: none."""


@dataclass(frozen=True, eq=False)
class Moved:
    """A lens, and (4, 4) the motion from the axes of another one to its own, in vision axes."""

    camera: Camera
    motion: Floats = field(default_factory=lambda: np.eye(4))

    @property
    def names(self) -> tuple[str, ...]:
        """The p parameters of the lens, its knots behind."""
        return self.camera.names + self.camera.knot_names

    @property
    def values(self) -> Floats:
        """(p,) their values."""
        return values_of(self.camera)

    def stepped(self, free: Sequence[int], moving: slice, step: Floats) -> Self:
        """Return it after a step of free parameters and of the motion."""
        values = self.values.copy()
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
    """Points with the pixels where a lens is to image them.

    Attributes
    ----------
    points
        (m, 3) in axes of the other lens; directions where they are not finite.
    xy
        (m, 2) pixels.
    finite
        Whether the points are at finite distances.
    roots
        (m, 2, 2) W with W'W the weights of pixels; None: equal ones.
    """

    points: Floats
    xy: Floats
    finite: bool = False
    roots: Floats | None = None

    def least(self, start: Moved, free: Sequence[int], moving: slice = HELD) -> Moved:
        """Return what has the least sum of squares (Levenberg-Marquardt).

        Parameters
        ----------
        start
            Where it begins.
        free
            Numbers of the parameters that are free.
        moving
            Which of the six steps (dt, w) of the motion are: `slice(3, 6)` rotations.
        """
        # Images are linear in knots: one step finds them.
        at, damping, close = start, FIRST, CLOSE
        if len(free) > MANY:
            damping, close = WEAKEST, NEAR
        cost, rows, misses = self.linearized(at, free, moving)
        for _ in range(STEPS):
            step = _damped(rows, misses, damping)
            trial = at.stepped(free, moving, step) if np.isfinite(step).all() else at
            found, *others = self.linearized(trial, free, moving)
            if not found < cost:
                damping *= 10
                if damping > STRONGEST:
                    break
                continue
            fall, at, cost, (rows, misses) = cost - found, trial, found, others
            damping = max(damping / 10, WEAKEST)
            if fall <= close * cost:
                break
        return at

    def linearized(self, at: Moved, free: Sequence[int], moving: slice) -> tuple[float, Floats, Floats]:
        """Return the sum of squares, infinite where an image is missing, partials and what is missed."""
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
        """Return (m, 2) images, (m, 2, 3) partials by points in axes of the lens, (m, 2, p) by its values."""
        images, by_u, by_values = at.camera.partials(transformed(at.motion, self.points) * TURNED)
        return images, by_u * TURNED, by_values


def _damped(rows: Floats, misses: Floats, damping: float) -> Floats:
    """Return the step of damped normal equations, scaled to a diagonal of ones."""
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0] = 1.0
    scaled = rows / scale
    normal = scaled.T @ scaled
    normal[np.diag_indices(len(normal))] += damping
    right = scaled.T @ misses
    # Knots are many; damping keeps apart what the images of those at the edge do not.
    many = len(normal) > MANY
    found = np.linalg.solve(normal, right) if many else np.linalg.lstsq(normal, right, rcond=None)[0]
    return np.asarray(found / scale)
