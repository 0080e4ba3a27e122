"""Variance components on the command line, and what the variance of unit weight is based on."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

from photogram.cli.job import Job
from photogram.cli.progress import estimation_status
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.adjustment.cleaning import Cleaned
    from photogram.results.components import VarianceComponents
    from photogram.results.network import AdjustedNetwork
    from photogram.results.snooping_result import Snooped
    from photogram.show.page import Document
    from photogram.statistics.verdict import Verdict

Network = TypeVar("Network", bound="AdjustedNetwork")
COMPONENTS = "components.txt"
"""What goes to the output directory where variance components are asked for."""


UnitVarianceName = Literal["constrained", "unity", "redundancy"]
"""What the variance of unit weight is based on."""


class Basis(StrEnum):
    """What groups of observations are made by."""

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
    network: object, bases: list[Basis] | None, threads: int | None, options: Mapping[str, Any]
) -> tuple[Snooped, Cleaned | None]:
    """Take gross errors out, with options of snooping; where weights are asked for, estimate them in turn."""
    if bases:
        from photogram.adjustment.cleaning import clean

        made = clean(network, _groups(bases), threads=threads, **options)
        return made.snooped, made
    from photogram.adjustment.snooping import snoop

    return snoop(network, threads=threads, **options), None


@dataclass(frozen=True)
class Found(Generic[Network]):
    """What the adjustment of a network gave: the result, and of what else was asked for."""

    result: Network
    log: Snooped | None = None
    """What was taken out."""
    made: Cleaned | None = None
    """Weights and what was taken out, found in turn."""
    components: VarianceComponents | None = None
    """Of the given weights, which the result keeps."""

    @property
    def told(self) -> Snooped | Network:
        """What reports are of."""
        return self.log or self.result

    @property
    def verdict(self) -> Verdict:
        """What the command ends by."""
        return (self.components or self.told).verdict

    def estimated(
        self, job: Job, network: object, bases: list[Basis] | None, threads: int | None
    ) -> Found[Network]:
        """Return it with the components that are asked for, where they are not found already."""
        if self.made is not None or not bases:
            return self
        from photogram.adjustment.components import variance_components

        with estimation_status(job) as progress:
            found = variance_components(network, _groups(bases), threads=threads, progress=progress)
        return replace(self, components=found)

    def files(self, out: Path) -> dict[Path, bytes]:
        """Return what goes to the output directory of variance components."""
        weights = self.made or self.components
        return {} if weights is None else {out / COMPONENTS: weights.report().encode()}

    @cached_property
    def document(self) -> Document:
        """The document of the report, with weights and removed observations."""
        from photogram.results.components_document import weighed_document

        if self.made is not None:
            return self.made.document()
        network = self.told.document()
        return network if self.components is None else weighed_document(self.components, network)
