"""Conditional tests of groups, each after the removal of the previous ones.

v and R are the residuals of unit weight of some rows and their cofactors, and S are the removed rows. Then

    v <- v - R_S R_SS^- v_S,    R <- R - R_S R_SS^- R_S',    Omega <- Omega - T_S,    f <- f - m'_S

is the result of an adjustment without S in a linear model (Hadi and Simonoff 1993).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.groups import INVISIBLE, GroupTests, group_tests

SAME = 1e-3
"""Relative difference of equal log-probabilities, for which the input order decides.

Observations of a point on two photos differ only by the convergence error of the adjustment."""


@dataclass(frozen=True)
class UnitWeight:
    """Unit weight of the tests."""

    known: bool  # Whether the unit weight is known: chi-square, otherwise F
    weighted_sum_of_squares: float  # Omega and f
    degrees_of_freedom: float

    def without(self, statistic: float, dimension: int) -> UnitWeight:
        """Return the unit weight without a group."""
        left = max(self.weighted_sum_of_squares - statistic, 1e-12 * self.weighted_sum_of_squares)
        return UnitWeight(self.known, left, self.degrees_of_freedom - dimension)

    def fisher(self, statistic: float, dimension: int) -> float:
        others = self.without(statistic, dimension)
        if dimension == 0 or not others.degrees_of_freedom > 0:
            return math.nan
        left = others.weighted_sum_of_squares / others.degrees_of_freedom
        return statistic / dimension / left if left > 0 else math.inf

    def odds(self, first: tuple[float, int], second: tuple[float, int]) -> float:
        """Return the likelihood ratio of two groups from T and m' (Akaike weights).

        T refers to linear equations. A large error has a nonlinear effect of the order T^(3/2), which is
        removed from the difference of two T.
        """
        (t, m), (other, n) = first, second
        bent = BENT * max(t, other) ** 1.5
        other = t + math.copysign(max(abs(other - t) - bent, 0.0), other - t)
        if self.known:
            exponent = (t - other) / 2
        else:
            omega = self.weighted_sum_of_squares
            left = [max(omega - each, 1e-12 * omega, sys.float_info.min) for each in (other, t)]
            exponent = self.degrees_of_freedom / 2 * math.log(left[0] / left[1])
        return math.exp(min(exponent - (m - n), 700.0))


@dataclass(frozen=True)
class Chosen:
    """A selected group, or a part of one."""

    group: int  # Number among the groups of the block
    rows: Indices  # The removed rows of the block
    statistic: float  # T of these rows
    dimension: int
    log_probability: float
    fisher: float
    error: Floats  # Their estimated errors, of unit weight, with cofactors
    cofactors: Floats
    # Groups that were significant only before the removal, with T, m' and likelihood ratio
    rivals: tuple[tuple[int, float, int, float], ...]
    first_statistic: float = math.nan  # T at the start of the round
    limit: float = math.nan  # the level it was compared with


class Conditional:
    """n blocks of rows, each with the same groups and known R."""

    def __init__(
        self,
        residuals: Floats,
        cofactors: Floats,
        groups: Sequence[Indices],
        scales: Floats,
        units: Sequence[UnitWeight],
    ) -> None:
        self.v, self.r, self.scales = np.array(residuals), np.array(cofactors), scales
        self.units = list(units)
        size = max((len(rows) for rows in groups), default=1)
        self.rows = np.full((len(groups), size), -1)
        for place, rows in enumerate(groups):
            self.rows[place, : len(rows)] = rows
        count = (len(self.v), len(groups))
        self.log_probability: Floats = np.full(count, math.nan)
        self.statistic: Floats = np.zeros(count)
        self.dimension: Indices = np.zeros(count, dtype=np.int64)
        self._test(np.arange(len(self.v)))

    def _test(self, blocks: Indices) -> None:
        """Test all groups of some blocks."""
        places = np.tile(np.arange(len(self.rows)), len(blocks))
        found = self._of(np.repeat(blocks, len(self.rows)), self.rows[places], places)
        shape = (len(blocks), len(self.rows))
        self.log_probability[blocks] = found.log_probability.reshape(shape)
        self.statistic[blocks] = found.statistic.reshape(shape)
        self.dimension[blocks] = found.dimension.reshape(shape)

    def _of(self, blocks: Indices, rows: Indices, places: Indices) -> GroupTests:
        """Test rows of blocks: (b,), (b, g) with -1 for none, and their groups."""
        there = rows >= 0
        rows = np.where(there, rows, 0)
        at = blocks[:, np.newaxis]
        scale = np.sqrt(self.scales[blocks, places])[:, np.newaxis]
        v = np.where(there, self.v[at, rows] / scale, math.nan)
        r = self.r[at[:, :, np.newaxis], rows[:, :, np.newaxis], rows[:, np.newaxis, :]]
        units = [self.units[block] for block in blocks] if not self.units[0].known else self.units[:1]
        omega = np.array([unit.weighted_sum_of_squares for unit in units])
        freedom = np.array([unit.degrees_of_freedom for unit in units])
        return group_tests(r, v, omega, freedom, known=self.units[0].known)

    def best(self, allowed: Bools) -> Indices:
        """Return (n,) the first least probable allowed groups; -1 without any."""
        possible = allowed & (self.dimension > 0) & ~np.isnan(self.log_probability)
        log_p = np.where(possible, self.log_probability, math.inf)
        least = log_p.min(axis=1, initial=math.inf)
        equal = log_p <= (least + SAME * np.maximum(np.abs(least), 1.0))[:, np.newaxis]
        return np.asarray(np.where(np.isfinite(least), equal.argmax(axis=1), -1))

    def part(self, block: int, place: int, parts: Sequence[Sequence[int]]) -> Indices:
        """Return the rows (padded by -1) of the least probable part of a group."""
        choices = np.full((len(parts), self.rows.shape[1]), -1)
        for choice, part in zip(choices, parts, strict=True):
            choice[: len(part)] = self.rows[place, list(part)]
        places = np.full(len(parts), place)
        log_p = self._of(np.full(len(parts), block), choices, places).log_probability
        return np.asarray(
            choices[int(np.nanargmin(log_p))] if not np.isnan(log_p).all() else self.rows[place]
        )

    def choose(
        self, blocks: Indices, places: Indices, rows: Indices, allowed: Bools, log_limit: Floats
    ) -> list[Chosen]:
        """Remove rows of one group per block, and test the others without them.

        Rows are padded by -1.
        """
        test = self._of(blocks, rows, places)
        scale = self.scales[blocks, places]
        before = (
            self.log_probability[blocks].copy(),
            self.statistic[blocks].copy(),
            self.dimension[blocks].copy(),
        )
        units = [self.units[block] for block in blocks]
        statistic = scale * test.statistic
        for block, unit, t, m in zip(blocks, units, statistic, test.dimension, strict=True):
            self.units[block] = unit.without(float(t), int(m))
        self._condition(blocks, rows)
        self._test(blocks)
        limit = np.asarray(log_limit)[:, np.newaxis]
        with np.errstate(invalid="ignore"):
            still = (self.dimension[blocks] > 0) & (self.log_probability[blocks] < limit)
            fallen = allowed[blocks] & (before[0] < limit) & ~still
        fallen[np.arange(len(blocks)), places] = False
        found = []
        for i, unit in enumerate(units):
            own = (float(test.statistic[i]), int(test.dimension[i]))
            rivals = [
                (other, float(before[1][i, other]), int(before[2][i, other]))
                for other in np.flatnonzero(fallen[i]).tolist()
            ]
            near = [(*rival, unit.odds(own, rival[1:])) for rival in rivals]
            there = rows[i] >= 0
            found.append(
                Chosen(
                    group=int(places[i]),
                    rows=rows[i][there],
                    statistic=float(statistic[i]),
                    dimension=own[1],
                    log_probability=float(test.log_probability[i]),
                    fisher=unit.fisher(float(statistic[i]), own[1]),
                    error=test.error[i][there] * math.sqrt(scale[i]),
                    cofactors=test.cofactors[i] if there.all() else test.cofactors[i][np.ix_(there, there)],
                    rivals=tuple(sorted((own for own in near if own[3] < RIVAL), key=lambda own: own[3])),
                )
            )
        return found

    def _condition(self, blocks: Indices, rows: Indices) -> None:
        there = rows >= 0
        places = np.where(there, rows, 0)
        at = blocks[:, np.newaxis]
        own = self.r[at[:, :, np.newaxis], places[:, :, np.newaxis], places[:, np.newaxis, :]]
        own = np.where(there[:, :, np.newaxis] & there[:, np.newaxis, :], own, 0.0)
        values, vectors = np.linalg.eigh(own)
        seen = values > INVISIBLE
        half = vectors * np.where(seen, 1.0 / np.sqrt(np.where(seen, values, 1.0)), 0.0)[:, np.newaxis, :]
        columns = np.take_along_axis(self.r[blocks], places[:, np.newaxis, :], axis=2)
        along = np.where(there[:, np.newaxis, :], columns, 0.0) @ half
        v = np.where(there, self.v[at, places], 0.0)
        self.v[blocks] -= (along @ (np.swapaxes(half, 1, 2) @ v[:, :, np.newaxis]))[:, :, 0]
        self.r[blocks] -= along @ np.swapaxes(along, 1, 2)
        flat = np.broadcast_to(at, places.shape)[there]
        self.v[flat, places[there]] = 0.0


BENT = 2e-5  # Largest effect of curvature on the difference of two T, in T^(3/2)
RIVAL = 20.0  # Smallest likelihood ratio against an alternative
