"""What goes in a round: exactly where R of all rows can be had, else by a bound of what others do to it.

Where R of all rows is too large, groups go in one round when no chosen one is on their point and

    sqrt T_j - sum over the chosen i of sqrt(h_i h_j T_i)  >  sqrt of the limit

with h of the sharp bound of correlations (`Tests.shared`): what is left of j is significant whatever the
chosen do to it. Only what shares a photo counts. Groups of one point are conditioned exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.statistics.distributions import LEVEL, critical_chi_square, critical_fisher
from photogram.statistics.snooping.conditioning import Chosen, Conditional, UnitWeight
from photogram.statistics.snooping.suspects import Suspects, Tests, Trial

__all__ = ["Choice", "Level", "choose", "hides"]

ON_POINT = 2
"""Groups that go from one point in a round, at the most, where R of all rows is too large."""
AHEAD = 10
"""Groups that are taken out regardless, at the most, to see whether they hide each other."""


@dataclass(frozen=True)
class Level:
    """Which probabilities are too small.

    Attributes
    ----------
    family
        For all tests together (Bonferroni), or the false discovery rate.
    tests
        Their number at the start: it is kept.
    stepping
        Whether the limit rises with what is out: that of step k is k times that of the first.
    """

    family: float
    tests: int
    stepping: bool = False

    def limit(self, out: int) -> float:
        """Return the limit for the next group when so many are out."""
        steps = out + 1 if self.stepping else 1
        return min(self.family * steps / max(self.tests, 1), 0.5)


@dataclass(frozen=True)
class Choice:
    """A group that goes in a round.

    Attributes
    ----------
    group
        Its number among all.
    first_statistic
        T at the start of the round.
    chosen
        What its test says; rows and rivals by their numbers among all.
    limit
        The level that it was compared with.
    """

    group: int
    first_statistic: float
    chosen: Chosen
    limit: float


def choose(
    trial: Trial,
    tests: Tests,
    unit: UnitWeight,
    scales: Floats,
    allowed: Bools,
    level: Level,
    out: int,
    ahead: bool,
) -> list[Choice]:
    """Choose what goes in a round, in the order in which it goes.

    Parameters
    ----------
    tests
        Of all groups, nothing of this round being out.
    unit
        Of all that takes part.
    scales
        (G,) k^2 of each group.
    allowed
        (G,) which may go.
    level
        Which probabilities are too small.
    out
        How many groups are out already.
    ahead
        Whether to look for groups that hide each other where none is significant.
    """
    allowed = allowed & tests.active
    if trial.whole:
        residuals, response = trial.response()
        suspects = trial.suspects
        rows = [suspects.rows(group) for group in range(len(suspects))]
        every = np.arange(len(suspects))[np.newaxis]
        conditional = Conditional(residuals[np.newaxis], response[np.newaxis], rows, scales[np.newaxis], unit)
        return _sequences(suspects, conditional, every, tests, allowed, level, out, ahead)[0]
    return _bounded(trial, tests, unit, scales, allowed, level, out, ahead)


def _sequences(
    suspects: Suspects,
    conditional: Conditional,
    groups: Indices,
    tests: Tests,
    allowed: Bools,
    level: Level,
    out: int,
    ahead: bool,
    most: float = math.inf,
) -> list[list[Choice]]:
    """Take out of each block one group after the other while the next is significant, or hides one that is.

    `groups`: (n, K) the numbers of the groups of each block.
    """
    found: list[list[Choice]] = [[] for _ in groups]
    sure = np.zeros(len(groups), dtype=np.int64)
    left = allowed[groups]
    going = np.arange(len(groups))
    step = 0
    while going.size and step < most:
        limit = level.limit(out + step)
        places = conditional.best(left)[going]
        going, places = going[places >= 0], places[places >= 0]
        significant = conditional.log_probability[going, places] < math.log(limit)
        further = significant.copy()
        if ahead:
            within = step - sure[going] < AHEAD
            hidden = [
                hides(conditional.units[block], float(conditional.scales[block, place]))
                for block, place in zip(going, places, strict=True)
            ]
            further |= within & np.array(hidden, dtype=bool)
        going, places, significant = going[further], places[further], significant[further]
        if not going.size:
            break
        rows = conditional.rows[places].copy()
        for i, (block, place) in enumerate(zip(going.tolist(), places.tolist(), strict=True)):
            parts = suspects.parts(int(groups[block, place]))
            if parts is not None:
                rows[i] = conditional.part(block, place, parts)
        limits = np.full(len(going), math.log(limit))
        chosen = conditional.choose(going, places, rows, left, limits)
        left[going, places] = False
        step += 1
        sure[going[significant]] = step
        for block, own in zip(going.tolist(), chosen, strict=True):
            group = int(groups[block, own.group])
            found[block].append(Choice(group, float(tests.statistic[group]), own, limit))
    return [own[: sure[block]] for block, own in enumerate(found)]


def hides(unit: UnitWeight, scale: float) -> bool:
    """Whether there may be gross errors although no group is significant.

    With a known unit weight the global test says so; without, nothing speaks against it.
    """
    if not unit.known:
        return True
    if not unit.degrees_of_freedom > 0:
        return False
    critical = _critical_sum(unit.degrees_of_freedom)
    return unit.weighted_sum_of_squares / scale > critical


def _bounded(
    trial: Trial,
    tests: Tests,
    unit: UnitWeight,
    scales: Floats,
    allowed: Bools,
    level: Level,
    out: int,
    ahead: bool,
) -> list[Choice]:
    suspects = trial.suspects
    limit = level.limit(out)
    beyond = _beyond(tests, unit, scales, limit)
    candidates = np.flatnonzero(allowed & beyond)
    if not candidates.size and ahead:
        ratio = np.where(allowed, tests.statistic / scales, -math.inf)
        candidates = np.argsort(-np.nan_to_num(ratio, nan=-math.inf), kind="stable")[:AHEAD]
        candidates = candidates[allowed[candidates]]
    found = _on_points(trial, tests, unit, scales, allowed, level, out, candidates, ahead)
    found.sort(key=lambda choice: (choice.chosen.log_probability, -choice.chosen.statistic, choice.group))
    load = _Load(suspects, tests)
    kept = []
    for choice in found:
        critical = _critical(unit, choice.chosen.dimension, limit) * scales[choice.group]
        if load.leaves(choice, critical):
            load.add(choice)
            kept.append(choice)
    return kept


def _beyond(tests: Tests, unit: UnitWeight, scales: Floats, limit: float) -> Bools:
    """Return which groups have a T beyond the limit."""
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
    """Return the limit of T: of chi-square, or of F solved for T."""
    if unit.known:
        return critical_chi_square(limit, dimension)
    others = unit.degrees_of_freedom - dimension
    if not others > 0:
        return math.inf
    ratio = dimension * critical_fisher(limit, dimension, others) / others
    return unit.weighted_sum_of_squares * ratio / (1 + ratio)


def _on_points(
    trial: Trial,
    tests: Tests,
    unit: UnitWeight,
    scales: Floats,
    allowed: Bools,
    level: Level,
    out: int,
    candidates: Indices,
    ahead: bool,
) -> list[Choice]:
    """Choose on the point of each candidate; of a candidate without a point, itself."""
    suspects = trial.suspects
    first: dict[int, int] = {}
    for group in candidates.tolist():
        point = int(suspects.points[group])
        first.setdefault(point if point >= 0 else -1 - group, group)
    all_sizes = np.diff(suspects.row_starts)
    alike: dict[tuple[int, ...], list[tuple[list[int], Floats, Floats]]] = {}
    for own in trial.blocks(list(first.values())):
        sizes = tuple(all_sizes[own[0]].tolist())
        alike.setdefault(sizes, []).append(own)
    found = []
    for sizes, blocks in alike.items():
        starts = np.concatenate([[0], np.cumsum(sizes)])
        rows = [np.arange(a, b) for a, b in pairwise(starts.tolist())]
        groups = np.array([own[0] for own in blocks], dtype=np.int64)
        residuals, response = np.stack([own[1] for own in blocks]), np.stack([own[2] for own in blocks])
        conditional = Conditional(residuals, response, rows, scales[groups], unit)
        chosen = _sequences(suspects, conditional, groups, tests, allowed, level, out, ahead, most=ON_POINT)
        for places, choices in zip(groups, chosen, strict=True):
            offsets = suspects.row_starts[places] - starts[:-1]
            found += [_among_all(choice, places, offsets) for choice in choices]
    return found


def _among_all(choice: Choice, places: Indices, offsets: Indices) -> Choice:
    """Count rows and rivals among all."""
    own = choice.chosen
    rivals = tuple((int(places[place]), *rest) for place, *rest in own.rivals)
    moved = Chosen(
        group=choice.group,
        rows=own.rows + offsets[own.group],
        statistic=own.statistic,
        dimension=own.dimension,
        log_probability=own.log_probability,
        fisher=own.fisher,
        error=own.error,
        cofactors=own.cofactors,
        rivals=rivals,  # type: ignore[arg-type]
    )
    return Choice(choice.group, choice.first_statistic, moved, choice.limit)


class _Load:
    """What the chosen may do to the test values of others, by photo: the sum of sqrt(h_i T_i)."""

    def __init__(self, suspects: Suspects, tests: Tests) -> None:
        self.suspects, self.tests = suspects, tests
        self.of_photo: dict[int, float] = {}

    def _shared(self, group: int) -> float:
        shared = float(self.tests.shared[group])
        return 0.0 if math.isnan(shared) else shared

    def _photos(self, group: int) -> list[int]:
        """Return the photo of a group; those that its point is seen from where it has none."""
        photo = int(self.suspects.photos[group])
        return [photo] if photo >= 0 else self.suspects.loads(group).tolist()

    def leaves(self, choice: Choice, critical: float) -> bool:
        """Whether a group is significant whatever the chosen do to it."""
        group = choice.group
        load = max((self.of_photo.get(each, 0.0) for each in self._photos(group)), default=0.0)
        left = math.sqrt(max(choice.chosen.statistic, 0.0)) - math.sqrt(self._shared(group)) * load
        return left > math.sqrt(critical) or (load == 0.0)

    def add(self, choice: Choice) -> None:
        """Count a group that was chosen."""
        size = math.sqrt(self._shared(choice.group) * max(choice.chosen.statistic, 0.0))
        for each in self._photos(choice.group):
            self.of_photo[each] = self.of_photo.get(each, 0.0) + size
