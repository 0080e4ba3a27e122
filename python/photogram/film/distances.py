"""Coordinates of fiducial marks from distances, by plane least squares, and their datum.

Observations are distances s = |q_j - q_i| and optional angles and intersections of lines through opposite
marks. If these determine the shape, the network is free: inner constraints choose the solution nearest to the
design, and cofactors are the pseudo-inverse. Otherwise, design coordinates are additional observations.

Blocks adjust image points and do not support angles between lines. This is a dense fit of some tens of
unknowns (`photogram.statistics.fits`), iterated to convergence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.fits import Fit
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import phrase

Points = NDArray[Any]  # real coordinates, or complex ones for partials

MAX_STEPS = 50
CONVERGED = 1e-13  # relative to the format
COMPLEX_STEP = 1e-30  # mm; its square vanishes beside coordinates
DETERMINED = 1e-6  # least singular value of a determined movement, relative to the largest


@dataclass(frozen=True)
class MarkDistance:
    """A calibrated distance.

    Attributes
    ----------
    first, second
        Names of the marks.
    length, sd
        Distance and its standard deviation, mm.
    """

    first: str
    second: str
    length: float
    sd: float

    @property
    def name(self) -> str:
        """Name in certificates: `ml-mr`."""
        return f"{self.first}-{self.second}"


@dataclass(frozen=True)
class RightAngle:
    """Angle from line first-second to line third-fourth (rad, counter-clockwise)."""

    marks: tuple[str, str, str, str]
    sd: float
    angle: float = math.pi / 2


@dataclass(frozen=True)
class Crossing:
    """Intersection of two lines through two marks each (mm), with one coordinate sd."""

    marks: tuple[str, str, str, str]
    sd: float
    place: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class AdjustedMarks:
    """Adjusted coordinates of n marks, their covariance and tests of r observations.

    Attributes
    ----------
    names
        Names of the marks.
    xy
        (n, 2) mm.
    covariance
        (2n, 2n) mm^2 for a priori unit weight, ordered x, y per mark. A free network has rank 2n minus its
        datum defect.
    free
        Datum defect, removed by inner constraints on the design.
    rows
        Names of the observations: `ml-mr`, `angle ..`, `crossing .. x`, `ll.x` for design coordinates.
    observed, sd, residuals
        (r,) mm, angles in radians. Residuals are observed minus computed.
    redundancy, standardized
        (r,) redundancy numbers and Baarda's w.
    test
        The global test; None without degrees of freedom.
    """

    names: tuple[str, ...]
    xy: Floats
    covariance: Floats
    free: int
    rows: tuple[str, ...]
    observed: Floats
    sd: Floats
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    test: GlobalTest | None

    @property
    def degrees_of_freedom(self) -> int:
        """Rows minus unknowns plus datum defect."""
        return len(self.rows) - self.xy.size + self.free


@dataclass(frozen=True)
class _Row:
    """Observation; `at` returns its values at coordinates (..., n, 2), which may be complex."""

    name: str
    observed: float
    sd: float
    at: Callable[[Points], Points]


def adjust_distances(
    names: Sequence[str],
    design: Floats,
    distances: Sequence[MarkDistance],
    *,
    design_sd: Floats,
    conditions: Sequence[RightAngle | Crossing] = (),
) -> AdjustedMarks:
    """Adjust distances between fiducial marks.

    Parameters
    ----------
    names
        Names of the marks.
    design
        (n, 2) nominal coordinates, mm.
    distances, conditions
        Calibrated distances, and optional angles and intersections.
    design_sd
        (n,) standard deviations of nominal coordinates, mm. They are observations if the distances do not
        determine the shape.

    Raises
    ------
    AdjustmentError
        If the iteration does not converge because design and distances belong to different marks.
    """
    rows = _observed(names, distances, conditions)
    open_ = _open(_linearized(rows, design)[1], design)
    if open_ is None:
        for k, (name, sd) in enumerate(zip(names, design_sd.tolist(), strict=True)):
            rows += _of_axes(f"{name}.", design[k].tolist(), sd, lambda xy, k=k: xy[..., k, :])  # type: ignore[misc]
        open_ = np.zeros((design.size, 0))
    xy, fit, within = _adjusted(rows, design, free=open_.shape[1] > 0)
    freedom = len(rows) - xy.size + open_.shape[1]
    return AdjustedMarks(
        names=tuple(names),
        xy=xy,
        covariance=within @ fit.cofactors @ within.T,
        free=open_.shape[1],
        rows=tuple(each.name for each in rows),
        observed=np.array([each.observed for each in rows]),
        sd=np.array([each.sd for each in rows]),
        residuals=fit.residuals,
        redundancy=fit.redundancy,
        standardized=fit.standardized,
        test=global_test(fit.omega, freedom) if freedom else None,
    )


def _adjusted(rows: Sequence[_Row], design: Floats, *, free: bool) -> tuple[Floats, Fit, Floats]:
    """Return coordinates, the last fit, and the directions (2n, u) of its parameters."""
    xy = design.astype(float)
    variances = np.diag([each.sd**2 for each in rows])
    for _ in range(MAX_STEPS):
        computed, partials = _linearized(rows, xy)
        left = _open(partials, xy) if free else np.zeros((xy.size, 0))
        if left is None:
            break
        within = np.linalg.qr(left, mode="complete")[0][:, left.shape[1] :]
        fit = Fit.of(np.array([each.observed for each in rows]) - computed, variances, partials @ within)
        # Unobserved movements bring the network as near to the design as possible.
        step = within @ fit.parameters + left @ (left.T @ (design - xy).ravel())
        xy = xy + step.reshape(-1, 2)
        if np.abs(step).max() < CONVERGED * np.abs(design).max():
            return xy, fit, within
        if not np.isfinite(xy).all():
            break
    raise AdjustmentError(phrase("films.distances-not-converged"))


def _linearized(rows: Sequence[_Row], xy: Floats) -> tuple[Floats, Floats]:
    """Return (r,) computed values and their partials (r, 2n), by steps in the complex plane."""
    moved = xy + 1j * COMPLEX_STEP * np.eye(xy.size).reshape(xy.size, *xy.shape)
    found = np.array([each.at(moved) for each in rows])
    return found[:, 0].real, found.imag / COMPLEX_STEP


def _open(partials: Floats, xy: Floats) -> Floats | None:
    """Return an orthonormal basis (2n, d) of the datum defect; None if rank-deficient."""
    n, whole = len(xy), _movements(xy)
    seen, size = np.linalg.svd(partials @ whole, full_matrices=True)[2], _sizes(partials @ whole, 3)
    largest = np.linalg.norm(partials, ord=2)
    left = whole @ seen[size < DETERMINED * largest].T
    rank = int((_sizes(partials, 2 * n) > DETERMINED * largest).sum())
    return left if rank == 2 * n - left.shape[1] else None


def _sizes(matrix: Floats, count: int) -> Floats:
    """Return `count` singular values, padded with zeros."""
    found = np.linalg.svd(matrix, compute_uv=False)
    return np.concatenate([found, np.zeros(count - len(found))])


def _observed(
    names: Sequence[str], distances: Sequence[MarkDistance], conditions: Sequence[RightAngle | Crossing]
) -> list[_Row]:
    of = {name: row for row, name in enumerate(names)}
    rows = [
        _Row(each.name, each.length, each.sd, partial(_distance, of[each.first], of[each.second]))
        for each in distances
    ]
    for each in conditions:
        marks = [of[name] for name in each.marks]
        first, second = (f"{each.marks[row]}-{each.marks[row + 1]}" for row in (0, 2))
        if isinstance(each, RightAngle):
            name = f"angle {first} to {second}"
            rows.append(_Row(name, each.angle, each.sd, partial(_angle, marks)))
        else:
            name = f"crossing {first} with {second} "
            rows += _of_axes(name, each.place, each.sd, partial(_crossing, marks))
    return rows


def _of_axes(name: str, observed: Sequence[float], sd: float, at: Callable[[Points], Points]) -> list[_Row]:
    return [
        _Row(name + letter, observed[axis], sd, lambda xy, axis=axis: at(xy)[..., axis])  # type: ignore[misc]
        for axis, letter in enumerate("xy")
    ]


def _distance(i: int, j: int, xy: Points) -> Points:
    return np.asarray(np.sqrt(((xy[..., j, :] - xy[..., i, :]) ** 2).sum(axis=-1)))


def _angle(marks: Sequence[int], xy: Points) -> Points:
    i, j, k, m = marks
    a, b = xy[..., j, :] - xy[..., i, :], xy[..., m, :] - xy[..., k, :]
    cosine, sine = (a * b).sum(axis=-1), _cross(a, b)
    turn, change = (part(cosine) + 1j * part(sine) for part in (np.real, np.imag))
    return np.asarray(np.angle(turn) + 1j * (change / turn).imag)


def _crossing(marks: Sequence[int], xy: Points) -> Points:
    i, j, k, m = marks
    a, b, apart = xy[..., j, :] - xy[..., i, :], xy[..., m, :] - xy[..., k, :], xy[..., k, :] - xy[..., i, :]
    return np.asarray(xy[..., i, :] + (_cross(apart, b) / _cross(a, b))[..., np.newaxis] * a)


def _cross(a: Points, b: Points) -> Points:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


SINGULAR = 1e-9  # Least non-zero eigenvalue of a covariance, relative to the largest
HELD = 1e-2  # Standard deviation of the datum relative to the least one of the shape


def with_datum(xy: Floats, covariance: Floats) -> tuple[Floats, int]:
    """Return a regular covariance of marks, and the number of constrained movements.

    A network of distances has zero covariance of shifts and rotation, G: C G = 0. Its marks define the datum:
    C + s^2 G G' with a small s. The film placement, the principal point and kappa absorb shift and rotation:
    only the variance of the principal point depends on s, by s^2/n.

    Coordinates are (n, 2) mm, their covariance (2n, 2n) mm^2, ordered x, y per mark. InputError: if the
    covariance is singular for another reason.
    """
    values, vectors = np.linalg.eigh(covariance)
    free = values < SINGULAR * values[-1]
    count = int(free.sum())
    if not count:
        return covariance, 0
    movements = _movements(xy)
    outside = vectors[:, free] - movements @ (movements.T @ vectors[:, free])
    if count > 3 or np.abs(outside).max() > np.sqrt(SINGULAR):
        raise InputError(phrase("films.singular-marks"))
    own = vectors[:, free]
    return covariance + HELD**2 * values[~free].min() * (own @ own.T), count


def _movements(xy: Floats) -> Floats:
    """Return an orthonormal basis (2n, 3) of shifts and the rotation of n marks."""
    shift = np.tile(np.eye(2), (len(xy), 1))
    about = xy - xy.mean(axis=0)
    turn = np.column_stack([-about[:, 1], about[:, 0]]).reshape(-1, 1)
    return np.linalg.qr(np.hstack([shift, turn]))[0]
