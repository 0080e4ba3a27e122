"""Correction polynomials of degree four without cross terms (NOAA TR NOS 57, equations 59 to 62).

P = A x^4 + B y^4 + C x^3 + D y^3 + E x^2 + F y^2 + G x + H y + J, for x and for y. Arguments are shifted and
scaled to -1 ... 1. The condition is 8e9 for normal equations in metres, and a few tens for QR on the scaled
columns.
"""

from __future__ import annotations

from math import comb

import numpy as np

from photogram.arguments.fields import Checked
from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

TERMS = ("x^4", "y^4", "x^3", "y^3", "x^2", "y^2", "x", "y", "1")  # The terms in the order of the report
EXPONENTS = np.array([[4, 0], [0, 4], [3, 0], [0, 3], [2, 0], [0, 2], [1, 0], [0, 1], [0, 0]])
COUNT = len(TERMS)
UM = 1e6  # Micrometres per metre


@dataclass(frozen=True)
class Frame(Checked):
    """Origin and units of arguments: u = (x - centre) / half range, in micrometres."""

    centre_um: tuple[float, float]
    half_range_um: tuple[float, float]

    @classmethod
    def of(cls, xy_um: Floats) -> Frame:
        """Return the frame of the range of positions."""
        low, high = xy_um.min(axis=0), xy_um.max(axis=0)
        centre, half = (low + high) / 2, np.maximum((high - low) / 2, 1.0)
        return cls((float(centre[0]), float(centre[1])), (float(half[0]), float(half[1])))

    @classmethod
    def metres(cls) -> Frame:
        """Return the frame of the report: metres from the zero of the comparator."""
        return cls((0.0, 0.0), (UM, UM))

    def arguments(self, xy_um: Floats) -> Floats:
        """Return scaled arguments (n, 2) of positions (n, 2)."""
        return np.asarray((xy_um - np.array(self.centre_um)) / np.array(self.half_range_um))

    def to_metres(self) -> Floats:
        """Return the matrix (9, 9) that transforms coefficients to metres."""
        matrix = np.zeros((COUNT, COUNT))
        row_of = {tuple(exponents): row for row, exponents in enumerate(EXPONENTS.tolist())}
        for column, exponents in enumerate(EXPONENTS.tolist()):
            axis = int(exponents[1] > 0)
            degree = exponents[axis]
            centre, half = self.centre_um[axis] / UM, self.half_range_um[axis] / UM
            for power in range(degree + 1):
                target = (power, 0) if axis == 0 else (0, power)
                matrix[row_of[target], column] += (
                    comb(degree, power) * (-centre) ** (degree - power) / half**degree
                )
        return matrix


def design(frame: Frame, xy_um: Floats) -> Floats:
    """Return the nine functions at positions, (n, 9)."""
    arguments = frame.arguments(xy_um)
    powers = arguments[:, np.newaxis, :] ** EXPONENTS
    return np.asarray(powers.prod(axis=2))


@dataclass(frozen=True, eq=False)
class Polynomial(Checked):
    """Correction polynomials of x and y.

    Attributes
    ----------
    frame
        Origin and units of the arguments.
    scaled_um
        (2, 9) coefficients for x and y in this frame, micrometres.
    scaled_cofactors
        (18, 18) cofactors of both, x first, per um^2 of the variance of unit weight.
    """

    frame: Frame
    scaled_um: Floats
    scaled_cofactors: Floats

    @classmethod
    def from_metres(cls, x: Floats, y: Floats) -> Polynomial:
        """Return polynomials from coefficients in metre units, without covariance."""
        return cls(Frame.metres(), UM * np.array([x, y]), np.zeros((2 * COUNT, 2 * COUNT)))

    @property
    def coefficients(self) -> Floats:
        """(2, 9) coefficients in the order of the report, with all units in metres."""
        return np.asarray(self.scaled_um @ self.frame.to_metres().T / UM)

    @property
    def cofactors(self) -> Floats:
        """(18, 18) cofactors of metre-unit coefficients, per um^2 of unit weight variance."""
        matrix = np.kron(np.eye(2), self.frame.to_metres()) / UM
        return np.asarray(matrix @ self.scaled_cofactors @ matrix.T)

    def evaluate(self, xy_um: Floats) -> Floats:
        """Return the corrections (n, 2), um, at linearly corrected positions (n, 2)."""
        return np.asarray(design(self.frame, xy_um) @ self.scaled_um.T)

    def jacobian(self, xy_um: Floats) -> Floats:
        """Return the partials of the corrections by position: (n, 2, 2), dimensionless."""
        arguments = self.frame.arguments(xy_um)
        slopes = np.empty((len(xy_um), 2, 2))
        for axis in range(2):
            exponents = EXPONENTS[:, axis]
            lowered = exponents * arguments[:, axis, np.newaxis] ** np.maximum(exponents - 1, 0)
            slopes[:, :, axis] = lowered @ self.scaled_um.T / self.frame.half_range_um[axis]
        return slopes


def fit_polynomial(xy_um: Floats, residuals_um: Floats) -> Polynomial:
    """Fit both polynomials to linear residuals (n, 2) at positions (n, 2)."""
    if len(xy_um) <= COUNT:
        raise AdjustmentError(phrase("comparators.few-points", count=len(xy_um), least=COUNT + 1))
    frame = Frame.of(xy_um)
    q, r = np.linalg.qr(design(frame, xy_um))
    if np.abs(np.diag(r)).min() < 1e-9 * np.abs(r).max():
        raise AdjustmentError(phrase("comparators.few-coordinates"))
    inverse = np.linalg.inv(r)
    cofactors = np.kron(np.eye(2), inverse @ inverse.T)
    return Polynomial(frame, np.asarray((inverse @ (q.T @ residuals_um)).T), cofactors)
