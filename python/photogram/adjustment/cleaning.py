"""Gross errors and weights together: snooping, variance components, snooping again, until both stand.

Components of contaminated data are worth nothing, and with weights that are far too optimistic half of the
observations would be taken for gross errors. So first gross errors go, with the given weights; only when the
rest still contradicts its weights are these estimated, and snooping begins anew, from all observations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.adjustment.components import Settings, of_grouping, scaled
from photogram.adjustment.snooping import snoop
from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.components import VarianceComponents
from photogram.results.group_sums import Probing, observables
from photogram.results.grouping import Grouping, GroupsArgument, grouped
from photogram.results.network import AdjustedNetwork
from photogram.results.snooping_result import Snooped
from photogram.show.methods import Brief, Documented
from photogram.show.page import Document, Part, Remarks, Section
from photogram.statistics.components import WORTH_CHANGING
from photogram.words import phrase

MOST_ROUNDS = 3  # Of components and snooping
STANDS = 0.05  # Components that change by less are the same


@dataclass(frozen=True, eq=False, repr=False)
class Cleaned(Brief, Documented):
    """A network without gross errors, with weights that its residuals bear out.

    Attributes
    ----------
    snooped
        The last snooping: its result is the network that is left, with the weights it has now.
    components
        The last variance components, relative to the weights of that result; None where the given weights
        explained the residuals as soon as gross errors were out.
    groups, factors
        Names of the groups, and by what their given variances were multiplied in all.
    rounds
        How many times components were estimated.
    settled
        Whether the last round changed neither a decision nor a component by more than 5 percent.
    """

    snooped: Snooped
    components: VarianceComponents | None
    groups: tuple[str, ...]
    factors: Floats
    rounds: int
    settled: bool

    @property
    def result(self) -> AdjustedNetwork:
        """The adjusted network."""
        return self.snooped.result

    @property
    def changes(self) -> list[str]:
        """Changes of weights and observations, in sentences."""
        code = "cleaning.rounds" if self.rounds else "cleaning.unchanged"
        messages = [phrase(code, n=len(self.snooped.removed), rounds=self.rounds)]
        if not self.settled:
            messages.append(phrase("cleaning.unsettled"))
        messages += [
            phrase("cleaning.factor", group=name, factor=float(np.sqrt(factor)))
            for name, factor in zip(self.groups, self.factors.tolist(), strict=True)
            if factor != 1.0
        ]
        return [str(message) for message in messages]

    def section(self) -> Section:
        """Return the section on weights: what was done to them, and the components that are left."""
        from photogram.results.components import components_section

        parts: list[Part] = [Remarks(self.changes)]
        if self.components is not None:
            parts += components_section(self.components).parts
        intro = "Weights were estimated from the observations that are left: the adjustment has these."
        return Section("components", "Weights", parts, intro)

    def document(self) -> Document:
        """Return the document of the network that is left, with what was done to weights and observations."""
        network = self.snooped.document()
        return replace(network, sections=[self.section(), *network.sections])

    def report(self) -> str:
        """Return what was done to weights and observations as text."""
        from photogram.show.forms import text

        return text(Document("Weights", "", [], [], [], [self.section()]))


def clean(
    network: object,
    groups: GroupsArgument = "kind",
    *,
    held: Sequence[str] = (),
    level: float = 0.05,
    probing: Probing | None = None,
    threads: int | None = None,
    **options: Any,
) -> Cleaned:
    """Take gross errors out and estimate weights, in the order in which neither spoils the other.

    Snooping with the given weights; if the global test then still rejects: components, snooping from the full
    set with the new weights, at most three times, until no decision changes and no component by more than 5
    percent. Weights change only where a component is significant, and standard deviations are wrong by more
    than a quarter.

    Parameters
    ----------
    network
        The block or collection.
    groups, held, probing
        As of :func:`photogram.variance_components`.
    level
        Of the tests of snooping, and of those of components.
    threads
        As of :func:`photogram.adjust`.
    options
        Further ones of :func:`photogram.snoop`.

    Raises
    ------
    InputError, AdjustmentError, RankError
        As of :func:`photogram.snoop` and :func:`photogram.variance_components`.
    """
    grouping = grouped(observables(network), groups)
    names = grouping.groups.names
    settings = Settings(level=level, equality=False, probing=probing or Probing())
    factors = np.ones(grouping.count)
    snooped = snoop(network, level=level, threads=threads, **options)
    test = snooped.result.global_test
    if test is None or not (test.rejected_high or test.rejected_low):
        return Cleaned(snooped, None, names, factors, 0, settled=True)
    rounds, settled = 0, False
    while rounds < MOST_ROUNDS and not settled:
        rounds += 1
        left, own = _left(network, grouping, snooped.result)
        found = of_grouping(left, own, settings, held=held, threads=threads)
        changed = _changed(found, names, factors)
        before = _out(snooped)
        snooped = snoop(scaled(network, grouping, changed), level=level, threads=threads, **options)
        stands = bool((np.abs(changed / factors - 1) <= STANDS).all())
        factors, settled = changed, stands and before == _out(snooped)
    # What is left is estimated once more, with its test of equality, for the report.
    left, own = _left(network, grouping, snooped.result)
    found = of_grouping(left, own, replace(settings, equality=True), held=held, threads=threads)
    return Cleaned(snooped, found, names, factors, rounds, settled)


def _left(network: Any, grouping: Grouping, result: AdjustedNetwork) -> tuple[Any, Grouping]:
    """Return what snooping has left of a network, and the groups of its observations."""
    left = result.given
    points = int(network.image_points.max(initial=0)) + 1
    keys = network.image_photos * points + network.image_points
    order = np.argsort(keys)
    # A photo has one image of a point.
    places = order[np.searchsorted(keys, left.image_photos * points + left.image_points, sorter=order)]
    observations = grouping.observations
    if len(observations) != len(left.observations):
        names = [_told(each) for each in network.observations]
        rows, start = list[int](), 0
        for observation in left.observations:  # in the same order
            rows.append(names.index(_told(observation), start))
            start = rows[-1] + 1
        observations = observations[rows]
    return left, replace(grouping, images=grouping.images[places], observations=observations)


def _told(observation: Any) -> tuple[object, ...]:
    """Return what tells an observation from others whatever its weight is."""
    return (observation.label, observation.of, observation.observed.tobytes())


def _changed(found: VarianceComponents, names: Sequence[str], factors: Floats) -> Floats:
    """Return the factors of the given variances: those that differ enough, ones for all others."""
    changed = factors.copy()
    for each in found.components:
        rows = [names.index(name) for name in each.members if name in names]
        for row in rows:
            if each.held:
                continue
            factor = factors[row] * each.factor
            significant = abs(np.log(factor)) > found.estimate.limit * each.sd / each.factor
            low, high = WORTH_CHANGING
            changed[row] = factor if significant and not low <= factor <= high else 1.0
    return changed


def _out(snooped: Snooped) -> set[str]:
    return {entry.name for entry in snooped.removed}


check_arguments(globals(), ["clean"])
