"""Variance components: joint estimation of factors of groups of observations.

Observations belong to groups g with the variances theta_g sd^2. For given theta, an adjustment results in the
weighted sum of squares q_g and the sum r_g of redundancy numbers of each group. R maps errors to residuals,
both in standard deviations. The Helmert matrix is H_gh = sum of R_ij^2 over i in g, j in h; its rows sum to
r_g. Then

    E q_g = sum_h H_gh theta_h (true) / theta_h (present),    Cov q = 2 H at the truth.

* Helmert (1907): solve H f = q, and multiply theta by f.
* Foerstner (1979): multiply theta_g by q_g / r_g. The fixed point q_g = r_g is the same, and maximises the
  restricted likelihood (Patterson and Thompson 1971). Components remain positive, and H is not needed.

The covariance of the logarithms is 2 H^-1. The module is independent of photographs: a function passed to
`estimate` adjusts with given factors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from photogram import _photocore
from photogram.arguments.fields import Checked, option
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.statistics.distributions import bonferroni, critical_normal
from photogram.words import Phrase

LEAST_REDUNDANCY = 5.0  # Smallest redundancy of a group with an estimated variance
LEAST_SHARE = 0.01  # Smallest ratio of the redundancy of a group and its number of observations
REFUSED = 1.0  # Smallest redundancy for any estimate of a variance
MOST_CONDITION = 100.0  # Of the Helmert matrix with unit diagonal
LIMIT_OF_STEP = 10.0  # Largest ratio of factors in a step
LOWER_BOUND = 0.01  # Smallest component, as a part of the given variance
BY_HELMERT = 5  # Interval of Helmert steps, since Foerstner's converge linearly
WORTH_CHANGING = (0.64, 1.56)  # Other factors change standard deviations by 25 percent
NODES = 4  # Nodes of the integral of the likelihood ratio


class Weighted(Protocol):
    """Result of an adjustment for G groups with given components."""

    counts: Indices  # (G,) observations
    squares: Floats  # (G,) weighted sums of squares, weights divided by the components
    redundancy: Floats  # (G,) sums of redundancy numbers

    def matrix(self) -> Floats:
        """Return the (G, G) Helmert matrix."""


@dataclass(frozen=True)
class GroupsOf:
    names: tuple[str, ...]  # (G,) of the groups
    # (G,) larger group that replaces a group whose component cannot be estimated, merged with all others of
    # the same name; empty for none
    parents: tuple[str, ...] = ()
    images: tuple[bool, ...] = ()  # (G,) whether they are of image coordinates
    # Reason for not estimating the component of a group, by its number
    held: dict[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Component:
    name: str  # Name of the group; of the larger group after merging
    members: tuple[str, ...]
    count: int  # observations; q and r with the last weights
    squares: float
    redundancy: float
    factor: float  # theta: the ratio of estimated and given variance
    # sd, least_sd: of the factor; the second from the redundancy alone, and smaller. NaN if fixed
    sd: float
    least_sd: float
    interval: tuple[float, float]  # 95 percent interval of the factor, derived from the logarithm
    # ln(theta) / its standard deviation, and the probability of a value at least as large
    test_value: float
    probability: float
    significant: bool  # Whether the probability is below the level over the number of components (Bonferroni)
    images: bool
    held: str  # reason for not estimating it; empty if estimated

    @property
    def factor_of_sd(self) -> float:
        return math.sqrt(self.factor)

    @property
    def interval_of_sd(self) -> tuple[float, float]:
        return math.sqrt(self.interval[0]), math.sqrt(self.interval[1])

    @property
    def worth_changing(self) -> bool:
        """Whether it is significant and far enough from 1 to affect weights."""
        low, high = WORTH_CHANGING
        return self.significant and not low <= self.factor <= high


@dataclass(frozen=True, eq=False)
class Estimate:
    components: tuple[Component, ...]  # Estimated and fixed ones
    factors: Floats  # (G,) theta of every given group
    matrix: Floats  # (k, k) Helmert matrix of the components at the end
    converged: bool  # Whether q_g = r_g was reached
    # For every step, the initial factors, q and r, (G,) each
    steps: list[tuple[Floats, Floats, Floats]]
    messages: list[Phrase]  # merged, fixed and negative components, with reasons
    # Likelihood ratio of equality of all estimated components, its degrees of freedom and probability; None
    # for less than two, or if not requested
    equality: tuple[float, int, float] | None
    level: float  # of all tests together

    @property
    def limit(self) -> float:
        """Critical value of the absolute test value of a component."""
        free = sum(not each.held for each in self.components)
        return critical_normal(bonferroni(self.level, free))

    @property
    def reference(self) -> float:
        """The component of all image coordinates together; 1 if there are none."""
        own = [each for each in self.components if each.images and each.redundancy > 0]
        weights = [each.redundancy for each in own]
        return float(np.average([each.factor for each in own], weights=weights)) if own else 1.0


def helmert_step(matrix: Floats, squares: Floats, free: list[int]) -> Floats:
    rows = np.array(free, dtype=np.int64)
    held = np.setdiff1d(np.arange(len(squares)), rows)
    right = squares[rows] - matrix[np.ix_(rows, held)].sum(axis=1)
    return np.asarray(np.linalg.solve(matrix[np.ix_(rows, rows)], right))


def balanced(matrix: Floats, redundancy: Floats, exact: Sequence[bool]) -> Floats:
    """Return a symmetric (G, G) Helmert matrix whose rows sum to the redundancy r (G,).

    Columns are exact (G,), and not changed, or were estimated with random signs.
    """
    sure = np.asarray(exact, dtype=bool)
    found = np.where(sure[:, np.newaxis] & ~sure, matrix.T, matrix)
    found = (found + found.T) / 2
    loose = np.flatnonzero(~sure)
    if not loose.size:
        return np.asarray(found)
    block = found[np.ix_(loose, loose)]
    aim = np.maximum(redundancy[loose] - found[np.ix_(loose, np.flatnonzero(sure))].sum(axis=1), 0.0)
    scale = np.ones(len(loose))
    for _ in range(100):
        sums = block @ scale
        scale = np.sqrt(scale * np.divide(aim, sums, out=np.zeros_like(aim), where=sums > 0))
    found[np.ix_(loose, loose)] = block * np.outer(scale, scale)
    return np.asarray(found)


@dataclass(frozen=True)
class Settings(Checked):
    # The iteration stops if no component changes by more than this part, or by more than a hundredth of its
    # standard deviation (and a hundred times this). A last Helmert step must then change none by more than a
    # hundred times this
    tolerance: float = option(1e-4, 0, 1, is_open=True)
    max_steps: int = option(100, 1)
    least_redundancy: float = LEAST_REDUNDANCY  # Of an estimated group
    level: float = 0.05  # Joint significance level of the tests against 1
    equality: bool = True  # Test that all are equal, with some additional adjustments


def estimate(
    adjust: Callable[[Floats], Weighted], groups: GroupsOf, settings: Settings | None = None
) -> Estimate:
    """Estimate variance components; `adjust` adjusts with (G,) of them, first with ones."""
    run = _Run(adjust, groups, settings or Settings())
    while not run.iterate():
        pass
    return run.finished()


class _Run:
    """The iteration, with groups joined into units that have one component each."""

    def __init__(self, adjust: Callable[[Floats], Weighted], groups: GroupsOf, settings: Settings) -> None:
        self.adjust, self.groups, self.settings = adjust, groups, settings
        self.messages: list[Phrase] = []
        self.factors = np.ones(len(groups.names))
        self.state = adjust(self.factors)
        self.steps: list[tuple[Floats, Floats, Floats]] = []
        self.matrix: Floats = np.zeros((0, 0))
        self.converged = False
        self.units: list[tuple[str, list[int]]] = []
        self.held: dict[int, Phrase | str] = {}
        self._judge()

    def _judge(self) -> None:
        """Merge groups that cannot be estimated, and fix the remaining weak components."""
        parents = self.groups.parents or ("",) * len(self.groups.names)
        pools: dict[int, tuple[str, list[int]]] = {}
        for parent in dict.fromkeys(filter(None, parents)):
            siblings = [g for g, own in enumerate(parents) if own == parent and g not in self.groups.held]
            if pool := self._pool(siblings):
                names = [self.groups.names[g] for g in pool]
                name = parent if len(pool) == len(siblings) or "other" in parent else f"others of {parent}"
                self.messages.append(Phrase("components.merged", {"names": names, "name": name}))
                pools |= dict.fromkeys(pool, (name, pool))
        for g, own_name in enumerate(self.groups.names):
            name, members = pools.get(g, (own_name, [g]))
            if members[0] == g:
                if why := self.groups.held.get(g) or self._why(members):
                    self.held[len(self.units)] = why
                self.units.append((name, members))

    def _pool(self, siblings: list[int]) -> list[int]:
        """Return the weak groups and the others that they need; empty without any."""
        pool = [g for g in siblings if self._why([g])]
        others = sorted(set(siblings) - set(pool), key=lambda g: float(self.state.redundancy[g]))
        while pool and others and self._why(pool):
            pool.append(others.pop(0))
        return sorted(pool) if len(pool) > 1 else []

    def _why(self, members: list[int]) -> Phrase | None:
        """Return the reason for not estimating a joint component of groups, or None."""
        least = self.settings.least_redundancy
        r, n = float(self.state.redundancy[members].sum()), int(self.state.counts[members].sum())
        if r < min(REFUSED, least):
            return Phrase("held.unchecked", {"redundancy": r})
        if r < least:
            return Phrase("held.few", {"redundancy": r, "least": float(least)})
        if r < LEAST_SHARE * n:
            return Phrase("held.share", {"redundancy": r, "n": n})
        return None

    @property
    def free(self) -> list[int]:
        return [unit for unit in range(len(self.units)) if unit not in self.held]

    def _sums(self, values: Floats) -> Floats:
        return np.array([values[members].sum() for _, members in self.units])

    def _helmert(self) -> tuple[Floats, Floats]:
        """Return the matrix of the units and the Helmert factors of the free units."""
        whole = self.state.matrix()
        matrix = np.array(
            [[whole[np.ix_(a, b)].sum() for _, b in self.units] for _, a in self.units]
        ).reshape(len(self.units), len(self.units))
        return matrix, helmert_step(matrix, self._sums(self.state.squares), self.free)

    def iterate(self) -> bool:
        """Iterate until nothing changes; return False if a component had to be fixed."""
        tolerance = self.settings.tolerance
        while True:
            free = self.free
            squares, redundancy = self._sums(self.state.squares), self._sums(self.state.redundancy)
            self.steps.append((self.factors.copy(), self.state.squares, self.state.redundancy))
            if not free:
                self.matrix, _ = self._helmert()
                self.converged = True
                return True
            factors = squares[free] / redundancy[free]
            of_sd = np.minimum(0.01 * np.sqrt(2 / redundancy[free]), 100 * tolerance)
            limit = np.maximum(tolerance, of_sd)
            still = bool((np.abs(factors - 1) < limit).all())
            if still or len(self.steps) % BY_HELMERT == 0:
                self.matrix, by_helmert = self._helmert()
                moved = np.abs(by_helmert - 1)
                if still and (moved <= 100 * tolerance).all():
                    if (unit := self._inseparable()) is not None:
                        # Restore the given variance.
                        self.held[unit] = Phrase("held.inseparable")
                        self.factors[self.units[unit][1]] = 1.0
                        self.state = self.adjust(self.factors)
                        return False
                    self.converged = True
                    return True
                if (by_helmert > 1 / LIMIT_OF_STEP).all() and (by_helmert < LIMIT_OF_STEP).all():
                    factors = by_helmert
            if len(self.steps) >= self.settings.max_steps:
                self.matrix, _ = self._helmert()
                self.messages.append(Phrase("components.not-converged", {"n": self.settings.max_steps}))
                return True
            for unit, factor in zip(free, np.clip(factors, 1 / LIMIT_OF_STEP, LIMIT_OF_STEP), strict=True):
                self.factors[self.units[unit][1]] *= factor
            self.state = self.adjust(self.factors)
            if self._vanished():
                return False

    def _vanished(self) -> bool:
        """Fix components that converge to zero, and report them."""
        low = [unit for unit in self.free if self.factors[self.units[unit][1][0]] < LOWER_BOUND]
        if not low:
            return False
        matrix, by_helmert = self._helmert()
        free = self.free
        deviations = np.sqrt(2 * np.diag(np.linalg.inv(matrix[np.ix_(free, free)])))
        said = {}
        for unit in low:
            place, (name, members) = free.index(unit), self.units[unit]
            factor = self.factors[members[0]]
            component, deviation = factor * by_helmert[place], factor * deviations[place]
            fields = {"component": float(component), "sd": float(deviation), "bound": LOWER_BOUND}
            said[unit] = Phrase("components.low", {"name": name, **fields})
            self.factors[members] = 1.0
        # With its own variance, and the current weights of the others, its redundancy may be too small.
        self.state = self.adjust(self.factors)
        for unit in low:
            members = self.units[unit][1]
            if (why := self._why(members)) is None:
                self.messages.append(said[unit])
                why = Phrase("held.bound", {"bound": LOWER_BOUND})
                self.factors[members] = LOWER_BOUND
            self.held[unit] = why
        self.state = self.adjust(self.factors)
        return True

    def _inseparable(self) -> int | None:
        """Return the component to fix because the matrix is nearly singular."""
        free = self.free
        block = self.matrix[np.ix_(free, free)]
        scale = np.sqrt(np.diag(block))
        values, vectors = np.linalg.eigh(block / np.outer(scale, scale))
        if values[-1] < MOST_CONDITION * values[0] or len(free) < 2:
            return None
        concerned = np.argsort(-np.abs(vectors[:, 0]))[:2]
        rows: list[int] = concerned.tolist()
        return min((free[k] for k in rows), key=lambda unit: float(self.matrix[unit].sum()))

    def _equality(self) -> tuple[float, int, float] | None:
        """Test whether all free components are equal.

        The derivative of the restricted log likelihood by ln(theta_g) is (q_g - r_g) / 2. Twice its
        difference between equal and estimated components is the integral of q_g - r_g along the line.
        """
        free = self.free
        if len(free) < 2 or not (self.converged and self.settings.equality):
            return None
        members = [g for unit in free for g in self.units[unit][1]]
        end, present = np.log(self.factors[members]), self.factors.copy()
        common = np.full(len(members), self._common(members, present))
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        ratio = 0.0
        for node, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
            present[members] = np.exp(common + node * (end - common))
            state = self.adjust(present)
            ratio += weight * float((state.squares - state.redundancy)[members] @ (end - common))
        freedom = len(free) - 1
        ratio = max(ratio, 0.0)
        return ratio, freedom, _photocore.chi_square(ratio, freedom)

    def _common(self, members: list[int], factors: Floats) -> float:
        """Return the logarithm of the joint component of some groups."""
        factors = factors.copy()
        factors[members] = 1.0
        for _ in range(self.settings.max_steps):
            state = self.adjust(factors)
            step = float(state.squares[members].sum() / state.redundancy[members].sum())
            factors[members] *= np.clip(step, 1 / LIMIT_OF_STEP, LIMIT_OF_STEP)
            if abs(step - 1) < self.settings.tolerance:
                break
        return math.log(factors[members[0]])

    def finished(self) -> Estimate:
        equality, free, level = self._equality(), self.free, self.settings.level
        deviations = np.full(len(self.units), np.nan)
        if free:
            inverse = np.linalg.inv(self.matrix[np.ix_(free, free)])
            deviations[free] = np.sqrt(2 * np.diag(inverse))
        squares, redundancy = self._sums(self.state.squares), self._sums(self.state.redundancy)
        own_level, bound = bonferroni(level, len(free)), critical_normal(0.05)
        images = self.groups.images or (False,) * len(self.groups.names)
        components = []
        for unit, (name, members) in enumerate(self.units):
            factor, deviation = float(self.factors[members[0]]), float(deviations[unit])
            z = math.log(factor) / deviation
            probability = math.erfc(abs(z) / math.sqrt(2))
            r = float(redundancy[unit])
            components.append(
                Component(
                    name=name,
                    members=tuple(self.groups.names[g] for g in members),
                    count=int(self.state.counts[members].sum()),
                    squares=float(squares[unit]),
                    redundancy=r,
                    factor=factor,
                    sd=factor * deviation,
                    least_sd=factor * math.sqrt(2 / r) if unit not in self.held else math.nan,
                    interval=(factor * math.exp(-bound * deviation), factor * math.exp(bound * deviation)),
                    test_value=z,
                    probability=probability,
                    significant=probability < own_level,
                    images=all(images[g] for g in members),
                    held=str(self.held.get(unit, "")),
                )
            )
        for unit, why in self.held.items():
            if not (isinstance(why, Phrase) and why.code == "held.bound"):
                self.messages.append(Phrase("components.held", {"name": self.units[unit][0], "reason": why}))
        return Estimate(
            tuple(components),
            self.factors,
            self.matrix,
            self.converged,
            self.steps,
            self.messages,
            equality,
            level,
        )
