"""Selection of groups to remove in a round: exact with complete R, else bounded.

If R of all rows is too large, several groups are removed in one round. No other removed group may be on the
same point, and each must satisfy

    sqrt T_j - sum over the chosen i of sqrt(h_i h_j T_i)  >  sqrt of the limit

with h of the sharp bound of correlations (`Tests.shared`). Then the remainder of j is significant for any
effect of the chosen groups. Only groups that share a photo count. Groups of one point are conditioned
exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.statistics.distributions import LEVEL, critical_chi_square, critical_fisher
from photogram.statistics.snooping.conditioning import Chosen, Conditional, UnitWeight
from photogram.statistics.snooping.suspects import Suspects, Tests, Trial

ON_POINT = 2  # Largest number of removals on one point in a round without R of all rows
AHEAD = 10  # Largest number of trial removals that search for masked errors


@dataclass(frozen=True)
class Level:
    """Significance level of the groups.

    Attributes
    ----------
    family
        Joint level of all tests (Bonferroni), or the false discovery rate.
    tests
        Number of tests at the start, which is not changed.
    stepping
        True if the limit increases with the removals: step k has k times the limit of the first.
    """

    family: float
    tests: int
    stepping: bool = False

    def limit(self, out: int) -> float:
        """Return the limit for the next group after `out` removals."""
        steps = out + 1 if self.stepping else 1
        return min(self.family * steps / max(self.tests, 1), 0.5)


@dataclass(frozen=True, eq=False)
class Choosing:
    """Candidates and criteria of a round."""

    trial: Trial  # The network
    tests: Tests  # Tests of all groups at the start of the round
    unit: UnitWeight  # Unit weight of all included observations
    scales: Floats  # (G,) k^2 of each group
    allowed: Bools  # (G,) groups that may be removed
    level: Level  # Significance level
    out: int  # Number of removed groups
    ahead: bool  # Whether to search for masked groups if none is significant

    @property
    def suspects(self) -> Suspects:
        return self.trial.suspects

    def choose(self) -> list[Chosen]:
        """Return the groups to remove in a round, in the order of removal."""
        if not self.trial.whole:
            return self._bounded()
        residuals, response = self.trial.response()
        groups = range(len(self.suspects))
        rows = [self.suspects.rows(group) for group in groups]
        conditional = Conditional(
            residuals[np.newaxis], response[np.newaxis], rows, self.scales[np.newaxis], [self.unit]
        )
        return self._sequences(conditional, np.array([groups]))[0]

    def on_gone_points(self, points: Sequence[int]) -> tuple[list[Chosen], set[int]]:
        """Select groups on points that are excluded with all their observations.

        Each is tested against the photos as determined by the others. Returns the selection, and the points
        that could be tested.
        """
        blocks = [own for own in self.trial.gone_blocks(points) if own[0]]
        units = [self._with_own(residuals, response) for _, residuals, response in blocks]
        judged = {int(self.suspects.points[groups[0]]) for groups, _, _ in blocks}
        return self._on_blocks(blocks, units), judged

    def _with_own(self, residuals: Floats, response: Floats) -> UnitWeight:
        """Return the unit weight including an excluded point."""
        unit, own = self.unit, float(residuals @ np.linalg.pinv(response, hermitian=True) @ residuals)
        return UnitWeight(
            unit.known,
            unit.weighted_sum_of_squares + own,
            unit.degrees_of_freedom + np.linalg.matrix_rank(response, hermitian=True),
        )

    def _sequences(
        self, conditional: Conditional, groups: Indices, most: float = math.inf
    ) -> list[list[Chosen]]:
        """Select groups of each block while the next is significant or masks one.

        `groups` are (n, K) numbers of the groups of each block.
        """
        found: list[list[Chosen]] = [[] for _ in groups]
        sure = np.zeros(len(groups), dtype=np.int64)
        left = self.allowed[groups]
        going = np.arange(len(groups))
        step = 0
        while going.size and step < most:
            limit = self.level.limit(self.out + step)
            places = conditional.best(left)[going]
            going, places = going[places >= 0], places[places >= 0]
            significant = conditional.log_probability[going, places] < math.log(limit)
            further = significant.copy()
            if self.ahead:
                for at in np.flatnonzero(~significant & (step - sure[going] < AHEAD)).tolist():
                    block, place = going[at], places[at]
                    further[at] = hides(conditional.units[block], float(conditional.scales[block, place]))
            going, places, significant = going[further], places[further], significant[further]
            if not going.size:
                break
            rows = conditional.rows[places].copy()
            for i, (block, place) in enumerate(zip(going.tolist(), places.tolist(), strict=True)):
                parts = self.suspects.parts(int(groups[block, place]))
                if parts is not None:
                    rows[i] = conditional.part(block, place, parts)
            limits = np.full(len(going), math.log(limit))
            chosen = conditional.choose(going, places, rows, left, limits)
            left[going, places] = False
            step += 1
            sure[going[significant]] = step
            for block, own in zip(going.tolist(), chosen, strict=True):
                first = float(self.tests.statistic[groups[block, own.group]])
                found[block].append(replace(own, first_statistic=first, limit=limit))
        return [own[: sure[block]] for block, own in enumerate(found)]

    def _bounded(self) -> list[Chosen]:
        limit = self.level.limit(self.out)
        candidates = np.flatnonzero(self.allowed & beyond(self.tests, self.unit, self.scales, limit))
        if not candidates.size and self.ahead:
            ratio = np.where(self.allowed, self.tests.statistic / self.scales, -math.inf)
            candidates = np.argsort(-np.nan_to_num(ratio, nan=-math.inf), kind="stable")[:AHEAD]
            candidates = candidates[self.allowed[candidates]]
        found = self._on_points(candidates)
        found.sort(key=lambda choice: (choice.log_probability, -choice.statistic, choice.group))
        load = _Load(self.suspects, self.tests)
        kept = []
        for choice in found:
            critical = _critical(self.unit, choice.dimension, limit) * self.scales[choice.group]
            if load.leaves(choice, critical):
                load.add(choice)
                kept.append(choice)
        return kept

    def _on_points(self, candidates: Indices) -> list[Chosen]:
        """Select on the point of each candidate, or a candidate without a point itself."""
        first: dict[int, int] = {}
        for group in candidates.tolist():
            point = int(self.suspects.points[group])
            first.setdefault(point if point >= 0 else -1 - group, group)
        blocks = self.trial.blocks(list(first.values()))
        return self._on_blocks(blocks, [self.unit] * len(blocks), most=ON_POINT)

    def _on_blocks(
        self,
        blocks: Sequence[tuple[list[int], Floats, Floats]],
        units: Sequence[UnitWeight],
        most: float = math.inf,
    ) -> list[Chosen]:
        """Select in blocks with known R; blocks of equal group sizes together."""
        all_sizes = np.diff(self.suspects.row_starts)
        alike: dict[tuple[int, ...], list[int]] = {}
        for place, (groups, _, _) in enumerate(blocks):
            alike.setdefault(tuple(all_sizes[groups].tolist()), []).append(place)
        found = []
        for sizes, places in alike.items():
            starts = np.concatenate([[0], np.cumsum(sizes)])
            rows = [np.arange(a, b) for a, b in pairwise(starts.tolist())]
            own = [blocks[place] for place in places]
            numbers = np.array([each[0] for each in own], dtype=np.int64)
            residuals, response = np.stack([each[1] for each in own]), np.stack([each[2] for each in own])
            unit = [units[place] for place in places]
            conditional = Conditional(residuals, response, rows, self.scales[numbers], unit)
            for every, choices in zip(numbers, self._sequences(conditional, numbers, most), strict=True):
                offsets = self.suspects.row_starts[every] - starts[:-1]
                found += [_among_all(choice, every, offsets) for choice in choices]
        return found


def hides(unit: UnitWeight, scale: float) -> bool:
    """Whether there may be gross errors although no group is significant.

    The global test decides if the unit weight is known; otherwise always True.
    """
    if not unit.known:
        return True
    if not unit.degrees_of_freedom > 0:
        return False
    critical = _critical_sum(unit.degrees_of_freedom)
    return unit.weighted_sum_of_squares / scale > critical


def beyond(tests: Tests, unit: UnitWeight, scales: Floats, limit: float) -> Bools:
    """Return (G,) groups whose T exceeds the limit."""
    critical = np.full(len(tests.rank), math.inf)
    for rank in np.unique(tests.rank[tests.rank > 0]).tolist():
        critical[tests.rank == rank] = _critical(unit, rank, limit)
    with np.errstate(invalid="ignore"):
        return np.asarray(tests.statistic > critical * scales)


@lru_cache
def _critical_sum(degrees_of_freedom: float) -> float:
    return critical_chi_square(LEVEL / 2, degrees_of_freedom)


@lru_cache
def _critical(unit: UnitWeight, dimension: int, limit: float) -> float:
    """Return the critical value of T: of chi-square, or of F solved for T."""
    if unit.known:
        return critical_chi_square(limit, dimension)
    others = unit.degrees_of_freedom - dimension
    if not others > 0:
        return math.inf
    ratio = dimension * critical_fisher(limit, dimension, others) / others
    return unit.weighted_sum_of_squares * ratio / (1 + ratio)


def _among_all(choice: Chosen, places: Indices, offsets: Indices) -> Chosen:
    """Convert row and alternative numbers from a block to all groups."""
    rivals = tuple((int(places[place]), t, m, odds) for place, t, m, odds in choice.rivals)
    rows = choice.rows + offsets[choice.group]
    return replace(choice, group=int(places[choice.group]), rows=rows, rivals=rivals)


class _Load:
    """Bound of effects on other test values by photo: the sum of sqrt(h_i T_i)."""

    def __init__(self, suspects: Suspects, tests: Tests) -> None:
        self.suspects, self.tests = suspects, tests
        self.of_photo: dict[int, float] = {}

    def _shared(self, group: int) -> float:
        shared = float(self.tests.shared[group])
        return 0.0 if math.isnan(shared) else shared

    def _photos(self, group: int) -> list[int]:
        """Return the photo of a group; without one, the photos that observe its point."""
        photo = int(self.suspects.photos[group])
        return [photo] if photo >= 0 else self.suspects.loads(group).tolist()

    def leaves(self, choice: Chosen, critical: float) -> bool:
        """Whether a group is significant for any effect of the selected groups."""
        group = choice.group
        load = max((self.of_photo.get(each, 0.0) for each in self._photos(group)), default=0.0)
        left = math.sqrt(max(choice.statistic, 0.0)) - math.sqrt(self._shared(group)) * load
        return left > math.sqrt(critical) or (load == 0.0)

    def add(self, choice: Chosen) -> None:
        """Add a selected group."""
        size = math.sqrt(self._shared(choice.group) * max(choice.statistic, 0.0))
        for each in self._photos(choice.group):
            self.of_photo[each] = self.of_photo.get(each, 0.0) + size
