"""Iterations, and sums of squares and redundancy numbers by types."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass


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


@dataclass(frozen=True)
class SumsByKind:
    # Weighted positions and attitudes of the photos, and weighted parameters of cameras
    camera: float
    ground: float  # Weighted and fixed components of control
    plates: float  # Image coordinates
    observations: float = 0.0  # Additional observations

    @property
    def measured(self) -> float:
        """The sum without photos."""
        return self.ground + self.plates + self.observations

    @property
    def total(self) -> float:
        return self.camera + self.ground + self.plates + self.observations


class SumsOfSquares(SumsByKind):
    """Weighted sums of squares."""


class Redundancies(SumsByKind):
    """Sums of redundancy numbers."""
