"""Whether a peer started where photogram did and ended there too."""

from __future__ import annotations

from dataclasses import dataclass

import gtsam_block
import numpy as np

from photogram.result import Result

# Largest differences allowed. gtsam stops when its error falls by less than 1e-5 of itself: from there to the
# minimum it is a small fraction of a standard deviation.
STANDARD_DEVIATIONS = 1e-3
SUM_OF_SQUARES = 1e-8


@dataclass(frozen=True)
class Agreement:
    """How far the solution of a peer is from photogram's.

    Attributes
    ----------
    start, end
        Relative differences of the weighted sums of squares at the initial values and at the solutions.
    photos, points
        Largest differences of positions and attitudes, and of points, in their standard deviations.
    """

    start: float
    end: float
    photos: float
    points: float

    @classmethod
    def of(cls, result: Result, problem: gtsam_block.Problem, solution: gtsam_block.Solution) -> Agreement:
        """Compare solutions of the same block; standard deviations are those of `result`."""
        attitudes = solution.photo_attitudes - result.photo_attitudes
        attitudes -= 2 * np.pi * np.round(attitudes / (2 * np.pi))
        photos = np.hstack([solution.photo_positions - result.photo_positions, attitudes])
        points = solution.point_positions - result.point_positions
        start = 2.0 * problem.graph.error(problem.initial)
        return cls(
            start=_relative(start, result.initial_weighted_sum_of_squares),
            end=_relative(solution.weighted_sum_of_squares, result.sums_of_squares.total),
            photos=float(np.abs(photos / result.photo_sd).max()),
            points=float(np.abs(points / result.point_sd).max()),
        )

    def __bool__(self) -> bool:
        sums = all(difference <= SUM_OF_SQUARES for difference in (self.start, self.end))
        return sums and all(difference <= STANDARD_DEVIATIONS for difference in (self.photos, self.points))


def _relative(value: float, reference: float) -> float:
    return abs(value / reference - 1.0)
