"""Calibrated distances of fiducial marks: adjustment, datum, and comparison with coordinates.

Observations are distances s = |q_j - q_i| and optional angles and intersections of lines through opposite
marks. If these determine the shape, the network is free: inner constraints choose the solution nearest to the
design, and cofactors are the pseudo-inverse. Otherwise, design coordinates are additional observations.

Blocks adjust image points and do not support angles between lines. This is a dense fit of some tens of
unknowns (`photogram.statistics.fits`), iterated to convergence.

Certificates were transcribed by hand, often twice. If a distance contradicts coordinates, one transcription
error is tested in the distance and its four coordinates: neighbouring digits exchanged, the sign, one digit,
one digit lost or added. No value is changed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.statistics.fits import Fit
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import Phrase, phrase

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
    whole, limit = _movements(xy), DETERMINED * np.linalg.norm(partials, ord=2)
    seen = np.linalg.svd(partials @ whole, full_matrices=True)[2]
    left = whole @ seen[np.linalg.matrix_rank(partials @ whole, limit) :].T
    return left if np.linalg.matrix_rank(partials, limit) == xy.size - left.shape[1] else None


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


How = Literal["exchange", "sign", "digit", "lost or extra"]

LIMIT = 0.010  # Largest difference of a distance from its coordinates, millimetres
EXPLAINED = 0.0035  # Largest remaining difference if a change explains it, millimetres
SAME = 1e-9  # Tolerance for equal differences, millimetres
_LEADING_ZERO = re.compile(r"[-+]?0\d")


@dataclass(frozen=True)
class Explanation:
    """Single correction of a transcribed value that explains a difference.

    Attributes
    ----------
    field
        Coordinate `ml.x`, or distance `ml-mr`.
    typed, perhaps
        The transcribed value, and the probable original value.
    how
        `exchange` of neighbouring digits, `sign`, `digit`, `lost or extra`.
    remaining
        Remaining difference, mm.
    from_usual
        The corrected coordinate minus the usual one of the mark, mm; None if that is unknown.
    """

    field: str
    typed: str
    perhaps: str
    how: How
    remaining: float
    from_usual: float | None = None

    def __str__(self) -> str:
        return str(phrase("films.change", **vars(self)))


@dataclass(frozen=True)
class DistanceDifference:
    """Calibrated distance and the distance computed from the coordinates of its marks.

    Attributes
    ----------
    name
        Name of the distance, such as `ml-mr`.
    distance, from_coordinates
        Both distances, mm.
    explanations
        Single corrections that explain a difference beyond 0.010 mm, most probable first.
    """

    name: str
    distance: float
    from_coordinates: float
    explanations: tuple[Explanation, ...] = ()

    @property
    def difference(self) -> float:
        """Calibrated minus computed distance, mm."""
        return self.distance - self.from_coordinates

    @property
    def beyond(self) -> bool:
        """Whether the difference is larger than 0.010 mm."""
        return abs(self.difference) > LIMIT

    def __str__(self) -> str:
        return str(difference_message(self))


def difference_message(difference: DistanceDifference) -> Phrase:
    """Return the message of a distance with its most probable explanations."""
    changes = [phrase("films.change", **vars(each)) for each in difference.explanations[:2]]
    count = len(difference.explanations)
    code = (".unexplained" if difference.beyond else "", ".single", ".two", ".several")[min(count, 3)]
    fields = {"distance": difference.distance, "coordinates": difference.from_coordinates}
    explained = dict(zip(("first", "second"), changes, strict=False))
    return phrase(f"films.difference{code}", name=difference.name, others=count - 1, **fields, **explained)


def difference_of(
    first: str, second: str, typed: Mapping[str, str], usual: Mapping[str, tuple[float, float]]
) -> DistanceDifference:
    """Compare a distance with the coordinates of its marks, and find single corrections that reconcile them.

    `typed` contains all transcribed values by field, `usual` the usual coordinates of marks (mm), if known.
    Corrections are sorted by type of error, then by the largest distance of a mark from its usual
    coordinates. If these are unknown, the remaining difference is the second criterion.
    """
    name = f"{first}-{second}"
    fields = [*(f"{mark}.{axis}" for mark in (first, second) for axis in "xy"), name]
    found = DistanceDifference(name, float(typed[name]), _from_coordinates(fields, typed))
    if not found.beyond:
        return found
    places = {field: usual[field[:-2]]["xy".index(field[-1])] for field in fields[:4] if field[:-2] in usual}
    ranked: list[tuple[tuple[int, float, int, int], Explanation]] = []
    for order, field in enumerate(fields):
        for how, perhaps in _variants(typed[field]):
            changed = {**{each: typed[each] for each in fields}, field: perhaps}
            left = float(changed[name]) - _from_coordinates(fields, changed)
            if abs(left) < EXPLAINED:
                moved = float(perhaps) - places[field] if field in places else None
                far = max((abs(float(changed[each]) - places[each]) for each in places), default=0.0)
                rank = get_args(How).index(how), far, round(abs(left) / SAME), order
                ranked.append((rank, Explanation(field, typed[field], perhaps, how, left, moved)))
    return replace(found, explanations=tuple(each for _, each in sorted(ranked, key=lambda pair: pair[0])))


def _from_coordinates(fields: Sequence[str], typed: Mapping[str, str]) -> float:
    x1, y1, x2, y2 = (float(typed[field]) for field in fields[:4])
    return math.hypot(x2 - x1, y2 - y1)


def _variants(text: str) -> Iterator[tuple[How, str]]:
    """Yield the numbers that one transcription error produces, once per error type."""
    for how, variant in dict.fromkeys(_slips(text)):
        with suppress(ValueError):
            if float(variant) != float(text):
                yield how, variant


def _slips(text: str) -> Iterator[tuple[How, str]]:
    digits = [place for place, letter in enumerate(text) if letter.isdigit()]
    for place in digits:
        if place + 1 in digits:
            yield "exchange", text[:place] + text[place + 1] + text[place] + text[place + 2 :]
    yield "sign", text[1:] if text[0] in "+-" else f"-{text}"
    for place in digits:
        for digit in "0123456789":
            yield "digit", text[:place] + digit + text[place + 1 :]
    for place in digits:
        yield "lost or extra", text[:place] + text[place + 1 :]
        for digit in "0123456789":
            for added in (text[:place] + digit + text[place:], text[: place + 1] + digit + text[place + 1 :]):
                if not _LEADING_ZERO.match(added):
                    yield "lost or extra", added
