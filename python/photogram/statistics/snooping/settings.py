"""How to snoop."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import LEVEL

__all__ = ["Settings"]


@dataclass(frozen=True)
class Settings:
    """How to snoop.

    Attributes
    ----------
    level
        Family level of all tests together, or the false discovery rate.
    fdr
        Whether it is the latter.
    known
        Whether the unit weight is known: chi-square decides, else F.
    robust
        Whether to start robustly; None where many observations are wrong.
    max_rounds
        Rounds at the most.
    """

    level: float = LEVEL
    fdr: bool = False
    known: bool = True
    robust: bool | None = None
    max_rounds: int = 20
