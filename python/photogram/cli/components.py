"""Adjustments of commands with removal of gross errors and variance components."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, cast

from photogram.cli.job import Job, adjustment_status, estimation_status
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.adjustment.cleaning import Cleaned
    from photogram.results.components import VarianceComponents
    from photogram.results.network import AdjustedNetwork
    from photogram.results.snooping_options import SnoopOptions
    from photogram.results.snooping_result import Snooped
    from photogram.show.page import Document
    from photogram.statistics.verdict import Verdict

Network = TypeVar("Network", bound="AdjustedNetwork")
Basis = Literal["kind", "camera", "strip", "photo", "point-class", "component", "rays"]
"""Criteria for groups of observations."""


@dataclass(frozen=True)
class AdjustmentOutcome(Generic[Network]):
    """Outcome of an adjustment: result, removed observations, components."""

    result: Network
    log: Snooped | None = None
    cleaned: Cleaned | None = None  # Weights and removed observations of an alternating estimation
    components: VarianceComponents | None = None  # For the given weights, which the result retains

    @property
    def subject(self) -> Snooped | Network:
        return self.log or self.result

    @property
    def verdict(self) -> Verdict:
        """The verdict that determines the exit code."""
        return (self.components or self.subject).verdict

    @property
    def files(self) -> dict[str, bytes]:
        """The file of variance components, if the user wants them."""
        weights = self.cleaned or self.components
        return {} if weights is None else {"components.txt": weights.report().encode()}

    @cached_property
    def document(self) -> Document:
        """The document of the report, with weights and removed observations."""
        from photogram.results.components import weighed_document

        if self.cleaned is not None:
            return self.cleaned.document()
        network = self.subject.document()
        return network if self.components is None else weighed_document(self.components, network)


def outcome(
    job: Job,
    network: object,
    adjust: Callable[..., Network],
    complete: Callable[[Network], Network] = lambda result: result,
    *,
    snooping: SnoopOptions | None,
    bases: Sequence[Basis],
    threads: int | None,
    options: Mapping[str, Any],
    max_bias_ratio: float | None,
    **status: Any,
) -> AdjustmentOutcome[Network]:
    """Adjust a network, and remove gross errors and estimate variance components on request.

    `adjust` adjusts once, `complete` adds messages to a result, and `options` are those of snooping.
    """
    from photogram.adjustment.cleaning import clean
    from photogram.adjustment.components import variance_components
    from photogram.adjustment.snooping import snoop

    groups = [basis.replace("-", " ") for basis in bases]
    log = cleaned = components = None
    with adjustment_status(job, **status) as progress:
        common: dict[str, Any] = {"threads": threads, "progress": progress}
        if snooping is None:
            result = adjust(**common)
        elif groups:
            cleaned = clean(network, groups, snooping, **common, **options)
            log = cleaned.snooped
        else:
            log = snoop(network, snooping, **common, **options)
    result = complete(result if log is None else cast("Network", log.result))
    result = result.with_max_bias_ratio(max_bias_ratio)
    if groups and cleaned is None:
        with estimation_status(job) as estimated:
            components = variance_components(network, groups, threads=threads, progress=estimated)
    return AdjustmentOutcome(result, log and replace(log, result=result), cleaned, components)
