"""Whether a peer started where photogram did and ended there too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from solution import Floats

# Largest differences allowed. gtsam stops when its error falls by less than 1e-5 of itself: from there to the
# minimum it is a small fraction of a standard deviation.
STANDARD_DEVIATIONS = 1e-3
SUM_OF_SQUARES = 1e-8
# COLMAP damps the normal equations by 1e-8 of their diagonal before it inverts them.
COFACTORS = 1e-5


@dataclass(frozen=True)
class Agreement:
    """How far the solution of a peer is from photogram's.

    Attributes
    ----------
    start, end
        Relative differences of the weighted sums of squares at the initial values and at the solutions.
    photos, points
        Root mean squares of the differences of positions and attitudes, and of points, in their standard
        deviations.
    largest
        The largest of these differences.
    photo_cofactors, point_cofactors
        Largest differences of cofactors of a sample, as correlations: in parts of the roots of the products
        of the variances. None where the peer has none.
    """

    start: float
    end: float
    photos: float
    points: float
    largest: float
    photo_cofactors: float | None
    point_cofactors: float | None

    @classmethod
    def of(
        cls,
        ours: tuple[Mapping[str, Any], Mapping[str, Floats]],
        theirs: tuple[Mapping[str, Any], Mapping[str, Floats]],
    ) -> Agreement:
        """Compare the numbers and arrays that two sides wrote about one block."""
        (numbers, arrays), (other_numbers, other_arrays) = ours, theirs
        attitudes = other_arrays["photo_attitudes"] - arrays["photo_attitudes"]
        attitudes -= 2 * np.pi * np.round(attitudes / (2 * np.pi))
        positions = other_arrays["photo_positions"] - arrays["photo_positions"]
        photos = np.hstack([positions, attitudes]) / arrays["photo_sd"]
        points = (other_arrays["point_positions"] - arrays["point_positions"]) / arrays["point_sd"]

        def relative(name: str) -> float:
            return abs(float(other_numbers[name]) / float(numbers[name]) - 1.0)

        def cofactors(name: str) -> float | None:
            return _correlation(arrays[name], other_arrays[name]) if name in other_arrays else None

        return cls(
            start=relative("initial_weighted_sum_of_squares"),
            end=relative("weighted_sum_of_squares"),
            photos=_rms(photos),
            points=_rms(points),
            largest=float(max(np.abs(photos).max(), np.abs(points).max())),
            photo_cofactors=cofactors("photo_cofactors"),
            point_cofactors=cofactors("point_cofactors"),
        )

    def __bool__(self) -> bool:
        sums = all(difference <= SUM_OF_SQUARES for difference in (self.start, self.end))
        cofactors = [value for value in (self.photo_cofactors, self.point_cofactors) if value is not None]
        return (
            sums
            and self.largest <= STANDARD_DEVIATIONS
            and all(difference <= COFACTORS for difference in cofactors)
        )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _correlation(cofactors: Floats, others: Floats) -> float:
    deviations = np.sqrt(np.diagonal(cofactors, axis1=1, axis2=2))
    scale = deviations[:, :, np.newaxis] * deviations[:, np.newaxis, :]
    return float(np.abs((others - cofactors) / scale).max())
