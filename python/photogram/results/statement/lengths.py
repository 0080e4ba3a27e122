"""Tests of measured lengths against calibrated ones (VDI/VDE 2634 part 1).

See section 2.5 of the specification of the statement: at least seven lines with at least five lengths each.
Every error is within E = A + K L, at most the user's limit B. The longest length is at least two thirds of
the diagonal of the volume, and a line is along a diagonal.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.results.statement.request import invalid
from photogram.statistics.agreement import agreement
from photogram.statistics.limits import GlobalTest

LINES, LENGTHS, LONGEST = 7, 5, 2 / 3
"""Requirements: lines, lengths on each, and the longest of all over the diagonal of the volume."""
ALONG = math.radians(15.0)  # Largest angle between a line and a diagonal of the volume
REFERENCE = 20.0  # Temperature of calibrated lengths, degrees Celsius


@dataclass(frozen=True, eq=False)
class LengthTest:
    """m measured lengths against calibrated ones."""

    names: Sequence[str]  # (m,) of their lines
    calibrated: Floats  # (m,)
    errors: Floats  # (m,) measured minus calibrated
    sd: Floats  # (m,) their standard deviations, with those of the calibration
    limit: tuple[float, float, float] | None  # A, K and B of the limits of errors; B may be infinite
    # Test of all errors with their joint covariance; None without rank
    together: GlobalTest | None
    # The longest calibrated length over the diagonal of the volume; NaN if unknown
    longest: float
    # Smallest angle between a length and a diagonal of the volume, radians; NaN if unknown
    off_diagonal: float
    ends: Sequence[tuple[str, str]] = ()  # (m,) names of both points
    expansion: float | None = None  # Of the reduction to 20 degrees; None without

    @property
    def normalised(self) -> Floats:
        """(m,) errors / sd; NaN if the standard deviation is zero."""
        out = np.full(self.errors.shape, math.nan)
        return np.asarray(np.divide(self.errors, self.sd, out=out, where=self.sd > 0))

    @property
    def limits(self) -> Floats | None:
        """(m,) limits of the errors."""
        constant, slope, most = self.limit or (0.0, 0.0, 0.0)
        return None if self.limit is None else np.minimum(constant + slope * self.calibrated, most)

    @property
    def lines(self) -> int:
        return len(set(self.names))

    @property
    def least(self) -> int:
        """Number of lengths on the line with the fewest."""
        return min(Counter(self.names).values())

    @property
    def largest(self) -> float:
        return float(np.abs(self.errors).max())

    @property
    def rms(self) -> float:
        return math.sqrt(float(np.mean(self.errors**2)))

    @property
    def within(self) -> Bools | None:
        """(m,) whether errors are within their limits; None without limits."""
        return None if self.limits is None else np.asarray(np.abs(self.errors) <= self.limits)

    @property
    def met(self) -> bool | None:
        """Whether every error is within its limit; None without limits."""
        return None if self.within is None else bool(self.within.all())

    @property
    def enough(self) -> bool:
        """Whether there are enough lines, and lengths on each."""
        return self.lines >= LINES and self.least >= LENGTHS

    @property
    def long_enough(self) -> bool:
        """Whether the longest length is at least two thirds of the diagonal, if known."""
        return not self.longest < LONGEST * (1 - 1e-9)

    @property
    def along_diagonal(self) -> bool:
        """Whether a line is along a diagonal of the volume, if known."""
        return not self.off_diagonal > ALONG


def measured_lengths(positions: Floats, joint: Floats, pairs: Indices) -> tuple[Floats, Floats]:
    """Return (m,) distances of `pairs` of (p, 3) positions, and their joint covariance J C J'."""
    first, second = pairs.T
    steps = positions[second] - positions[first]
    found = np.linalg.norm(steps, axis=1)
    if not (found > 0).all():
        raise invalid(f"lengths[{np.argmin(found > 0)}]", "request.identical-positions")
    along, rows = steps / found[:, np.newaxis], np.arange(len(pairs))
    gradient = np.zeros((len(pairs), *positions.shape))
    gradient[rows, second] += along
    gradient[rows, first] -= along
    flat = gradient.reshape(len(pairs), -1)
    return found, np.asarray(flat @ joint @ flat.T)


def angle_to_diagonal(steps: Floats, extent: Floats) -> float:
    """Return the smallest angle (radians) of (m, 3) non-zero steps to box diagonals."""
    sizes = np.linalg.norm(steps, axis=1) * float(np.linalg.norm(extent))
    # The nearest of the four diagonals has the component signs of the step.
    return math.acos(min(float((np.abs(steps) @ np.abs(extent) / sizes).max()), 1.0))


def at_reference(lengths: Floats, temperatures: Floats, expansion: float) -> Floats:
    """Return (m,) lengths at 20 degrees from others (deg C); `expansion` per kelvin: 11.5e-6 for steel."""
    grown = 1 + expansion * (temperatures - REFERENCE)
    if not (np.isfinite(grown) & (grown > 0)).all():
        raise invalid("expansion", "request.expansion", expansion)
    return lengths / grown


def length_test(
    measured: Floats,
    calibrated: Floats,
    *,
    covariance: Floats,
    sd: Floats,
    lines: Sequence[str],
    limit: tuple[float, float, float] | None = None,
    diagonal: float = math.nan,
    off_diagonal: float = math.nan,
    freedom: float = math.inf,
) -> LengthTest:
    """Test (m,) measured lengths against calibrated ones, both at 20 degrees.

    `covariance` is the (m, m) matrix of the measured lengths (:func:`measured_lengths`), `sd` are (m,)
    standard deviations of the calibrated ones, `lines` (m,) names of their lines. `limit` are A, K and B (may
    be infinite) of error limits A + K L, at most B. `diagonal` and `off_diagonal` belong to the measured
    volume: its diagonal, and the smallest angle between a length and it; NaN if unknown. `freedom` are
    degrees of freedom of the estimated unit weight of the covariance.
    """
    errors = measured - calibrated
    found = agreement(errors[:, np.newaxis], covariance, sd[:, np.newaxis, np.newaxis] ** 2, second=freedom)
    parts = lines, calibrated, errors, found.sd[:, 0], limit, found.together
    return LengthTest(*parts, float(calibrated.max()) / diagonal, off_diagonal)
