"""What the movement test finds: movements between the groups of exposures, and the solution without them."""

from __future__ import annotations

from dataclasses import dataclass

from photogram.stellar.state import Solved

__all__ = ["Combined", "Movement"]


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
class Combined:
    """A solution whose attitudes are constrained to common values, not iterated again.

    Attributes
    ----------
    pairs
        The pairs that the movement test found equal.
    solved
        Parameters, cofactors and residuals.
    constraints
        Number of constraints, which join the degrees of freedom.
    mean_error
        Of unit weight, with these degrees of freedom.
    """

    pairs: tuple[tuple[str, str], ...]
    solved: Solved
    constraints: int
    mean_error: float
