"""Reliability summary of reports and JSON: types, weakest rows, pairs.

It includes the tests of all groups of observations for the verdict, because both require one factorisation
and selected inverse at the adjusted values.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any, cast

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.hypotheses import Hypotheses
from photogram.results.network_trial import NamedSuspects, Standing, Tests
from photogram.results.reliability import Downweighted, Inseparable, Reliability
from photogram.show.page import Part, Remarks, about
from photogram.show.quantity import Quantity, Table, column, for_people, members
from photogram.statistics.findings import TypeFactor
from photogram.statistics.reliability import TESTABLE

LISTED = 5  # Listed observations of each type
PAIRS = 10  # Listed inseparable pairs
LOOKED_INTO = 2_000  # Number of points with examined pairs: those with the least redundancy
LIMIT = 0.9  # Largest correlation of separable tests (Foerstner 1983)
APART = 1 / (1 + LIMIT)
"""Smallest redundancy that excludes this correlation of a pair: rho^2 <= (1 - r)(1 - s) / (r s)."""


@dataclass(frozen=True, eq=False)
class Listed:
    """Groups of observations that reports list."""

    kinds: Table  # number, redundancy and checks of groups by type of observation
    weakest: Table  # of each type the groups with the largest undetected effect
    two_rays: int  # points on two photos: the wrong image cannot be identified
    # Inseparable pairs of observations on other points, the most correlated first
    pairs: tuple[Inseparable, ...]
    pairs_found: int  # number of these pairs among the examined points
    # Number of examined points: those with the least redundancy, at most `LOOKED_INTO`
    points_looked_into: int


@dataclass(eq=False)
class ReliabilitySummary:
    level: float  # of the tests
    power: float
    known: bool
    list_groups: Callable[[], Listed] | None  # None as soon as it was called: it holds factor and inverse
    suspects: NamedSuspects  # all groups, and their tests
    tests: Tests
    hypotheses: Hypotheses  # Errors of sets and single observations, and their effects if undetected
    standing: Standing  # sum of squares and degrees of freedom of the tested observations
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
        listed, sentences = self.listed, list[str]()
        if listed.two_rays:
            sentences.append(about("reliability-two-rays", n=listed.two_rays))
        if listed.pairs:
            sentences += [about("reliability-pairs"), *map(str, listed.pairs)]
        if (more := listed.pairs_found - len(listed.pairs)) > 0:
            sentences.append(about("reliability-more", n=more))
        sentences = sentences or [about("reliability-separable")]
        found = self.hypotheses
        errors = [found.tests(found.likely), found.external_reliability(found.effective)]
        shown = [replace(table, columns=for_people(table.columns)) for table in errors]
        return [listed.kinds, listed.weakest, Remarks(sentences), *shown]

    def document(self) -> dict[str, Any]:
        return {
            **members(self, "level", "power"),
            **members(self.listed, "points_looked_into"),
            **members(self.listed, points_on_two_photos="two_rays", inseparable_found="pairs_found"),
            "unit_weight": "known" if self.known else "unknown",
            "inseparable": [members(pair, "first", "second", "correlation") for pair in self.listed.pairs],
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
    return Listed(
        kinds=_kinds(found),
        weakest=_weakest(found, unit, heights=heights),
        two_rays=int(two.sum()),
        pairs=tuple(found.named(*pair) for pair in named),
        pairs_found=len(rho),
        points_looked_into=len(points),
    )


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
