"""Measured lengths against calibrated ones: VDI/VDE 2634 part 1, optical measuring systems by single points.

Section 2.5 of the specification of the statement: in at least seven lines with at least five lengths each,
every error stays within E = A + K L, no more than B, of which the user decides; the longest length is two
thirds of the diagonal of the volume at least, and a line runs along a diagonal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import frozen, indices, is_covariance, names, numbers, shaped
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.results.statement.request import invalid
from photogram.statistics.agreement import agreement
from photogram.statistics.limits import GlobalTest
from photogram.words import phrase

LINES, LENGTHS, LONGEST = 7, 5, 2 / 3
"""Asked for: lines, lengths on each, and the longest of all over the diagonal of the volume."""
ALONG = math.radians(15.0)  # Largest angle between a line and a diagonal of the volume
REFERENCE = 20.0  # Temperature of calibrated lengths, degrees Celsius


@dataclass(frozen=True)
class Limit:
    """The largest error allowed of a length L: A + K L, no more than B; A, B and L of one unit."""

    # A, K and B; B may be infinite
    constant: float
    slope: float
    most: float = math.inf

    def of(self, lengths: Floats) -> Floats:
        """Return (m,) largest errors allowed of lengths, in their unit."""
        return np.minimum(self.constant + self.slope * lengths, self.most)


@dataclass(frozen=True, eq=False)
class LengthTest:
    """m measured lengths against calibrated ones."""

    errors: Floats  # (m,) measured minus calibrated
    sd: Floats  # (m,) their standard deviations, with those of the calibration
    normalised: Floats  # (m,) errors / sd; NaN if the standard deviation is zero
    limits: Floats | None  # (m,) limits of the errors
    # Test of all errors with their joint covariance; None without rank
    together: GlobalTest | None
    # Number of lines, and of lengths on the line with the fewest
    lines: int
    least: int
    # The longest calibrated length over the diagonal of the volume; NaN if unknown
    longest: float
    # Smallest angle between a length and a diagonal of the volume, radians; NaN if unknown
    off_diagonal: float

    @property
    def largest(self) -> float:
        """Size of the largest error."""
        return float(np.abs(self.errors).max())

    @property
    def rms(self) -> float:
        """Root mean square of the errors."""
        return math.sqrt(float(np.mean(self.errors**2)))

    @property
    def within(self) -> Bools | None:
        """(m,) whether errors are within their limits; None where none were given."""
        return None if self.limits is None else np.asarray(np.abs(self.errors) <= self.limits)

    @property
    def met(self) -> bool | None:
        """Whether every error is within its limit; None where none were given."""
        return None if self.within is None else bool(self.within.all())

    @property
    def enough(self) -> bool:
        """Whether there are as many lines and lengths on each as are asked for."""
        return self.lines >= LINES and self.least >= LENGTHS

    @property
    def long_enough(self) -> bool:
        """Whether the longest length is two thirds of the diagonal at least, as far as that is known."""
        return not self.longest < LONGEST * (1 - 1e-9)

    @property
    def along_diagonal(self) -> bool:
        """Whether a line runs along a diagonal of the volume, as far as that is known."""
        return not self.off_diagonal > ALONG


def measured_lengths(positions: ArrayLike, covariance: ArrayLike, pairs: ArrayLike) -> tuple[Floats, Floats]:
    """Return (m,) distances between points, and their (m, m) joint covariance J C J'.

    `positions` are (p, 3), `covariance` is (3 p, 3 p), point by point, cross blocks included, `pairs` are (m,
    2) rows of the points of each length. Two points at one place are refused.
    """
    own = numbers("positions", positions)
    if own.ndim != 2 or own.shape[1] != 3:
        raise invalid("positions", "error.shape", shape="(p, 3)", actual=str(own.shape))
    joint = shaped("covariance", covariance, (own.size, own.size))
    ends = numbers("pairs", pairs)
    if ends.ndim != 2 or ends.shape[1] != 2:
        raise invalid("pairs", "error.shape", shape="(m, 2)", actual=str(ends.shape))
    count = len(ends)
    first, second = (
        indices(f"pairs[:, {end}]", np.asarray(pairs)[:, end], count, len(own)) for end in (0, 1)
    )
    steps = own[second] - own[first]
    found = np.linalg.norm(steps, axis=1)
    if not (found > 0).all():
        raise invalid(f"pairs[{np.argmin(found > 0)}]", "request.identical-positions")
    along = steps / found[:, np.newaxis]
    gradient = np.zeros((count, len(own), 3))
    rows = np.arange(count)
    gradient[rows, second] += along
    gradient[rows, first] -= along
    flat = gradient.reshape(count, own.size)
    return found, np.asarray(flat @ joint @ flat.T)


def angle_to_diagonal(steps: ArrayLike, extent: ArrayLike) -> float:
    """Return the smallest angle between lengths and the four diagonals of a box, radians.

    `steps` are (m, 3) from the one end of each length to the other, none zero; `extent` is (3,) of the box
    along the same axes.
    """
    own, box = numbers("steps", steps), shaped("extent", extent, (3,))
    if own.ndim != 2 or own.shape[1] != 3 or not len(own):
        raise invalid("steps", "error.shape", shape="(m, 3)", actual=str(own.shape))
    sizes = np.linalg.norm(own, axis=1) * float(np.linalg.norm(box))
    if not (sizes > 0).all():
        raise invalid("steps", "request.identical-positions")
    # Of the four diagonals the one whose components have the signs of the step is the nearest.
    nearest = float((np.abs(own) @ np.abs(box) / sizes).max())
    return math.acos(min(nearest, 1.0))


def at_reference(lengths: ArrayLike, temperatures: ArrayLike, expansion: float) -> Floats:
    """Return what (m,) lengths of a body at some temperatures (deg C) are at 20 degrees Celsius.

    `expansion` is its coefficient of thermal expansion, per kelvin: 11.5e-6 of steel. One that makes a length
    of zero is refused.
    """
    own = numbers("lengths", lengths)
    grown = 1 + expansion * (shaped("temperatures", temperatures, own.shape) - REFERENCE)
    if not (np.isfinite(grown) & (grown > 0)).all():
        raise invalid("expansion", "request.expansion", expansion)
    return own / grown


def length_test(
    measured: ArrayLike,
    calibrated: ArrayLike,
    *,
    covariance: ArrayLike,
    sd: ArrayLike,
    lines: Sequence[object],
    limit: Limit | None = None,
    diagonal: float = math.nan,
    off_diagonal: float = math.nan,
    freedom: float = math.inf,
) -> LengthTest:
    """Test (m,) measured lengths against calibrated ones, both at 20 degrees (:func:`at_reference`).

    `covariance` is the (m, m) joint one of the measured ones (:func:`measured_lengths`), `sd` are (m,)
    standard deviations of the calibrated ones, `lines` (m,) names of the lines on which they lie. `diagonal`
    and `off_diagonal` are of the volume that was measured: its diagonal, and the smallest angle between a
    length and it (:func:`angle_to_diagonal`); NaN if unknown. `freedom` are degrees of freedom
    with which the unit weight of the covariance was estimated. Arrays of other shapes, and what is no length,
    are refused.
    """
    own = numbers("measured", measured)
    if own.ndim != 1 or not own.size:
        raise invalid("measured", "error.shape", shape="(m,)", actual=str(own.shape))
    given = shaped("calibrated", calibrated, own.shape)
    joint, deviations = shaped("covariance", covariance, 2 * own.shape), shaped("sd", sd, own.shape)
    for name, values in (("measured", own), ("calibrated", given), ("sd", deviations)):
        bad = ~(np.isfinite(values) & (values >= 0))
        if bad.any():
            raise invalid(f"{name}[{np.argmax(bad)}]", "error.not-negative", float(values[bad][0]))
    if not is_covariance(joint, singular=True):
        raise InputError(phrase("error.covariance-singular"))
    on = names("lines", lines)
    if len(on) != own.size:
        raise invalid("lines", "error.count", count=own.size, actual=len(on))
    errors = own - given
    found = agreement(
        errors[:, np.newaxis], joint, deviations[:, np.newaxis, np.newaxis] ** 2, second=freedom
    )
    spread = found.sd[:, 0]
    normalised = np.divide(errors, spread, out=np.full(own.shape, math.nan), where=spread > 0)
    return LengthTest(
        frozen(errors),
        frozen(spread),
        frozen(normalised),
        None if limit is None else frozen(limit.of(given)),
        found.together,
        len(set(on)),
        min(on.count(each) for each in set(on)),
        float(given.max()) / diagonal,
        off_diagonal,
    )
