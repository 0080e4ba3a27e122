"""Fits of one case: rigid (FIDFIT2), linear, and polynomials, with their residuals.

A general linear transformation is decomposed into two scales, lack of orthogonality and rotation. The
decomposition is exact (NOAA TR NOS 57, equations 33 to 38, 46, 47 and 54).

Correction polynomials of degree four without cross terms (NOAA TR NOS 57, equations 59 to 62).

P = A x^4 + B y^4 + C x^3 + D y^3 + E x^2 + F y^2 + G x + H y + J, for x and for y. Arguments are shifted and
scaled to -1 ... 1. The condition is 8e9 for normal equations in metres, and a few tens for QR on the scaled
columns.
"""

from __future__ import annotations

import math
from math import comb

import numpy as np

from photogram.arguments.fields import Checked
from photogram.arguments.types import Floats, Indices
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of the points of one case, in the handedness of the comparator."""

    points: Indices  # (n,) numbers of the points
    xy_um: Floats  # (n, 2) comparator coordinates of the residuals (X ADJ, Y ADJ), micrometres
    # (n, 2) grid transformed into the comparator system minus measured coordinates
    comparator_um: Floats
    # (n, 2) measurement transformed into the grid system minus given grid
    grid_um: Floats
    # Unknowns per coordinate axis: SIGMA divides by the number of points minus this
    lost: float

    @property
    def squares_um2(self) -> tuple[float, float, float, float]:
        """Sums of squares: comparator x, y, grid X, Y (SUM VV)."""
        x, y = (self.comparator_um**2).sum(axis=0)
        grid_x, grid_y = (self.grid_um**2).sum(axis=0)
        return float(x), float(y), float(grid_x), float(grid_y)

    @property
    def sigma_um(self) -> tuple[float, ...]:
        """Roots of sums of squares over points minus `lost` (SIGMA); NaN if not redundant."""
        return tuple(self._sigma(square, 1) for square in self.squares_um2)

    @property
    def sigma0_um(self) -> float:
        """Standard error of unit weight in x and y (equations 52, 60); NaN if undefined."""
        return self._sigma(sum(self.squares_um2[:2]), 2)

    def _sigma(self, square: float, axes: int) -> float:
        dof = axes * (len(self.points) - self.lost)
        return math.sqrt(square / dof) if dof > 1e-9 else math.nan


def rotation_matrix(rotation_rad: float) -> Floats:
    """Return M = [[cos, sin], [-sin, cos]] of grid = M corrected + translation."""
    c, s = math.cos(rotation_rad), math.sin(rotation_rad)
    return np.array([[c, s], [-s, c]])


@dataclass(frozen=True)
class Decomposition:
    """Scales, lack of orthogonality and rotation of a linear transformation.

    Attributes
    ----------
    scale_x, scale_y
        Factors of the readings.
    nonorthogonality_rad
        Angle between the y axis and the normal to the x axis; positive if the y axis leans toward +x.
    rotation_rad
        Rotation of the plate relative to the comparator.
    """

    scale_x: float
    scale_y: float
    nonorthogonality_rad: float
    rotation_rad: float

    @classmethod
    def of_inverse(cls, matrix: Floats) -> Decomposition:
        """Decompose the matrix A of comparator = A grid + shift (equation 47)."""
        (a, b), (c, d) = matrix.tolist()
        determinant = a * d - b * c
        return cls(
            math.hypot(c, d) / determinant,
            math.hypot(a, b) / determinant,
            math.atan2(-(a * c + b * d), determinant),
            math.atan2(c, d),
        )

    @property
    def linear_matrix(self) -> Floats:
        """Matrix N S for scales and lack of orthogonality (equation 34), 2 x 2."""
        lean = self.nonorthogonality_rad
        return np.array([[self.scale_x, self.scale_y * math.sin(lean)], [0.0, self.scale_y * math.cos(lean)]])

    @property
    def matrix(self) -> Floats:
        """Matrix R = M N S of grid = R comparator + shift (equation 36), 2 x 2."""
        product: Floats = rotation_matrix(self.rotation_rad) @ self.linear_matrix
        return product


def decomposition_jacobian(matrix: Floats) -> Floats:
    """Return the partials of scales, skew and rotation by A (equation 54), 4 x 4.

    Closed form. The listing divides by b and d, which vanish for a plate exactly along the axes.
    """
    (a, b), (c, d) = matrix.tolist()
    determinant = a * d - b * c
    w = a * c + b * d
    cd, ab = math.hypot(c, d), math.hypot(a, b)
    squared = determinant**2
    return np.array(
        [
            [-d * cd / squared, c * cd / squared, d * w / (squared * cd), -c * w / (squared * cd)],
            [-b * w / (squared * ab), a * w / (squared * ab), b * ab / squared, -a * ab / squared],
            [b / ab**2, -a / ab**2, -d / cd**2, c / cd**2],
            [0.0, 0.0, d / cd**2, -c / cd**2],
        ]
    )


RIGID_LOST = 1.5  # Half of rotation and two translations: unknowns per axis


@dataclass(frozen=True, eq=False)
class RigidFit:
    """Rigid fit: grid = M(rotation) comparator + translation, comparator handedness."""

    rotation_rad: float
    translation_um: Floats
    residuals: Residuals


def fit_rigid(points: Indices, xy_um: Floats, grid_um: Floats, *, lost: float = RIGID_LOST) -> RigidFit:
    """Fit measured to grid coordinates of equal handedness, without scale.

    The least-squares similarity transformation has the same rotation as the rigid one. `lost` is the number
    of unknowns per axis, for the standard errors. As in the report, residuals are rotated back with the
    unnormalised cosine and sine of the similarity transformation, which changes them by some 1e-5.
    """
    middle, grid_middle = xy_um.mean(axis=0), grid_um.mean(axis=0)
    d, g = xy_um - middle, grid_um - grid_middle
    along = float((d * g).sum())
    across = float((d[:, 1] * g[:, 0] - d[:, 0] * g[:, 1]).sum())
    rotation = math.atan2(across, along)
    matrix = rotation_matrix(rotation)
    grid_residuals = d @ matrix.T - g
    size = math.hypot(along, across) / float((d * d).sum())
    comparator = -size * grid_residuals @ matrix
    return RigidFit(
        rotation,
        np.asarray(grid_middle - matrix @ middle),
        Residuals(points, xy_um, comparator, grid_residuals, lost),
    )


LEAST_POINTS = 4  # Three points determine the transformation; the fourth checks it
AFFINE_LOST = 3.0


@dataclass(frozen=True, eq=False)
class AffineFit:
    coefficients: Floats  # (2, 2) and (2,): comparator = coefficients grid + shift (equation 40)
    shift_um: Floats
    parameters: Decomposition  # Scales, lack of orthogonality, rotation
    cofactors: Floats  # (4, 4) of these parameters in order, per um^2 of the variance of unit weight
    residuals: Residuals  # Residuals in both systems

    @property
    def covariance(self) -> Floats:
        """(4, 4) covariance of scale x, scale y, lack of orthogonality and rotation (rad; equation 53)."""
        return self.residuals.sigma0_um**2 * self.cofactors

    @property
    def translation_um(self) -> Floats:
        """(2,) grid coordinates of the comparator zero in grid = M N S comparator + shift."""
        return np.asarray(-np.linalg.solve(self.coefficients, self.shift_um))


def fit_affine(points: Indices, xy_um: Floats, grid_um: Floats) -> AffineFit:
    """Fit scales, lack of orthogonality, rotation and translation to a fixed grid.

    The form x + v = A X + T is linear. QR on centred coordinates replaces the adjugate of the normal
    equations in the listing. Measured and grid coordinates (n, 2) have the same handedness.
    """
    if len(points) < LEAST_POINTS:
        raise AdjustmentError(phrase("comparators.few-points", count=len(points), least=LEAST_POINTS))
    middle, grid_middle = xy_um.mean(axis=0), grid_um.mean(axis=0)
    centred = grid_um - grid_middle
    q, r = np.linalg.qr(centred)
    if np.abs(np.diag(r)).min() <= 1e-6 * np.abs(r).max():
        raise AdjustmentError(phrase("comparators.collinear"))
    inverse = np.linalg.inv(r)
    coefficients = (inverse @ (q.T @ (xy_um - middle))).T
    if np.linalg.det(coefficients) <= 0:
        raise AdjustmentError(phrase("comparators.handedness"))
    computed = centred @ coefficients.T + middle
    comparator = computed - xy_um
    # Grid residuals V = -A^-1 v.
    grid_residuals = -np.linalg.solve(coefficients, comparator.T).T
    block = inverse @ inverse.T
    jacobian = decomposition_jacobian(coefficients)
    cofactors = jacobian @ np.kron(np.eye(2), block) @ jacobian.T
    return AffineFit(
        coefficients,
        np.asarray(middle - coefficients @ grid_middle),
        Decomposition.of_inverse(coefficients),
        cofactors,
        Residuals(points, xy_um, comparator, grid_residuals, AFFINE_LOST),
    )


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
