"""The options of data snooping."""

from __future__ import annotations

from typing import Literal

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass

UnitWeight = Literal["known", "unknown"]


@dataclass(frozen=True, kw_only=True)
class SnoopOptions(Checked):
    """Options of :func:`photogram.snoop`, some of which are options of `photogram adjust --snoop`.

    Attributes
    ----------
    level
        Probability of removing any correct observation from a network without gross errors (Bonferroni). The
        number of tests is the initial one in all rounds.
    fdr
        False discovery rate instead of `level`: the critical value depends on the number of removed groups.
    unit_weight
        `known`: the given standard deviations are correct, and tests are chi-square. `unknown`: they are
        correct up to a common factor, and tests are F. With `known`, the median of all test values may show
        that standard deviations are too small. If the factor exceeds 2, it is applied for the tests.
    robust
        Whether to start from a robust adjustment (Huber's, then Cauchy's loss), whose outliers are then
        tested. None: only if many observations disagree or the plain adjustment does not converge.
    parts
        Whether a part of a control point (height, plan) or of a weighted station can be removed. If False,
        the whole is removed.
    max_rounds
        Maximum number of rounds.

    Examples
    --------
    >>> from photogram import simulate, snoop
    >>> from photogram.results import SnoopOptions
    >>> block = simulate(strips=1, photos_per_strip=3, blunders=1, seed=1).block
    >>> len(snoop(block, SnoopOptions(level=0.01), unit_weight="unknown").removed)
    1
    """

    level: float = option(0.05, 0.0, 1.0, is_open=True)
    fdr: float | None = option(None, 0.0, 1.0, is_open=True)
    unit_weight: UnitWeight = "known"
    robust: bool | None = None
    parts: bool = True
    max_rounds: int = option(20, 1)

    @property
    def is_known(self) -> bool:
        """Whether the unit weight is known: chi-square decides, otherwise F."""
        return self.unit_weight == "known"

    @property
    def control(self) -> str:
        """Parts of control points that may be removed alone, as in the core."""
        return "plan and height" if self.parts else "whole"
