"""Budgets of uncertainty (GUM): what every source of error contributes to a variance.

With g the gradient of f and z = Q g, t_i = ~a_i z is the effect of one standard deviation of observation i,
and u^2(f) = s2 g' z = s2 sum of t_i^2 exactly, since Q N Q = Q. Weighted unknowns are observations of
themselves. Correlated observations are whitened: only the sum over their group is theirs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.results.components import VarianceComponents
from photogram.results.covariance import Covariances
from photogram.results.group_sums import Left, Probing, observables
from photogram.results.grouping import grouped
from photogram.results.result import Result
from photogram.results.statement import translation
from photogram.results.statement.quantities import Wanted
from photogram.results.statement.sources import Rows, kind_of
from photogram.results.statement.texts import Texts
from photogram.show.page import decimals_of
from photogram.statistics.freedom import coverage_factor, joint_freedom, welch_satterthwaite

LARGEST = 5
"""Single observations that are listed."""
EXACT = 5000
"""Rows up to which degrees of freedom of components are computed though nothing was estimated."""


@dataclass(frozen=True)
class Source:
    """A group of observations and what it contributes.

    Attributes
    ----------
    level
        `kind`, `strip`, `camera`, `photo`, `point` or `parameter`.
    name
        What it is called.
    number
        How many rows.
    contribution, share
        u_k^2 in the square of the unit of the quantity, and over u^2.
    """

    level: str
    name: str
    number: int
    contribution: float
    share: float

    @property
    def u(self) -> float:
        """u_k, in the unit of the quantity."""
        return math.sqrt(self.contribution)


@dataclass(frozen=True)
class Single:
    """A single observation.

    Attributes
    ----------
    observation
        Its kind, of what, and its component.
    sd
        A priori, in its unit.
    sensitivity
        df/dl: units of the quantity for one of the observation.
    contribution, share
        As of a source.
    """

    observation: tuple[str, ...]
    sd: float
    sensitivity: float
    contribution: float
    share: float


@dataclass(frozen=True)
class Freedom:
    """Effective degrees of freedom of a standard deviation.

    Attributes
    ----------
    basis
        `given`, `unit variance` or `components`: what standard deviations rest on.
    used
        What k comes from; infinite for given weights.
    common
        Those of the unit variance.
    of_kind
        nu_k = 2 / cov_kk of estimated components, by group.
    joint, welch_satterthwaite
        2 u^4 / (c' cov c), and u^4 / sum(u_k^4 / nu_k); NaN where nothing was, or can be, estimated.
    """

    basis: str
    used: float
    common: float
    of_kind: dict[str, float] = field(default_factory=dict)
    joint: float = math.nan
    welch_satterthwaite: float = math.nan


@dataclass(frozen=True, eq=False)
class Budget:
    """The budget of a quantity.

    Attributes
    ----------
    quantity, unit
        As asked for, and the unit of its value.
    value, sd
        The adjusted value and its standard deviation u.
    cofactor
        u^2 / s2.
    sources
        Groups of observations at all levels; those of the level `kind` sum to u^2.
    largest
        The five largest single observations.
    freedom
        Effective degrees of freedom.
    k, expanded
        The coverage factor (Student, degrees of freedom cut to a whole number) and U = k u.
    coverage
        The probability of U.
    """

    quantity: str
    unit: str
    value: float
    sd: float
    cofactor: float
    sources: tuple[Source, ...]
    largest: tuple[Single, ...]
    freedom: Freedom
    k: float
    coverage: float

    @property
    def expanded(self) -> float:
        """U = k u."""
        return self.k * self.sd

    def at(self, level: str) -> list[Source]:
        """Return the sources of a level."""
        return [each for each in self.sources if each.level == level]


def budgets(
    result: Result,
    wanted: Sequence[Wanted],
    covariances: Covariances,
    *,
    coverage: float = 0.95,
    components: VarianceComponents | None = None,
) -> list[Budget]:
    """Return the budgets of quantities: a solution for each, and a pass over all rows.

    `components` are those whose result this is, where weights were estimated. Errors are those of
    :meth:`Result.covariances`.
    """
    if not wanted:
        return []
    rows = Rows(result, covariances.suspects())
    items = list(dict.fromkeys(item for each in wanted for item in each.items))
    places = [[items.index(item) for item in each.items] for each in wanted]

    def together(*arrays: Any) -> Any:
        pairs = zip(wanted, places, strict=True)
        return np.array([each.function(*(arrays[place] for place in own)) for each, own in pairs])

    values = covariances.propagate(together, items)
    _, effects = covariances.influences(items, together)
    freedom = _Freedoms(result, rows, components)
    return [
        _budget(result, each, float(values.value[k]), t, rows, freedom, coverage)
        for k, (each, t) in enumerate(zip(wanted, effects, strict=True))
    ]


def _budget(
    result: Result, wanted: Wanted, value: float, t: Floats, rows: Rows, freedoms: _Freedoms, coverage: float
) -> Budget:
    squares = result.covariance_scale * t**2
    variance = float(squares.sum())
    share = 1.0 / variance if variance > 0 else 0.0
    sources = [
        Source(level, name, number, contribution, contribution * share)
        for level, name, number, contribution in rows.sources(squares)
    ]
    most = np.sort(np.argpartition(-squares, min(LARGEST, len(squares)) - 1)[:LARGEST])
    order = most[np.argsort(-squares[most], kind="stable")].tolist()
    largest = [
        Single(rows.named(row), float(rows.sd[row]), float(t[row] / rows.sd[row]), own, own * share)
        for row in order
        if (own := float(squares[row])) > 0
    ]
    freedom = freedoms.of(squares, variance)
    return Budget(
        quantity=wanted.name,
        unit=wanted.unit,
        value=value,
        sd=math.sqrt(variance),
        cofactor=variance / result.covariance_scale,
        sources=tuple(sources),
        largest=tuple(largest),
        freedom=freedom,
        k=coverage_factor(coverage, freedom.used),
        coverage=coverage,
    )


def budget_line(texts: Texts, found: Budget) -> str:
    """Return value, standard deviation (two significant digits) and expanded uncertainty in a sentence."""
    factor, unit = (1.0, found.unit) if found.unit != "rad" else (math.degrees(1.0), "°")
    sd = found.sd * factor
    decimals = decimals_of(np.array([sd]), unknown=6)
    numbers = (texts.number(each * factor, decimals) for each in (found.value, found.sd, found.expanded))
    value, u, expanded = (f"{each} {unit}".rstrip() for each in numbers)
    k, p = texts.number(found.k, 2), texts.percent(found.coverage)
    named = translation.quantity(texts, found.quantity)
    return texts("budget.line", quantity=named, value=value, u=u, expanded=expanded, k=k, p=p)


class _Freedoms:
    """Effective degrees of freedom of variances, by what standard deviations rest on."""

    def __init__(self, result: Result, rows: Rows, components: VarianceComponents | None) -> None:
        self._common = result.degrees_of_freedom
        known = math.isinf(result.freedom_of_scale)
        self._basis = "components" if components is not None else "given" if known else "unit variance"
        self._names: list[str] = []
        self._of: Indices = np.full(len(rows), -1)
        self._covariance = np.zeros((0, 0))
        if components is None and len(rows) > EXACT:
            return
        grouping = grouped(observables(result), "kind")
        self._of = rows.groups(grouping)
        matrix = Left(result, grouping, Probing(exact=min(len(rows), EXACT))).matrix()
        names = list(grouping.groups.names)
        estimated = [k for k in range(len(names)) if matrix[k, k] > 0]
        self._names = [kind_of(names[k]) for k in estimated]
        place = np.full(len(names) + 1, -1)
        place[estimated] = np.arange(len(estimated))
        self._of = place[self._of]
        inverse = np.linalg.pinv(matrix[np.ix_(estimated, estimated)], hermitian=True)
        self._covariance = np.asarray(2.0 * inverse, dtype=np.float64)

    def of(self, squares: Floats, variance: float) -> Freedom:
        """Return those of a variance that is the sum of (M,) squares."""
        own = self._of >= 0
        contributions = np.bincount(self._of[own], weights=squares[own], minlength=len(self._names))
        nu = 2.0 / np.diag(self._covariance)
        joint = welch = math.nan
        if len(nu) and variance > 0:
            given = max(variance - float(contributions.sum()), 0.0)
            joint = joint_freedom(contributions, self._covariance, given)
            u = np.sqrt(np.append(contributions, given))
            welch = welch_satterthwaite(u, np.append(nu, math.inf))
        used = {"given": math.inf, "unit variance": self._common, "components": joint}[self._basis]
        names = dict(zip(self._names, nu.tolist(), strict=True))
        return Freedom(self._basis, used, self._common, names, joint, welch)
