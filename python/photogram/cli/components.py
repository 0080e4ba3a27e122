"""Variance components of commands, and the basis of the unit variance."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, TypeVar

import typer

from photogram.cli.job import Job, estimation_status
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
COMPONENTS = "components.txt"


UnitVarianceName = Literal["constrained", "unity", "redundancy"]
MaxBiasRatio = Annotated[float | None, typer.Option(min=0.001)]


class Basis(StrEnum):
    """Criteria for groups of observations."""

    KIND = "kind"
    CAMERA = "camera"
    STRIP = "strip"
    PHOTO = "photo"
    POINT_CLASS = "point-class"
    COMPONENT = "component"
    RAYS = "rays"


def _groups(bases: list[Basis]) -> list[str]:
    return [basis.replace("-", " ") for basis in bases]


def snooped(
    network: object,
    bases: list[Basis] | None,
    threads: int | None,
    how: SnoopOptions,
    options: Mapping[str, Any],
) -> tuple[Snooped, Cleaned | None]:
    """Remove gross errors; estimate weights alternately if components are requested."""
    if bases:
        from photogram.adjustment.cleaning import clean

        made = clean(network, _groups(bases), how, threads=threads, **options)
        return made.snooped, made
    from photogram.adjustment.snooping import snoop

    return snoop(network, how, threads=threads, **options), None


@dataclass(frozen=True)
class AdjustmentOutcome(Generic[Network]):
    """Outcome of an adjustment: result, removed observations, components."""

    result: Network
    log: Snooped | None = None
    cleaned: Cleaned | None = None  # Weights and removed observations of an alternating estimation
    components: VarianceComponents | None = None  # For the given weights, which the result retains

    @property
    def subject(self) -> Snooped | Network:
        """The subject of reports."""
        return self.log or self.result

    @property
    def verdict(self) -> Verdict:
        """The verdict that determines the exit code."""
        return (self.components or self.subject).verdict

    def with_max_bias_ratio(self, ratio: float | None) -> AdjustmentOutcome[Network]:
        """Return the outcome with another limit of the effects of undetected errors."""
        result = self.result.with_max_bias_ratio(ratio)
        return replace(self, result=result, log=self.log and replace(self.log, result=result))

    def estimated(
        self, job: Job, network: object, bases: list[Basis] | None, threads: int | None
    ) -> AdjustmentOutcome[Network]:
        """Return the outcome with requested components if it lacks them."""
        if self.cleaned is not None or not bases:
            return self
        from photogram.adjustment.components import variance_components

        with estimation_status(job) as progress:
            found = variance_components(network, _groups(bases), threads=threads, progress=progress)
        return replace(self, components=found)

    def files(self, out: Path) -> dict[Path, bytes]:
        """Return the file of variance components in the output folder."""
        weights = self.cleaned or self.components
        return {} if weights is None else {out / COMPONENTS: weights.report().encode()}

    @cached_property
    def document(self) -> Document:
        """The document of the report, with weights and removed observations."""
        from photogram.results.components import weighed_document

        if self.cleaned is not None:
            return self.cleaned.document()
        network = self.subject.document()
        return network if self.components is None else weighed_document(self.components, network)
