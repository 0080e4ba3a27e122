"""The linear adjustment of one case, exact (NOAA TR NOS 57, equations 39 to 55, subroutine EXACT)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.decomposition import Decomposition, decomposition_jacobian
from photogram.comparator.residuals import Residuals
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.readings import Integers

__all__ = ["AffineFit", "fit_affine"]

LEAST_POINTS = 4
"""Three points determine the transformation; the fourth says how good it is."""
LOST = 3.0


@dataclass(frozen=True, eq=False)
class AffineFit:
    """A linear fit of one case.

    Attributes
    ----------
    coefficients, shift_um
        (2, 2) and (2,): comparator = coefficients grid + shift (equation 40).
    parameters
        Scales, lack of orthogonality, rotation.
    cofactors
        (4, 4) of the parameters in that order, per um^2 of the variance of unit weight.
    residuals
        In both systems.
    """

    coefficients: Floats
    shift_um: Floats
    parameters: Decomposition
    cofactors: Floats
    residuals: Residuals

    @property
    def covariance(self) -> Floats:
        """(4, 4) of scale x, scale y, lack of orthogonality (rad), rotation (rad) (equation 53)."""
        return self.residuals.sigma0_um**2 * self.cofactors

    @property
    def translation_um(self) -> Floats:
        """(2,) of grid = M N S comparator + translation: grid coordinates of the comparator's zero."""
        return np.asarray(-np.linalg.solve(self.coefficients, self.shift_um))


def fit_affine(points: Integers, xy_um: Floats, grid_um: Floats) -> AffineFit:
    """Fit two scales, lack of orthogonality, rotation and translation; the grid is without error.

    The form x + v = A X + T is linear; QR on centred coordinates takes the place of the listing's adjugate of
    the normal equations.

    Parameters
    ----------
    points
        (n,) numbers, four at least.
    xy_um, grid_um
        (n, 2) measured and grid coordinates in micrometres, of the same handedness.

    Raises
    ------
    AdjustmentError
        Fewer than four points, or points in one line.
    """
    if len(points) < LEAST_POINTS:
        raise AdjustmentError(
            f"{len(points)} points were measured; the linear adjustment needs {LEAST_POINTS} at least"
        )
    middle, grid_middle = xy_um.mean(axis=0), grid_um.mean(axis=0)
    centred = grid_um - grid_middle
    q, r = np.linalg.qr(centred)
    if np.abs(np.diag(r)).min() <= 1e-6 * np.abs(r).max():
        raise AdjustmentError("the points measured lie in one line")
    inverse = np.linalg.inv(r)
    coefficients = (inverse @ (q.T @ (xy_um - middle))).T
    if np.linalg.det(coefficients) <= 0:
        raise AdjustmentError("the comparator is of the other handedness than the grid")
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
        Residuals(points, xy_um, comparator, grid_residuals, LOST),
    )
