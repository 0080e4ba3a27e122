"""The general linear transformation taken apart into two scales, lack of orthogonality and rotation.

Exactly, not to first order (NOAA TR NOS 57, equations 33 to 38, 46, 47 and 54).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.arguments.types import Floats

__all__ = ["Decomposition", "rotation_matrix"]


def rotation_matrix(rotation_rad: float) -> Floats:
    """Return M = [[cos, sin], [-sin, cos]]: grid = M (corrected comparator coordinates) + translation."""
    c, s = math.cos(rotation_rad), math.sin(rotation_rad)
    return np.array([[c, s], [-s, c]])


@dataclass(frozen=True)
class Decomposition:
    """Two scales, lack of orthogonality, rotation.

    Attributes
    ----------
    scale_x, scale_y
        Multiply the readings.
    nonorthogonality_rad
        Angle between the y axis and the normal to the x axis; positive when the y axis leans toward +x.
    rotation_rad
        Of the plate against the comparator.
    """

    scale_x: float
    scale_y: float
    nonorthogonality_rad: float
    rotation_rad: float

    @classmethod
    def of_inverse(cls, matrix: Floats) -> Decomposition:
        """Take apart the matrix A = [[a, b], [c, d]] of comparator = A grid + shift (equation 47)."""
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
        """N S, the correction of readings for scales and lack of orthogonality (equation 34), 2 x 2."""
        lean = self.nonorthogonality_rad
        return np.array([[self.scale_x, self.scale_y * math.sin(lean)], [0.0, self.scale_y * math.cos(lean)]])

    @property
    def matrix(self) -> Floats:
        """R = M N S of grid = R comparator + shift (equation 36), 2 x 2."""
        product: Floats = rotation_matrix(self.rotation_rad) @ self.linear_matrix
        return product


def decomposition_jacobian(matrix: Floats) -> Floats:
    """Return the partials of scales, lack of orthogonality and rotation by a, b, c, d (equation 54), 4 x 4.

    In closed form: the listing divides by b and d, which vanish when the plate lies exactly along the axes.
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
