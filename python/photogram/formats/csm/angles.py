"""Rotations as quaternions and as angles of ISIS (axes 3, 1, 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.places import Failing
from photogram.network.attitudes import Attitudes
from photogram.words import phrase

RECORDS = 64  # Intervals for sampling polynomials; interpolation by eight neighbours is exact to rounding
MAX_LENGTH_DIFFERENCE = 1e-3
BEYOND = 4  # Records beyond either end: the number of neighbours on a side


def of_quaternions(place: Failing, quaternions: Floats) -> Floats:
    """Return (n, 3, 3) matrices C (as in C v) of (n, 4) unit quaternions w, x, y, z."""
    lengths = np.linalg.norm(quaternions, axis=1)
    if not (np.abs(lengths - 1) < MAX_LENGTH_DIFFERENCE).all():
        row = int(np.argmax(np.abs(lengths - 1)))
        length = phrase("format.length", length=float(lengths[row]))
        raise place.error(phrase("error.at", what=phrase("csm.record", n=row + 1), message=length))
    return Attitudes.of("quaternion", quaternions).matrices


def of_angles(angles: Floats) -> Floats:
    """Return (n, 3, 3) matrices [a3]_3 [a2]_1 [a1]_3 of (n, 3) angles, radians."""
    (c1, c2, c3), (s1, s2, s3) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [c3 * c1 - s3 * c2 * s1, c3 * s1 + s3 * c2 * c1, s3 * s2],
        [-s3 * c1 - c3 * c2 * s1, -s3 * s1 + c3 * c2 * c1, c3 * s2],
        [s2 * s1, -s2 * c1, c2],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def to_angles(matrices: Floats) -> Floats:
    """Return (n, 3) continuous angles of consecutive (n, 3, 3) matrices."""
    m = matrices
    a1 = np.arctan2(m[:, 2, 0], -m[:, 2, 1])
    a2 = np.arctan2(np.hypot(m[:, 2, 0], m[:, 2, 1]), m[:, 2, 2])
    a3 = np.arctan2(m[:, 0, 2], m[:, 1, 2])
    return np.unwrap(np.column_stack([a1, a2, a3]), axis=0)


def angle_axes(angles: Floats) -> Floats:
    """Return (n, 3, 3) rotation axes of (n, 3) angles, as columns."""
    (c1, c2, _), (s1, s2, _) = np.cos(angles).T, np.sin(angles).T
    zero, one = np.zeros_like(c1), np.ones_like(c1)
    return np.moveaxis(np.array([[zero, c1, s2 * s1], [zero, s1, -s2 * c1], [one, zero, c2]]), 2, 0)


def to_quaternions(matrices: Floats) -> Floats:
    """Return (n, 4) quaternions w, x, y, z of consecutive (n, 3, 3) matrices."""
    found = np.array(Attitudes(matrices).values("quaternion"))
    turned = np.einsum("ni,ni->n", found[1:], found[:-1]) < 0
    found[1:][np.cumsum(turned) % 2 == 1] *= -1
    return found


class Polynomials(NamedTuple):
    """Three angles or coordinates: polynomials of (t - reference) / scale, seconds.

    `coefficients` are (3, degree + 1), powers from 0 on.
    """

    coefficients: Floats
    reference: float
    scale: float

    def at(self, times: Floats) -> Floats:
        """Return (n, 3) values at (n,) times."""
        powers = np.vander((times - self.reference) / self.scale, self.coefficients.shape[1], increasing=True)
        return np.asarray(powers @ self.coefficients.T)

    def rates(self, times: Floats) -> Floats:
        """Return the (n, 3) rates of change per second at (n,) times."""
        powers = np.arange(1, self.coefficients.shape[1])
        slopes = self.coefficients[:, 1:] * (powers / self.scale)
        return self._replace(coefficients=slopes).at(times) if len(powers) else np.zeros((len(times), 3))

    def sampled(self, first: float, last: float) -> tuple[Floats, Floats]:
        """Return (k,) times and (k, 3) values for lossless interpolation."""
        steps = np.arange(-BEYOND, RECORDS + BEYOND + 1, dtype=float)
        times: Floats = first + (last - first) / RECORDS * steps
        return times, self.at(times)


def fitted_angles(times: Floats, matrices: Floats, degree: int) -> Polynomials:
    """Return polynomials fitted to angles of (k, 3, 3) matrices, as in jigsaw."""
    return fitted(times, to_angles(matrices), degree)


def fitted(times: Floats, values: Floats, degree: int) -> Polynomials:
    """Return polynomials fitted to (k, 3) values at (k,) seconds with equal weights.

    Time is reduced to the centre and scaled by half of the span of the records.
    """
    reference, scale = (times[0] + times[-1]) / 2, (times[-1] - times[0]) / 2 or 1.0
    powers = np.vander((times - reference) / scale, degree + 1, increasing=True)
    # Values are reduced to their mean: positions in metres are large compared with their changes.
    middle = values.mean(axis=0)
    solved = np.asarray(np.linalg.lstsq(powers, values - middle, rcond=None)[0].T)
    solved[:, 0] += middle
    return Polynomials(solved, float(reference), float(scale))
