"""Sums of squares and of redundancy numbers over kinds of observations."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass

__all__ = ["Redundancies", "SumsByKind", "SumsOfSquares"]


@dataclass(frozen=True)
class SumsByKind:
    """Sums over kinds of observations.

    Attributes
    ----------
    camera
        Of the weighted positions and attitudes of the photos, and of weighted parameters of cameras.
    ground
        Of the held components of control.
    plates
        Of the image coordinates.
    observations
        Of the observations beside images.
    """

    camera: float
    ground: float
    plates: float
    observations: float = 0.0

    @property
    def measured(self) -> float:
        """Of all but photos."""
        return self.ground + self.plates + self.observations

    @property
    def total(self) -> float:
        """All together."""
        return self.camera + self.ground + self.plates + self.observations


class SumsOfSquares(SumsByKind):
    """Weighted sums of squares."""


class Redundancies(SumsByKind):
    """Sums of redundancy numbers."""
