"""Gross errors and weights: data snooping and variance components, repeated until both are stable.

Variance components of contaminated data are meaningless, and with far too optimistic weights half of the
observations would be removed. Therefore gross errors are removed first, with the given weights. Only if the
rest contradicts its weights, components are estimated and snooping is repeated from all observations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.adjustment.components import scaled, variance_components
from photogram.adjustment.snooping import snoop
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.components import VarianceComponents
from photogram.results.grouping import Grouping, GroupsArgument, Probing, grouped, observables
from photogram.results.network import AdjustedNetwork
from photogram.results.snooping_options import SnoopOptions
from photogram.results.snooping_result import Snooped
from photogram.show.methods import Documented
from photogram.show.page import Document, Part, Remarks, Section
from photogram.statistics.components import WORTH_CHANGING
from photogram.words import phrase

MOST_ROUNDS = 3  # Maximum number of rounds of components and snooping
STANDS = 0.05  # Components with a smaller relative change are stable


@dataclass(frozen=True, eq=False, repr=False)
class Cleaned(Documented):
    """Network without gross errors, with weights that agree with its residuals.

    Attributes
    ----------
    snooped
        Last snooping; its result is the remaining network with its final weights.
    components
        Last variance components, relative to the weights of that result. None if the given weights explain
        the residuals after removal of gross errors.
    groups, factors
        Names of the groups, and total factors of their given variances.
    rounds
        Number of component estimations.
    settled
        Whether the last round changed no decision and no component by more than 5 percent.
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
        """Return the report section on weights: changes and remaining components."""
        from photogram.results.components import components_section

        parts: list[Part] = [Remarks(self.changes)]
        if self.components is not None:
            parts += components_section(self.components).parts
        intro = "Weights were estimated from the observations that are left: the adjustment has these."
        return Section("components", "Weights", parts, intro)

    def document(self) -> Document:
        """Return the document of the remaining network with changes of weights and observations."""
        network = self.snooped.document()
        return replace(network, sections=[self.section(), *network.sections])

    def report(self) -> str:
        """Return the changes of weights and observations as text."""
        from photogram.show.forms import text

        return text(Document("Weights", "", [], [], [], [self.section()]))


def clean(
    network: object,
    groups: GroupsArgument = "kind",
    options: SnoopOptions | None = None,
    *,
    held: Sequence[str] = (),
    probing: Probing | None = None,
    threads: int | None = None,
    **changes: Any,
) -> Cleaned:
    """Remove gross errors and estimate weights in alternation.

    Snooping uses the given weights first. If the global test then rejects, components are estimated and
    snooping is repeated from the full set with the new weights, at most three times. It ends if no decision
    changes and no component by more than 5 percent. Weights change only if a component is significant and
    standard deviations are wrong by more than a quarter.

    Parameters
    ----------
    network
        The block or collection.
    groups, held, probing
        As in :func:`photogram.variance_components`.
    threads
        As in :func:`photogram.adjust`.
    options, changes
        As in :func:`photogram.snoop`; `level` is also the significance level of components.

    Raises
    ------
    InputError, AdjustmentError, RankError
        As in :func:`photogram.snoop` and :func:`photogram.variance_components`.
    """
    grouping = grouped(observables(network), groups)
    names = grouping.groups.names
    level = changes.get("level", (options or SnoopOptions()).level)
    given: dict[str, Any] = {"held": held, "probing": probing, "threads": threads, "level": level}
    factors = np.ones(grouping.count)
    snooped = snoop(network, options, threads=threads, **changes)
    test = snooped.result.global_test
    if test is None or not (test.rejected_high or test.rejected_low):
        return Cleaned(snooped, None, names, factors, 0, settled=True)
    rounds, settled = 0, False
    while rounds < MOST_ROUNDS and not settled:
        rounds += 1
        left, own = _left(network, grouping, snooped.result)
        found = variance_components(left, own, equality=False, **given)
        changed = _changed(found, names, factors)
        before = _out(snooped)
        snooped = snoop(scaled(network, grouping, changed), options, threads=threads, **changes)
        stands = bool((np.abs(changed / factors - 1) <= STANDS).all())
        factors, settled = changed, stands and before == _out(snooped)
    # Components of the remaining network, with the equality test, are estimated for the report.
    left, own = _left(network, grouping, snooped.result)
    found = variance_components(left, own, **given)
    return Cleaned(snooped, found, names, factors, rounds, settled)


def _left(network: Any, grouping: Grouping, result: AdjustedNetwork) -> tuple[Any, Grouping]:
    """Return the network after snooping, and the groups of its observations."""
    left = result.given
    points = int(network.image_points.max(initial=0)) + 1
    keys = network.image_photos * points + network.image_points
    order = np.argsort(keys)
    # Each point is observed at most once per photo.
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
    """Return a key of an observation that does not depend on its weight."""
    return (observation.label, observation.of, observation.observed.tobytes())


def _changed(found: VarianceComponents, names: Sequence[str], factors: Floats) -> Floats:
    """Return factors of the given variances; 1 for components without a significant change."""
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
