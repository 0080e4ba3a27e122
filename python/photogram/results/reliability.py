"""Reliability of every observation of a network: which gross errors are found, and what others do.

With R the cofactors of the residuals of unit weight, r = R_ii and lambda0 the noncentrality of the test
(Baarda 1968):

    MDB_i = sd_i sqrt(lambda0 / r_i)             the error that is found with the power of the test
    sqrt(lambda0 (1 - r_i) / r_i)                it moves nothing by more than so many standard deviations

For a group (x and y of an image, a control point) an error ~d is found where ~d' R_g ~d = lambda0 of its
dimension: an ellipse, whose largest half-axis is sqrt(lambda0 / mu), mu the smallest redundancy of a
direction that shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.arrays import number, one_of, probability
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.results.covariance import Covariances, Selection
from photogram.results.network_trial import NetworkTrial
from photogram.show.cells import written
from photogram.show.forms import table_text
from photogram.show.quantity import Table, column, members, records
from photogram.statistics.distributions import lambda0
from photogram.statistics.reliability import TESTABLE, largest_effect, minimal_detectable_error
from photogram.statistics.snooping.suspects import Standing, Suspects, Tests

if TYPE_CHECKING:
    import pandas as pd

SEPARATED = 1.6448536269514722  # One-sided 95 percent quantile of the normal distribution
SEARCHED = 100  # Number of examined observations: those of the largest norm


@dataclass(frozen=True)
class Inseparable:
    """Two groups of observations whose errors cannot be told apart."""

    first: str  # names
    second: str
    groups: tuple[int, int]  # their numbers among all
    # Largest canonical correlation of their residuals: an error of one moves the test of the other by this
    # share
    correlation: float
    # How many minimal detectable errors an error must have to be attributed to the right one of the two in 95
    # of 100 cases; infinite if nothing tells them apart
    factor: float

    def __str__(self) -> str:
        return f"either {self.first} or {self.second} (correlation {self.correlation:.3f})"


@dataclass(frozen=True)
class Moved:
    """The unknown that an undetected error moves most."""

    observation: str  # the one with the minimal detectable error
    component: str
    unknown: tuple[str, int, int]  # Kind, number and component of the unknown
    effect: float  # By how much it moves, in its unit
    in_sd: float  # The same in its standard deviations (a priori unit weight)


class Reliability:
    """The reliability of an adjusted network, observation by observation, from row blocks of R.

    Arrays are over G groups of observations (`suspects`), or over their M rows, which stand one group after
    the other; rows are in the units of the observations.
    """

    def __init__(
        self,
        trial: NetworkTrial,
        covariances: Callable[[], Covariances],
        *,
        level: float,  # alpha0 and beta0 of the test of one observation or group
        power: float,
        unit_weight: str,  # `known`, or `unknown`: lambda0 is then that of the F test
    ) -> None:
        one_of("unit_weight", unit_weight, ("known", "unknown"))
        self.level, self.power = (
            probability("level", number("level", level)),
            probability("power", number("power", power)),
        )
        self.trial, self._covariances, self.known = trial, covariances, unit_weight == "known"
        self.standing: Standing = trial.stand()
        self.tests: Tests = trial.tests()
        self.suspects: Suspects = trial.suspects

    @property
    def sd(self) -> Floats:
        """(M,) standard deviations a priori."""
        return self.trial.deviations

    @property
    def redundancy(self) -> Floats:
        """(M,) redundancy numbers: the share of an error that shows in its own residual."""
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

    def block(self, group: int) -> Floats:
        """Return R of a group: (m, m), of unit weight; zero for what takes no part."""
        return self.trial.own_block(group)

    @property
    def detectable(self) -> Floats:
        """(M,) minimal detectable error of each row alone; infinite if it shows in no residual."""
        return minimal_detectable_error(self.sd, _shown(self.redundancy), self._delta)

    @property
    def external(self) -> Floats:
        """(M,) largest effect of an undetected error on anything, in its standard deviations."""
        return largest_effect(_shown(self.redundancy), self._delta)

    @property
    def group_detectable(self) -> Floats:
        """(G,) largest half-axis of the minimal detectable error, in standard deviations; see `invisible`."""
        return np.asarray(np.sqrt(self._of_rank / self.tests.least))

    @property
    def group_external(self) -> Floats:
        """(G,) by how many standard deviations it moves anything at the most."""
        least = np.minimum(self.tests.least, 1.0)
        return np.asarray(np.sqrt(self._of_rank * (1 - least) / least))

    @property
    def invisible(self) -> Bools:
        """(G,) whether an error in some direction shows in no residual at all."""
        return np.asarray(self.tests.active & (self.tests.rank < np.diff(self.suspects.row_starts)))

    @property
    def untestable(self) -> Bools:
        """(G,) whether no error is found by its own residual: too little redundancy in every direction."""
        return np.asarray(self.tests.active & ~(self.tests.least > TESTABLE))

    @cached_property
    def _effects(self) -> Floats:
        """(M, 9) what an error of one standard deviation does to its own point and photo."""
        return self.trial.core.effects(list(range(len(self.suspects))))

    @property
    def own_point_effect(self) -> Floats:
        """(M, 3) by how much the minimal detectable error of a row moves its own point; NaN without one."""
        return np.asarray(self._effects[:, :3] * (self.detectable / self.sd)[:, np.newaxis])

    @property
    def own_photo_effect(self) -> Floats:
        """(M, 6) the same of the pose of its own photo: position, omega, phi, kappa."""
        return np.asarray(self._effects[:, 3:] * (self.detectable / self.sd)[:, np.newaxis])

    def own_points(self, groups: list[int], *, heights: bool = False) -> list[float]:
        """Return how far the minimal detectable error of the worst row of some groups moves their own points.

        In the unit of the object space; `heights` alone, where plan coordinates are angles. NaN without a
        point.
        """
        effects = self.trial.core.effects(groups)[:, :3]
        starts, errors = self.suspects.row_starts, self.detectable / self.sd
        found, first = [], 0
        for group in groups:
            rows = np.arange(starts[group], starts[group + 1])
            own = effects[first : first + len(rows)] * errors[rows, np.newaxis]
            first += len(rows)
            moved = np.abs(own[:, 2]) if heights else np.sqrt((own**2).sum(axis=1))
            moved = moved[np.isfinite(moved)]
            found.append(float(moved.max()) if moved.size else math.nan)
        return found

    def influence(self, selection: Selection) -> tuple[list[tuple[str, str, str]], Floats]:
        """Return what minimal detectable errors do to chosen unknowns, each observation by itself.

        One solution for each unknown serves all observations.

        Parameters
        ----------
        selection
            As for :meth:`photogram.Result.covariance`.

        Returns
        -------
        What the k unknowns are, and (k, M) by how much each moves, in its unit, when the minimal detectable
        error of a row is not found.

        Raises
        ------
        InputError
            A selection that is not there.
        """
        labels, found = self._covariances().influences(selection, None)
        return labels, np.asarray(found * (self.detectable / self.sd))

    def influence_of(self, function: Callable[..., Any], unknowns: Selection) -> Floats:
        """Return what minimal detectable errors do to a function of unknowns: (k, M) for its k values.

        `function` and `unknowns` are those of :meth:`photogram.Result.propagate`.
        """
        _, found = self._covariances().influences(unknowns, function)
        return np.asarray(found * (self.detectable / self.sd))

    def most_moved(self, count: int = SEARCHED) -> list[Moved]:
        """Return the unknowns that undetected errors move most, the gravest first.

        The largest effect on any unknown is at most `external`: rows are looked into in the order of this
        norm, `count` of them at the most, until no other can do more.
        """
        testable = self.redundancy > TESTABLE
        norm = np.where(testable & np.isfinite(self.external), self.external, -math.inf)
        group_of, best = self.row_groups(), 0.0
        found: list[Moved] = []
        for row in np.argsort(-norm, kind="stable")[:count].tolist():
            if not norm[row] > best:
                break
            group = int(group_of[row])
            own = self.trial.core.most_moved([group])[row - int(self.suspects.row_starts[group])]
            kind, index, component, effect, in_sd = own
            size = float(self.detectable[row] / self.sd[row])
            best = max(best, size * in_sd)
            name, row_name = str(self.suspects.name(group)), self.suspects.row_name(row)
            found.append(Moved(name, row_name, (kind, index, component), size * effect, size * in_sd))
        return sorted(found, key=lambda moved: -moved.in_sd)

    def inseparable(self, limit: float = 0.9) -> list[Inseparable]:
        """Return pairs of observations on one point that cannot be told apart: images, and its control."""
        points = np.unique(self.suspects.points[self.suspects.points >= 0]).tolist()
        return [self.named(*pair) for pair in self.pairs_on(points, limit)]

    def pairs_on(self, points: list[int], limit: float) -> list[tuple[int, int, float]]:
        """Return the same of some points by the numbers of the groups, with their correlation.

        Networks have thousands.
        """
        return self.trial.core.inseparable(points, limit)

    def partners(self, group: int, limit: float = 0.3) -> list[Inseparable]:
        """Return all other groups whose tests are correlated with that of a group, the most first.

        Exact: it takes a solution for each row of the group.

        Parameters
        ----------
        group
            Its number among the suspects.
        limit
            Of the correlation.
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
        """Smallest error of a lone row that is found; kept, as networks have pairs by the thousand."""
        return math.sqrt(self.lambda0(1))

    def named(self, first: int, second: int, rho: float) -> Inseparable:
        """Return a pair of :meth:`pairs_on` with its names."""
        factor = math.inf if rho > 1 - 1e-9 else SEPARATED / self._delta * math.sqrt(2 / (1 - rho))
        name = self.suspects.name
        return Inseparable(str(name(first)), str(name(second)), (first, second), rho, max(factor, 1.0))

    def row_groups(self) -> Indices:
        return np.repeat(np.arange(len(self.suspects)), np.diff(self.suspects.row_starts))

    def observations(self) -> Table:
        """Return the declared table of all observations; people see the worst of each kind."""
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
        weight = "known" if self.known else f"estimated with {self.standing.degrees_of_freedom} degrees"
        note = (
            f"Errors that are found in {100 * self.power:.0f} of 100 cases by tests of the level"
            f" {self.level:g}, unit weight {weight}."
        )
        if count := int(self.untestable.sum()):
            first = ", ".join(names[np.flatnonzero(self.untestable)[:3]])
            note += f" {count} groups are checked by no other observation, such as {first}."
        testable, kinds = self.redundancy > TESTABLE, suspects.kinds[groups]
        of_kinds = [testable & (kinds == kind) for kind in range(len(suspects.kind_names))]
        worst = [int(np.where(own, self.external, -math.inf).argmax()) for own in of_kinds if own.any()]
        shown = np.array(worst, dtype=np.int64)
        return Table("observations", "Reliability of observations", columns, note, shown=shown)

    def table(self) -> pd.DataFrame:
        """Return a data frame, a row for each observation, with its unit."""
        return self.observations().frame()

    def lines(self) -> list[str]:
        """Return lines for a report: of every kind the observation whose undetected error does most."""
        table = written(self.observations())
        return [table.note, *table_text(table)]

    def document(self) -> dict[str, Any]:
        """Return what JSON documents have: every row with its unit."""
        return {
            **members(self, "level", "power"),
            "unit_weight": "known" if self.known else "unknown",
            "observations": records(self.observations().columns),
        }


def _shown(redundancy: Floats) -> Floats:
    """Return redundancy numbers, zero where rounding is all there is of them."""
    return np.where(redundancy < 1e-9, 0.0, np.minimum(redundancy, 1.0))
