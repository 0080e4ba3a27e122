"""Whether two calibrations differ by no more than their covariances say."""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import log_chi_square, log_fisher

__all__ = ["DifferenceTest"]

EXPLAINED = 0.01
"""Probability beyond which calibrations differ as they should."""


@dataclass(frozen=True)
class DifferenceTest:
    """The test of a difference of two calibrations.

    Attributes
    ----------
    name
        What differs.
    chi2, dof
        dk' cov(dk)^-1 dk over the variance of unit weight, and how many unknowns.
    probability
        Of a difference as large.
    """

    name: str
    chi2: float
    dof: int
    probability: float

    @classmethod
    def of(cls, name: str, chi2: float, dof: int, freedom: float = math.inf) -> Self:
        """Return the test of a difference; `freedom`: that of the unit weight, infinite where known."""
        known = math.isinf(freedom)
        logarithm = log_chi_square(chi2, dof) if known else log_fisher(chi2 / dof, dof, freedom)
        return cls(name, chi2, dof, float(np.exp(logarithm)))

    @property
    def explained(self) -> bool:
        """Whether the cofactors explain the difference."""
        return self.probability > EXPLAINED

    @property
    def factor(self) -> float:
        """By which the they differ more than their standard deviations say, in the mean."""
        return math.sqrt(self.chi2 / self.dof)
