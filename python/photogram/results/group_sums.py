"""Sums of squares and redundancy numbers of groups, and their tests.

q_g, the weighted sum of squares of a group, is a mixture of chi-square variables. Its expectation r_g is the
sum of its redundancy numbers, its variance is 2 s_g, and s_g is the sum of R_ij^2 within the group. With c =
s_g / r_g, q_g / c is approximately chi-square with r_g^2 / s_g degrees of freedom (Satterthwaite 1946). A
chi-square test of q_g with r_g degrees of freedom is conservative for small redundancy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.arrays import argument_error, value_field
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import by_name
from photogram.results.grouping import Grouping, GroupsArgument, grouped, observables
from photogram.results.network import AdjustedNetwork
from photogram.results.result import Result
from photogram.show.methods import Tabular
from photogram.show.page import Document, Section, about
from photogram.show.quantity import Quantity, Table, column, of_each
from photogram.statistics.components import Component, balanced
from photogram.statistics.distributions import bonferroni
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import phrase

TESTABLE = 0.5  # Smallest redundancy of a tested group
LEVEL = 0.05
SMALL = 1000  # Largest number of observations with exact sums
TOGETHER = 32  # Largest number of groups with separate columns


@dataclass(frozen=True)
class Probing:
    """Settings for the computation of sums over R."""

    # Largest number of observations of groups computed by column; None: 64, and all groups of a network of
    # 1,000 observations
    exact: int | None = None
    # Vectors of random signs for larger groups: 16 give a sum to about 15 percent, 64 to half of that error
    vectors: int = 32
    seed: int = 1  # equal seeds give identical results

    def options(self, observations: int) -> dict[str, Any]:
        """Return the options of the core for a number of observations."""
        exact = (observations if observations <= SMALL else 64) if self.exact is None else self.exact
        return {"exact": exact, "vectors": self.vectors, "seed": self.seed, "threads": 0, "progress": None}


@dataclass(frozen=True)
class GroupSum:
    """A group of observations after the adjustment."""

    name: str
    # count, squares, redundancy: Observations, their weighted sum of squares q, the sum r of their redundancy
    # numbers
    count: int
    squares: float
    redundancy: float
    spread: float  # s: the variance of q is 2 s if the standard deviations are right
    # Of q / c with its degrees of freedom (Satterthwaite); None with a redundancy below 0.5
    test: GlobalTest | None

    @property
    def freedom(self) -> float:
        """Degrees of freedom of q / c, r^2 / s."""
        return self.redundancy**2 / self.spread if self.spread > 0 else math.nan

    @property
    def factor(self) -> float:
        """Ratio of residuals to their expectation by standard deviations; NaN without redundancy."""
        return math.sqrt(self.squares / self.redundancy) if self.redundancy > 0 else math.nan


@dataclass(frozen=True, eq=False, repr=False)
class GroupSums(Tabular):
    """Groups of the observations of an adjusted network, with their tests.

    A group should be tested after the removal of gross errors, and jointly with the others by variance
    components. Its sum contains the errors of the others.

    Attributes
    ----------
    groups
        The groups.
    level
        The level of all tests together, divided by their number (Bonferroni), half on each side.
    """

    groups: tuple[GroupSum, ...]
    level: float

    @property
    def rejected(self) -> list[GroupSum]:
        """Groups with residuals too large or too small for their standard deviations."""
        return [
            each for each in self.groups if each.test and (each.test.rejected_high or each.test.rejected_low)
        ]

    def __getitem__(self, name: str) -> GroupSum:
        """Return a group by its name."""
        found: GroupSum = by_name(self.groups, name, "group")
        return found

    def document(self) -> Document:
        """Return the document: sums, factors of standard deviations, probabilities of sums."""
        groups, tests = self.groups, [each.test for each in self.groups]
        sides = [
            (math.nan, math.nan) if test is None else (test.probability_below, test.probability_above)
            for test in tests
        ]
        low, high = np.reshape(sides, (-1, 2)).T
        columns = [
            *sum_columns(groups),
            of_each(groups, "spread", name="spread"),
            of_each(groups, "freedom", name="degrees_of_freedom"),
            of_each(groups, "factor", name="factor", head="Factor of sd", decimals=3),
            column("probability_below", low, "p low", figures=2),
            column("probability_above", high, "p high", figures=2),
        ]
        tested = sum(test is not None for test in tests)
        names = [each.name for each in self.rejected] or ["none"]
        note = about("groups", n=tested, percent=100 * self.level, names=names)
        title = "Groups of observations"
        return Document(title, "", sections=[Section.of(Table("groups", title, columns, note))])


def sum_columns(groups: Sequence[GroupSum | Component]) -> list[Quantity]:
    """Return the names of groups, their numbers of observations, redundancy and sums of squares."""
    return [
        of_each(groups, "name", kind="name", name="group", head="Group"),
        of_each(groups, "count", name="observations", head="Number", decimals=0),
        of_each(groups, "redundancy", name="redundancy", head="Redundancy", decimals=2),
        of_each(groups, "squares", name="sum_of_squares", head="Weighted sum of squares", decimals=2),
    ]


class Left:
    """Residual statistics of groups, and of all others as another group."""

    def __init__(self, result: AdjustedNetwork, grouping: Grouping, probing: Probing) -> None:
        self.result, self.grouping, self._probing = result, grouping, probing
        total, freedom = result.sum_and_freedom
        counts, squares, redundancy = sums_of(result, grouping)
        self.counts: Indices = np.append(counts, 0)
        self.squares: Floats = np.append(squares, max(total - squares.sum(), 0.0))
        self.redundancy: Floats = np.append(redundancy, max(freedom - redundancy.sum(), 0.0))

    def matrix(self) -> Floats:
        """Return the (G + 1, G + 1) Helmert matrix."""
        options = self._probing.options(int(self.counts.sum()))
        g = self.grouping.count
        _, found, exact = self.result._factor().group_squares(self.grouping.core(), classes=None, **options)
        columns, r = found.reshape(g + 1, g), self.redundancy
        sums = columns.sum(axis=0)
        columns = columns * np.divide(r[:g], sums, out=np.ones(g), where=(sums > 0) & ~np.array(exact, bool))
        matrix = np.zeros((g + 1, g + 1))
        matrix[g, :g] = matrix[:g, g] = columns[g]
        matrix[:g, :g] = balanced(columns[:g], r[:g] - columns[g], exact)
        matrix[g, g] = max(r[g] - columns[g].sum(), 0.0)
        return matrix


def sums_of(result: AdjustedNetwork, grouping: Grouping) -> tuple[Indices, Floats, Floats]:
    """Return (G,) observation numbers, sums of squares and sums of redundancy."""

    def weighted(residuals: Floats, sd: Floats) -> Floats:
        return np.where((sd > 0) & np.isfinite(sd), (residuals / sd) ** 2, np.nan)

    kinds = [*result._terms.kinds]
    size = sum(len(kind.rows) for kind in kinds)
    of_observations, shares, components = np.full(size, np.nan), np.full(size, np.nan), np.ones(size)
    for kind in kinds:
        of_observations[kind.rows] = kind.squares
        shares[kind.rows] = np.nansum(np.where(np.isfinite(kind.sd), kind.redundancy, 0.0), axis=1)
        components[kind.rows] = np.isfinite(kind.residuals).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        images = (result.residuals / result.image_given_sd) ** 2 * result.image_weights[:, np.newaxis]
        points = weighted(result.point_residuals, result.point_given_sd)
        photos = weighted(result.photo_residuals, result.photo_given_sd)
    squares = {"images": images, "points": points, "photos": photos, "observations": of_observations}
    parts = (result.redundancy, result.point_redundancy, result.photo_redundancy, shares)
    redundancy = {
        name: np.where(np.isfinite(squares[name]) | (name == "images"), part, np.nan)
        for name, part in zip(squares, parts, strict=True)
    }
    ones = {name: np.where(np.isfinite(values), 1.0, np.nan) for name, values in redundancy.items()}
    ones["observations"] *= components
    counts = np.round(grouping.summed(ones)).astype(np.int64)
    return counts, grouping.summed(squares), grouping.summed(redundancy)


def sums_by_kind(result: Result) -> dict[str, tuple[int, float, float]]:
    """Return number, redundancy and sum of squares of each type of observation, with weighted parameters."""
    grouping = grouped(observables(result), "kind")
    counts, squares, redundancy = sums_of(result, grouping)
    columns = counts.tolist(), redundancy.tolist(), squares.tolist()
    found = dict(zip(grouping.groups.names, zip(*columns, strict=True), strict=True))
    more: list[tuple[str, Any, Floats]] = [(each.kind, each, each.change) for each in result.unknowns]
    more += [("camera", each, each.values - each.given.values) for each in result.cameras]
    for kind, each, change in more:
        sd = each.given.deviations
        if (weighted := (sd > 0) & np.isfinite(sd)).any():
            count, r, q = found.get(kind, (0, 0.0, 0.0))
            q += float(((change[weighted] / sd[weighted]) ** 2).sum())
            found[kind] = count + int(weighted.sum()), r + float(each.redundancy[weighted].sum()), q
    return found


def group_sums(
    result: AdjustedNetwork,
    groups: GroupsArgument = "kind",
    *,
    level: float = LEVEL,
    probing: Probing | None = None,
) -> GroupSums:
    """Test groups of the observations of an adjusted network.

    Parameters
    ----------
    result
        The adjusted block or collection, with covariances.
    groups
        `kind`, `camera`, `strip`, `photo`, `point class`, `rays`, `component`, several of these, or own
        labels (docs/weights.md).
    level
        Probability of rejecting any of the groups if all standard deviations are right.
    probing
        Settings for the computation of sums over R.

    Raises
    ------
    InputError
        If the argument is not an adjusted network with covariances, or the groups do not exist.
    """
    if not isinstance(result, AdjustedNetwork):
        raise argument_error("result", "kind", kind=phrase("groups.result"), value=value_field(result))
    if not np.isfinite(result.redundancy[result.used_images]).all():
        raise InputError(phrase("groups.no-redundancy"))
    grouping = grouped(observables(result), groups)
    counts, squares, redundancy = sums_of(result, grouping)
    # The other groups share columns.
    classes = TOGETHER if grouping.count > TOGETHER else None
    options = (probing or Probing()).options(int(counts.sum()))
    _, spread, _ = result._factor().group_squares(grouping.core(), classes=classes, **options)
    if classes is None:
        spread = np.diag(spread.reshape(-1, grouping.count))
    spread = np.clip(spread, 0.0, redundancy)
    testable = redundancy >= TESTABLE
    own = bonferroni(level, int(testable.sum()))
    found = []
    for g, name in enumerate(grouping.groups.names):
        q, r, s = float(squares[g]), float(redundancy[g]), float(spread[g])
        test = global_test(q * r / s, r * r / s, own) if testable[g] and s > 0 else None
        found.append(GroupSum(name, int(counts[g]), q, r, s, test))
    return GroupSums(tuple(found), level)
