"""Groups tested one after the other, each as if those before it were out, without a new adjustment.

With v and R the residuals of unit weight of some rows and their cofactors, and S the rows that go,

    v <- v - R_S R_SS^- v_S,    R <- R - R_S R_SS^- R_S',    Omega <- Omega - T_S,    f <- f - m'_S

is what an adjustment without S gives in a linear model (specification of snooping: Hadi and Simonoff 1993).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.statistics.groups import INVISIBLE, GroupTests, group_tests

__all__ = ["Chosen", "Conditional", "UnitWeight"]

SAME = 1e-6
"""Relative; test values that differ by less are equal, and the order of the input decides."""


@dataclass(frozen=True)
class UnitWeight:
    """What the tests rest on.

    Attributes
    ----------
    known
        Whether the unit weight is known: chi-square, else F.
    weighted_sum_of_squares, degrees_of_freedom
        Omega and f.
    """

    known: bool
    weighted_sum_of_squares: float
    degrees_of_freedom: float

    def without(self, statistic: float, dimension: int) -> UnitWeight:
        """Return the same when a group is out."""
        left = max(self.weighted_sum_of_squares - statistic, 1e-12 * self.weighted_sum_of_squares)
        return UnitWeight(self.known, left, self.degrees_of_freedom - dimension)

    def fisher(self, statistic: float, dimension: int) -> float:
        """Return F of a group."""
        others = self.without(statistic, dimension)
        if dimension == 0 or not others.degrees_of_freedom > 0:
            return math.nan
        return statistic / dimension / (others.weighted_sum_of_squares / others.degrees_of_freedom)

    def odds(self, first: tuple[float, int], second: tuple[float, int]) -> float:
        """Return the odds of one group against another: T and m' of each (Akaike weights)."""
        (t, m), (other, n) = first, second
        if self.known:
            exponent = (t - other) / 2
        else:
            omega = self.weighted_sum_of_squares
            left = [max(omega - each, 1e-12 * omega) for each in (other, t)]
            exponent = self.degrees_of_freedom / 2 * math.log(left[0] / left[1])
        return math.exp(min(exponent - (m - n), 700.0))


@dataclass(frozen=True)
class Chosen:
    """A group, or a part of one, that was chosen.

    Attributes
    ----------
    group
        Its place among the groups of the block.
    rows
        The rows of the block that go.
    statistic, dimension, log_probability, fisher
        Of these rows.
    error, cofactors
        Their estimated errors, of unit weight, and the cofactors of these.
    rivals
        Places of groups that were significant before and are not after, with T, m' and odds.
    """

    group: int
    rows: Indices
    statistic: float
    dimension: int
    log_probability: float
    fisher: float
    error: Floats
    cofactors: Floats
    rivals: tuple[tuple[int, float, int, float], ...]


class Conditional:
    """Groups of some rows whose R is known as a whole.

    Parameters
    ----------
    residuals
        (m,) of unit weight.
    cofactors
        (m, m) R.
    groups
        The rows of each group.
    scales
        What the variances of each group are multiplied by before it is tested (k^2).
    unit
        Of all that takes part.
    """

    def __init__(
        self,
        residuals: Floats,
        cofactors: Floats,
        groups: Sequence[Indices],
        scales: Floats,
        unit: UnitWeight,
    ) -> None:
        self.v = np.array(residuals)
        self.r = np.array(cofactors)
        self.groups = groups
        self.scales = scales
        self.unit = unit
        size = max((len(rows) for rows in groups), default=1)
        self._rows = np.full((len(groups), size), -1)
        for place, rows in enumerate(groups):
            self._rows[place, : len(rows)] = rows
        self.tests = self._tested()

    def _tested(self) -> GroupTests:
        there = self._rows >= 0
        rows = np.where(there, self._rows, 0)
        v = np.where(there, self.v[rows], math.nan) / np.sqrt(self.scales)[:, np.newaxis]
        r = self.r[rows[:, :, np.newaxis], rows[:, np.newaxis, :]]
        return group_tests(
            r,
            v,
            self.unit.weighted_sum_of_squares,
            self.unit.degrees_of_freedom,
            known=self.unit.known,
        )

    def best(self, allowed: Bools) -> int | None:
        """Return the place of the least probable group that is allowed; of equals the first."""
        log_p = np.where(allowed & (self.tests.dimension > 0), self.tests.log_probability, math.inf)
        log_p = np.where(np.isnan(log_p), math.inf, log_p)
        least = log_p.min(initial=math.inf)
        if math.isinf(least) and least > 0:
            return None
        return int(np.flatnonzero(log_p <= least + SAME * max(abs(least), 1.0))[0])

    def part(self, place: int, parts: Sequence[Sequence[int]] | None) -> Indices:
        """Return the rows of a group that are least probable: one of its parts, or all."""
        rows = self.groups[place]
        if parts is None:
            return rows
        choices = [np.asarray(part, dtype=np.int64) for part in parts]
        tests = [self._of(rows[part], place) for part in choices]
        log_p = [float(test.log_probability[0]) for test in tests]
        return rows[choices[int(np.nanargmin(log_p))]] if not np.isnan(log_p).all() else rows

    def _of(self, rows: Indices, place: int) -> GroupTests:
        unit = self.unit
        return group_tests(
            self.r[np.ix_(rows, rows)][np.newaxis],
            self.v[rows][np.newaxis] / math.sqrt(self.scales[place]),
            unit.weighted_sum_of_squares,
            unit.degrees_of_freedom,
            known=unit.known,
        )

    def choose(self, place: int, rows: Indices, allowed: Bools, log_limit: float) -> Chosen:
        """Take rows of a group out, and test the others without them."""
        test, before, unit = self._of(rows, place), self.tests, self.unit
        scale = float(self.scales[place])
        statistic, dimension = scale * float(test.statistic[0]), int(test.dimension[0])
        self._condition(rows)
        self.unit = unit.without(statistic, dimension)
        self.tests = after = self._tested()
        significant = allowed & (before.log_probability < log_limit)
        still = (after.dimension > 0) & (after.log_probability < log_limit)
        rivals = [
            (other, float(t), int(m), unit.odds((statistic / scale, dimension), (float(t), int(m))))
            for other in np.flatnonzero(significant & ~still).tolist()
            if other != place
            for t, m in [(before.statistic[other], before.dimension[other])]
        ]
        near = sorted((rival for rival in rivals if rival[3] < RIVAL), key=lambda rival: rival[3])
        return Chosen(
            group=place,
            rows=rows,
            statistic=statistic,
            dimension=dimension,
            log_probability=float(test.log_probability[0]),
            fisher=unit.fisher(statistic, dimension),
            error=test.error[0] * math.sqrt(scale),
            cofactors=test.cofactors[0],
            rivals=tuple(near),
        )

    def _condition(self, rows: Indices) -> None:
        values, vectors = np.linalg.eigh(self.r[np.ix_(rows, rows)])
        seen = values > INVISIBLE
        half = vectors[:, seen] / np.sqrt(values[seen])
        along = self.r[:, rows] @ half
        self.v -= along @ (half.T @ self.v[rows])
        self.r -= along @ along.T
        self.v[rows] = 0.0


RIVAL = 20.0
"""Odds from which on another group is no rival."""
