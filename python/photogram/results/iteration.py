"""The iterations of an adjustment."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass

__all__ = ["Iteration"]


@dataclass(frozen=True)
class Iteration:
    """One iteration.

    Attributes
    ----------
    number
        From 1.
    weighted_sum_of_squares
        After its corrections.
    largest_change
        No unknown changed by more than this multiple of its standard deviation (a priori unit weight).
    damping
        Levenberg-Marquardt damping of its step; 0 for a Gauss-Newton step.
    """

    number: int
    weighted_sum_of_squares: float
    largest_change: float
    damping: float
