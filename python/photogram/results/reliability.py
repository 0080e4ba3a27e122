"""Reliability of observations: detectable errors, effects of undetected ones.

With R the cofactors of the residuals of unit weight, r = R_ii and lambda0 the noncentrality of the test
(Baarda 1968):

    MDB_i = sd_i sqrt(lambda0 / r_i)    the error detected with the power of the test
    sqrt(lambda0 (1 - r_i) / r_i)       its largest effect, in standard deviations

For a group (x and y of an image, a control point) the limit of detection of an error ~d is an ellipse, ~d'
R_g ~d = lambda0 of its dimension. Its largest semi-axis is sqrt(lambda0 / mu); mu is the smallest redundancy
of a redundant direction.

A robust loss in effect removes observations with a weight factor below :data:`REMOVED`. The tests are then
those of a least-squares adjustment of the others, which starts at the robust solution: the residuals of the
latter have no exact distribution.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from photogram.arguments.arrays import one_of, probability
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results import network_trial
from photogram.results.covariance import Covariances, Selection
from photogram.results.hypotheses import Hypotheses
from photogram.show.methods import Tabular
from photogram.show.page import Document, Part, Remarks, Section, about
from photogram.show.quantity import Quantity, Table, column, for_people, members
from photogram.statistics.distributions import lambda0
from photogram.statistics.findings import Removed, TypeFactor
from photogram.statistics.reliability import TESTABLE, largest_effect, minimal_detectable_error
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.results.parts import Terms

SEPARATED = 1.6448536269514722  # One-sided 95 percent quantile of the normal distribution


@dataclass(frozen=True)
class Inseparable:
    """Two groups of observations with inseparable errors."""

    first: str  # names
    second: str
    groups: tuple[int, int]  # their indices
    # Largest canonical correlation of their residuals: an error of one moves the test of the other by this
    # share
    correlation: float
    # Number of minimal detectable errors that an error must have to be attributed to the right one of the two
    # in 95 of 100 cases; infinite if they are inseparable
    factor: float

    def __str__(self) -> str:
        return str(Phrase("inseparable", vars(self)))


class Reliability(Tabular):
    """The reliability of all observations of a network, from row blocks of R.

    Arrays contain G groups of observations (`suspects`), or their M rows in the order of the groups; rows are
    in the units of the observations.
    """

    def __init__(
        self,
        trial: network_trial.NetworkTrial,
        covariances: Callable[[], Covariances],
        downweighted: Downweighted | None = None,  # Observations that a robust loss removes
        *,
        level: float,  # alpha0 and beta0 of the test of one observation or group
        power: float,
        unit_weight: str,  # `known`, or `unknown`: lambda0 of the F test
    ) -> None:
        one_of("unit_weight", unit_weight, ("known", "unknown"))
        self.level, self.power = probability("level", level), probability("power", power)
        self.trial, self._covariances, self.known = trial, covariances, unit_weight == "known"
        self.downweighted = downweighted
        self.standing: network_trial.Standing = trial.stand()
        self.tests: network_trial.Tests = trial.tests()
        self.suspects: network_trial.NamedSuspects = trial.suspects

    @property
    def sd(self) -> Floats:
        """(M,) standard deviations a priori."""
        return self.trial.deviations

    @property
    def redundancy(self) -> Floats:
        """(M,) redundancy numbers: the share of an error in its own residual."""
        return self.tests.redundancy

    def lambda0(self, dimension: int) -> float:
        """Return the noncentrality of the test of a group of a dimension."""
        freedom = math.inf if self.known else self.standing.degrees_of_freedom
        return lambda0(self.level, self.power, dimension, freedom)

    @cached_property
    def _of_rank(self) -> Floats:
        """(G,) noncentrality of the test of each group."""
        found = np.full(len(self.suspects), math.nan)
        for rank in np.unique(self.tests.rank[self.tests.rank > 0]).tolist():
            found[self.tests.rank == rank] = self.lambda0(rank)
        return found

    @property
    def detectable(self) -> Floats:
        """(M,) minimal detectable error of each single row; infinite without redundancy."""
        return minimal_detectable_error(self.sd, _shown(self.redundancy), self._delta)

    @property
    def external(self) -> Floats:
        """(M,) largest effect of an undetected error on any function, in its sd."""
        return largest_effect(_shown(self.redundancy), self._delta)

    @property
    def group_detectable(self) -> Floats:
        """(G,) largest semi-axis of the detectable error, in sd; see `invisible`."""
        return np.asarray(np.sqrt(self._of_rank / self.tests.least))

    @property
    def group_external(self) -> Floats:
        """(G,) largest effect of this error on any function, in its standard deviations."""
        least = np.minimum(self.tests.least, 1.0)
        return np.asarray(np.sqrt(self._of_rank * (1 - least) / least))

    @property
    def invisible(self) -> Bools:
        """(G,) whether an error in some direction is without effect on residuals."""
        return np.asarray(self.tests.active & (self.tests.rank < np.diff(self.suspects.row_starts)))

    @property
    def untestable(self) -> Bools:
        """(G,) whether own residuals cannot detect errors in any direction."""
        return np.asarray(self.tests.active & ~(self.tests.least > TESTABLE))

    @property
    def own_point_effect(self) -> Floats:
        """(M, 3) effect of a detectable error on the own point; NaN without one."""
        return self._own_effects(list(range(len(self.suspects))), np.arange(len(self.sd)))

    def _own_effects(self, groups: list[int], rows: Indices) -> Floats:
        errors = minimal_detectable_error(1.0, _shown(self.redundancy[rows]), self._delta)
        return np.asarray(self.trial.core.effects(groups) * errors[:, np.newaxis])

    def own_points(self, groups: list[int], *, heights: bool = False) -> list[float]:
        """Return effects of detectable errors of the worst group rows on their points.

        In the unit of the object space; only `heights` if plan coordinates are angles. NaN without a point.
        """
        rows, found = [self.suspects.rows(group) for group in groups], list[float]()
        effects = self._own_effects(groups, np.concatenate([*rows, np.zeros(0, dtype=np.int64)]))
        for first, last in pairwise(np.cumsum([0, *map(len, rows)]).tolist()):
            own = effects[first:last]
            moved = np.abs(own[:, 2]) if heights else np.sqrt((own**2).sum(axis=1))
            moved = moved[np.isfinite(moved)]
            found.append(float(moved.max()) if moved.size else math.nan)
        return found

    def influence(self, selection: Selection) -> tuple[list[tuple[str, str, str]], Floats]:
        """Return effects of minimal detectable errors of single rows on unknowns.

        One solution for each unknown serves all observations.

        Parameters
        ----------
        selection
            As in :meth:`photogram.Result.covariance`.

        Returns
        -------
        The labels of the k unknowns, and (k, M) effects on each, in its unit, of the undetected minimal
        detectable error of each row.

        Raises
        ------
        InputError
            If the selection does not exist.
        """
        labels, found = self._covariances().influences(selection, None)
        return labels, np.asarray(found * (self.detectable / self.sd))

    def influence_of(self, function: Callable[..., Any], unknowns: Selection) -> Floats:
        """Return (k, M) effects of minimal detectable errors on function values.

        `function` and `unknowns` are as in :meth:`photogram.Result.propagate`.
        """
        _, found = self._covariances().influences(unknowns, function)
        return np.asarray(found * (self.detectable / self.sd))

    def inseparable(self, limit: float = 0.9) -> list[Inseparable]:
        """Return pairs of inseparable observations on one point: images, and its control."""
        points = np.unique(self.suspects.points[self.suspects.points >= 0]).tolist()
        pairs = (each.tolist() for each in self.trial.core.inseparable(points, limit))
        return [self.named(*pair) for pair in zip(*pairs, strict=True)]

    def partners(self, group: int, limit: float = 0.3) -> list[Inseparable]:
        """Return other groups with correlated tests, the largest correlation first.

        The exact computation requires a solution for each row of the group.

        Parameters
        ----------
        group
            Its number among the suspects.
        limit
            The smallest correlation.
        """
        columns = self.trial.core.responses([group])
        starts = self.suspects.row_starts
        found = []
        for other in np.flatnonzero(self.tests.active & (self.tests.rank > 0)).tolist():
            rows = slice(int(starts[other]), int(starts[other + 1]))
            if other != group and (np.abs(columns[:, rows]) > 0).any():
                rho = self.trial.correlation(group, other, columns[:, rows])
                if rho > limit:
                    found.append(self.named(group, other, rho))
        return sorted(found, key=lambda pair: -pair.correlation)

    @cached_property
    def _delta(self) -> float:
        """Smallest detectable error of a single row, cached for thousands of pairs."""
        return math.sqrt(self.lambda0(1))

    def named(self, first: int, second: int, rho: float) -> Inseparable:
        factor = math.inf if rho > 1 - 1e-9 else SEPARATED / self._delta * math.sqrt(2 / (1 - rho))
        name = self.suspects.name
        return Inseparable(str(name(first)), str(name(second)), (first, second), rho, max(factor, 1.0))

    def row_groups(self) -> Indices:
        return np.repeat(np.arange(len(self.suspects)), np.diff(self.suspects.row_starts))

    def document(self) -> Document:
        """Return the document: all observations, of which reports show the worst."""
        suspects, groups = self.suspects, self.row_groups()
        rows = range(len(groups))
        names = np.array([str(suspects.name(group)) for group in range(len(suspects))], dtype=object)

        columns = [
            column("kind", [suspects.kind(int(group)) for group in groups], "Kind", kind="name"),
            column("name", names[groups], "Worst of it", kind="name"),
            column("component", [suspects.row_name(row) for row in rows], "Component", kind="name"),
            column("unit", [suspects.unit(row) for row in rows], "Unit", kind="name"),
            column("sd", self.sd),
            column("redundancy", self.redundancy, "Redundancy", decimals=3),
            column("detectable", self.detectable, "Detectable", figures=4),
            column("external_sd", self.external, "Moves up to, sd", decimals=2),
            column("group_T", self.tests.statistic[groups]),
            column("group_dimension", self.tests.rank[groups]),
            column("group_error", self.tests.error),
            column("group_error_sd", self.tests.error_sd),
            column("group_detectable_sd", self.group_detectable[groups]),
            column("group_external_sd", self.group_external[groups]),
        ]
        code = f"reliability-weight.{'known' if self.known else 'freedom'}"
        weight = about(code, freedom=self.standing.degrees_of_freedom)
        note = about("reliability-weakest", level=self.level, percent=100 * self.power, weight=weight)
        if count := int(self.untestable.sum()):
            first = names[np.flatnonzero(self.untestable)[:3]].tolist()
            note += f" {about('reliability-unchecked', n=count, names=first)}"
        testable, kinds = self.redundancy > TESTABLE, suspects.kinds[groups]
        of_kinds = [testable & (kinds == kind) for kind in range(len(suspects.kind_names))]
        worst = [int(np.where(own, self.external, -math.inf).argmax()) for own in of_kinds if own.any()]
        shown = np.array(worst, dtype=np.int64)
        table = Table("observations", "Reliability of observations", columns, note, shown=shown)
        return Document(table.title, "", sections=[Section.of(table)])


def _shown(redundancy: Floats) -> Floats:
    """Return redundancy numbers; zero if only rounding error."""
    return np.where(redundancy < 1e-9, 0.0, np.minimum(redundancy, 1.0))


REMOVED = 0.1  # Weight factor below which an observation counts as removed
SUPPORT = 2  # Smallest number of images of a point that are not removed
NAMED = 100  # Largest number of removed observations in documents


@dataclass(frozen=True, eq=False)
class Downweighted:
    """Observations and points that a robust loss excludes from the tests."""

    out: network_trial.Out
    removed: Removed
    unsupported: list[Phrase]  # names of points with too few images


def downweighted(
    trial: network_trial.NetworkTrial, terms: Terms, image_weights: Floats, used: Bools
) -> Downweighted:
    """Return the observations that the loss of an adjustment removes in effect, by (m,) weights of images."""
    suspects = trial.suspects
    weights = np.ones(len(suspects))  # (G,) of groups; NaN if not used
    of_images, others = suspects.kinds == network_trial.IMAGE, suspects.kinds == network_trial.OBSERVATION
    weights[of_images] = np.where(used, image_weights, np.nan)[suspects.subjects[of_images]]
    factors = np.ones(len(terms.observation_rows))
    for kind in terms.kinds:
        factors[kind.rows] = kind.weights
    weights[others] = factors[terms.observation_rows[suspects.subjects[others]]]
    removed = weights < REMOVED
    points, images = suspects.points, (suspects.kinds == network_trial.IMAGE) & np.isfinite(weights)
    count = len(terms.points)
    rays, left = (np.bincount(points[own], minlength=count) for own in (images, images & ~removed))
    alone = np.flatnonzero((left < SUPPORT) & (rays > left))
    rows = np.repeat(removed | np.isin(points, alone), np.diff(suspects.row_starts))
    names = [suspects.name(int(group)) for group in np.flatnonzero(removed)[:NAMED]]
    control = {int(point) for point in points[suspects.kinds == network_trial.CONTROL]}
    return Downweighted(
        network_trial.Out(rows, set(alone.tolist())),
        Removed(
            [{"name": str(name), "subject": name} for name in names],
            suspects.counts(rows, np.isfinite(weights)),
            int(removed.sum()),
        ),
        [
            Phrase("named.control" if point in control else "named.object_point", {"point": str(name)})
            for point, name in zip(alone.tolist(), terms.points[alone].tolist(), strict=True)
        ],
    )


LISTED = 5  # Listed observations of each type
PAIRS = 10  # Listed inseparable pairs
LOOKED_INTO = 2_000  # Number of points with examined pairs: those with the least redundancy
LIMIT = 0.9  # Largest correlation of separable tests (Foerstner 1983)
APART = 1 / (1 + LIMIT)
"""Smallest redundancy that excludes this correlation of a pair: rho^2 <= (1 - r)(1 - s) / (r s)."""


Listed = tuple[list[Part], dict[str, Any]]
"""Groups of observations in reports: parts of sections, and members of JSON documents."""


@dataclass(eq=False)
class ReliabilitySummary:
    level: float  # of the tests
    power: float
    known: bool
    list_groups: Callable[[], Listed] | None  # None as soon as it was called: it holds factor and inverse
    suspects: network_trial.NamedSuspects  # all groups, and their tests
    tests: network_trial.Tests
    hypotheses: Hypotheses  # Errors of sets and single observations, and their effects if undetected
    standing: network_trial.Standing  # sum of squares and degrees of freedom of the tested observations
    downweighted: Downweighted | None  # observations that a robust loss excludes from the tests
    types: tuple[TypeFactor, ...]  # agreement of the standard deviations by type

    @cached_property
    def listed(self) -> Listed:
        """Groups that reports list: verdicts do not need them."""
        list_groups = self.list_groups
        if list_groups is None:  # Another thread has just stored them.
            return cast(Listed, vars(self)["listed"])
        found = list_groups()
        vars(self)["listed"], self.list_groups = found, None
        return found

    def __getstate__(self) -> dict[str, Any]:
        return {"listed": self.listed} | vars(self)

    @property
    def testable(self) -> Bools:
        """(G,) groups with a direction of sufficient redundancy."""
        return self.tests.testable(self.suspects.row_starts)

    def parts(self) -> list[Part]:
        found = self.hypotheses
        errors = [found.tests(found.likely), found.external_reliability(found.effective)]
        shown = [replace(table, columns=for_people(table.columns)) for table in errors]
        return [*self.listed[0], *shown]

    def document(self) -> dict[str, Any]:
        return {
            **members(self, "level", "power"),
            **self.listed[1],
            "hypotheses": self.hypotheses.document(),
        }


def listed(found: Reliability, unit: str, *, heights: bool) -> Listed:
    tests, at = found.tests, found.suspects.points
    # Points on two photos, and points with possible pairs.
    takes_part, size = tests.active & (at >= 0), int(at.max(initial=-1)) + 1
    rays = np.bincount(at[takes_part & (found.suspects.kinds == 0)], minlength=size)
    others = np.bincount(at[takes_part], minlength=size) - rays
    weak = takes_part & ~(tests.least > APART)
    least: Floats = np.full(size, math.inf)
    np.minimum.at(least, at[weak], np.nan_to_num(tests.least[weak]))
    two = (rays == 2) & (others == 0)
    several: Indices = np.flatnonzero((np.bincount(at[weak], minlength=size) > 1) & ~two)
    points = several[np.argsort(least[several], kind="stable")][:LOOKED_INTO].tolist()
    checked = tests.least > TESTABLE
    pairs = found.trial.core.inseparable(points, LIMIT)
    first, second, rho = (each[checked[pairs[0]] & checked[pairs[1]]] for each in pairs)
    # Rounding does not define an order: equal values remain in the order of their numbers.
    order = np.lexsort((second, first, -np.round(rho, 9)))[:PAIRS]
    named = zip(*(each[order].tolist() for each in (first, second, rho)), strict=True)
    inseparable, two_rays = [found.named(*pair) for pair in named], int(two.sum())
    sentences = [about("reliability-two-rays", n=two_rays)] if two_rays else []
    if inseparable:
        sentences += [about("reliability-pairs"), *map(str, inseparable)]
    if (more := len(rho) - len(inseparable)) > 0:
        sentences.append(about("reliability-more", n=more))
    remarks = Remarks(sentences or [about("reliability-separable")])
    return [_kinds(found), _weakest(found, unit, heights=heights), remarks], {
        "points_looked_into": len(points),
        "points_on_two_photos": two_rays,
        "inseparable_found": len(rho),
        "unit_weight": "known" if found.known else "unknown",
        "inseparable": [members(pair, "first", "second", "correlation") for pair in inseparable],
    }


def _kinds(found: Reliability) -> Table:
    suspects, tests, redundancy = found.suspects, found.tests, found.redundancy
    of_rows, known = suspects.kinds[found.row_groups()], ~np.isnan(redundancy)
    count = partial(np.bincount, minlength=len(suspects.kind_names))
    there = np.flatnonzero(count(suspects.kinds[tests.active]))
    components, sums = (count(of_rows[known], own)[there] for own in (None, redundancy[known]))
    masks = tests.active, found.untestable, found.invisible & ~found.untestable
    groups, unchecked, one_sided = (count(suspects.kinds[own])[there] for own in masks)
    columns = [
        Quantity([suspects.kind_names[k] for k in there.tolist()], kind="name", member="kind", head="Kind"),
        Quantity(groups, member="groups", head="Groups", decimals=0),
        Quantity(components, member="components", head="Components", decimals=0),
        Quantity(sums, member="redundancy", head="Redundancy", decimals=3),
        Quantity(sums / np.maximum(components, 1), head="Mean", decimals=3),
        Quantity(unchecked, member="unchecked", head="Unchecked", decimals=0),
        Quantity(one_sided, member="one_sided", head="One-sided", decimals=0),
    ]
    title, note = "Redundancy of groups of observations", about("reliability-kinds")
    return Table("reliability.kinds", title, columns, note)


def _weakest(found: Reliability, unit: str, *, heights: bool) -> Table:
    suspects, tests = found.suspects, found.tests
    external = found.group_external
    checked = np.flatnonzero(tests.active & (tests.least > TESTABLE) & np.isfinite(external))
    kinds = suspects.kinds[checked]
    groups: list[int] = []
    for kind in np.flatnonzero(np.bincount(kinds)).tolist():
        own = checked[kinds == kind]
        if len(own) > LISTED:
            # Only candidates for the first rows are sorted.
            least = np.partition(external[own], -LISTED)[-LISTED]
            own = own[external[own] >= least]
        groups += own[np.argsort(-external[own], kind="stable")[:LISTED]].tolist()
    own_points = np.array(found.own_points(groups, heights=heights))
    weight = about(f"reliability-weight.{'known' if found.known else 'estimated'}")
    note = about("reliability-weakest", level=found.level, percent=100 * found.power, weight=weight)
    columns = [
        column("kind", [suspects.kind(group) for group in groups], kind="name"),
        column("name", [str(suspects.name(group)) for group in groups], "Group", kind="name"),
        column("redundancy", tests.least[groups], "Least redundancy", decimals=3),
        column("detectable_sd", found.group_detectable[groups], "Detectable error, sd", decimals=2),
        column("external_sd", external[groups], "Moves up to, sd", decimals=2),
        column("own_point", own_points, f"Own point {unit}".rstrip(), decimals=4),
    ]
    return Table("reliability.weakest", "Largest undetected errors", columns, note)
