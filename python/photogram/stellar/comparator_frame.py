"""Scales and obliqueness of the plate in the axes of the comparator (NOAA TR NOS 55, equations 35 to 42)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.parameters import INDEX

if TYPE_CHECKING:
    from photogram.stellar import Result

__all__ = ["ComparatorFrame", "comparator_frame"]


@dataclass(frozen=True, eq=False)
class ComparatorFrame:
    """The affinity of the plate coordinates along other axes."""

    angle: float  # From the axes of the plate coordinates to these, from x towards y; radians
    scale_x: float  # Principal distances along the axes over their mean
    scale_y: float
    epsilon: float  # Nonperpendicularity of the axes, radians; of the calibration itself at the angle zero
    covariance: Floats  # (3, 3) of these three

    @property
    def mean_errors(self) -> tuple[float, float, float]:
        """Mean errors of the scales and of epsilon."""
        x, y, epsilon = np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist()
        return x, y, epsilon


def comparator_frame(result: Result, angle: float) -> ComparatorFrame:
    """Turn the affinity of a calibration into the axes of the comparator.

    With A = [[cx / c, -epsilon], [0, cy / c]], c the mean of cx and cy, and R the rotation to the new axes,
    the scales are the diagonal of R A R^T and epsilon is minus the sum of its other two elements; their
    difference is a rotation, which kappa takes.

    Parameters
    ----------
    result
        A calibration; with a common scale and no epsilon all angles give the same.
    angle
        From the axes of the plate coordinates to the new ones, from x towards y; radians.
    """
    values = result.parameters
    epsilon, cx, cy = values["epsilon"], values["cx"], values["cy"]
    if result.problem.options.common_scale:
        cy = cx
    total = cx + cy
    cos2, sin2, both = math.cos(angle) ** 2, math.sin(angle) ** 2, math.sin(angle) * math.cos(angle)
    # Rows: scale x, scale y, epsilon; columns: cx / c, cy / c, epsilon.
    turned = np.array([[cos2, sin2, -both], [sin2, cos2, both], [2 * both, -2 * both, cos2 - sin2]])
    # c is the mean: cx / c = 2 cx / (cx + cy), whose change is that of -cy / c.
    change = 2.0 / total**2 * np.array([[0, cy, -cx], [0, -cy, cx], [0, 0, 0]])
    change[2, 0] = 1.0
    chosen = [INDEX[name] for name in ("epsilon", "cx", "cy")]
    covariance = result.covariance[np.ix_(chosen, chosen)]
    if result.problem.options.common_scale:
        change[:2] = 0.0
    gradient = turned @ change
    scale_x, scale_y, oblique = turned @ np.array([2 * cx / total, 2 * cy / total, epsilon])
    return ComparatorFrame(
        angle, float(scale_x), float(scale_y), float(oblique), gradient @ covariance @ gradient.T
    )
