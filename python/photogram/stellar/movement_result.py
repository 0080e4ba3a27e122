"""What the movement test finds: plate points under the attitudes, and how they differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram.lazy_dataclasses import dataclass

__all__ = ["FictitiousPoint", "Movement"]


@dataclass(frozen=True)
class Movement:
    """A fictitious point under two attitudes.

    Attributes
    ----------
    first, second
        The groups.
    xy
        x = y of the point, metres.
    angle, mean_error
        Angle between its two directions and its mean error, radians.
    differences
        Second minus first: right ascension times cos(declination), declination, azimuth times sin(zenith
        distance), elevation; radians.
    """

    first: str
    second: str
    xy: float
    angle: float
    mean_error: float
    differences: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class FictitiousPoint:
    """A plate point as a direction under one attitude.

    Attributes
    ----------
    group
        Of the attitude.
    xy
        x = y of the point, metres.
    place
        Apparent right ascension and declination, radians.
    azimuth, elevation
        Observed (refracted) ones: azimuth from south, positive west; radians.
    covariance
        (2, 2) of the place from the orientation, radians squared.
    """

    group: str
    xy: float
    place: tuple[float, float]
    azimuth: float
    elevation: float
    covariance: NDArray[np.float64]
