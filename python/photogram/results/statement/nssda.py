"""National Standard for Spatial Data Accuracy (FGDC-STD-007.3-1998): accuracy at 95 %.

Section 2.3 of the specification of the statement. Its factors hold for axes of nearly equal RMSE; beyond, and
beside, the radius stands that holds 95 % of errors with the matrix of mean products that was found.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import numbers
from photogram.lazy_dataclasses import dataclass
from photogram.results.statement.request import invalid
from photogram.statistics.error_radii import circular_error

ENOUGH = 20  # Required check points
VERTICAL, RADIAL, EITHER = 1.9600, 1.7308, 2.4477
"""Factors of RMSE_z, of the radial RMSE, and of the mean of the RMSE of both axes."""
LEAST_RATIO = 0.6  # Ratio of the RMSE of the axes below which the factors are not valid


@dataclass(frozen=True)
class Nssda:
    """Accuracy of n check points at 95 %, in the linear unit; None where there is no figure."""

    count: int  # n
    ratio: float | None  # Of the smaller RMSE of an axis to the larger
    accuracy_r: float | None  # Horizontal, by the mean RMSE of the axes; None if the ratio is below 0.6
    accuracy_r_equal: float | None  # Horizontal, by the radial RMSE, as if both axes had the same
    # Radius of 95 % from the mean products of differences, for any ratio
    ce95: float | None
    accuracy_z: float | None  # Vertical

    @property
    def enough(self) -> bool:
        """Whether there are as many check points as are asked for."""
        return self.count >= ENOUGH

    @property
    def wording(self) -> str:
        """Which sentence holds: `tested` with check points, `compiled` (to meet) without."""
        return "tested" if self.count else "compiled"


def nssda(moments: ArrayLike | None, rmse_z: float | None, count: int) -> Nssda:
    """Return the accuracy of `count` check points at 95 %.

    `moments` are (2, 2) mean products of the differences in plan, sum d d' / n: squares of RMSE_x and RMSE_y
    on its diagonal; None where there are none in plan. `rmse_z` is that of the heights, in the linear unit;
    None where there are none.
    """
    if rmse_z is not None and not rmse_z >= 0:
        raise invalid("rmse_z", "error.not-negative", rmse_z)
    vertical = None if rmse_z is None else VERTICAL * rmse_z
    if moments is None:
        return Nssda(count, None, None, None, None, vertical)
    matrix = numbers("moments", moments)
    if matrix.shape != (2, 2):
        raise invalid("moments", "error.shape", shape="(2, 2)", actual=str(matrix.shape))
    ce95 = float(circular_error(matrix[np.newaxis], 0.95)[0])
    small, large = sorted(math.sqrt(each) for each in np.diag(matrix).tolist())
    ratio = small / large if large > 0 else 1.0
    mean = EITHER * (small + large) / 2
    equal = RADIAL * math.hypot(small, large)
    return Nssda(count, ratio, mean if ratio >= LEAST_RATIO else None, equal, ce95, vertical)
