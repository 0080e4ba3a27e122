"""Variance components of an adjusted network, and the ways to show them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from photogram import _photocore
from photogram.io import json
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.network import AdjustedNetwork
from photogram.show.methods import Brief, Documented, Judged
from photogram.show.quantity import members, records
from photogram.statistics.components import Component, Estimate
from photogram.statistics.findings import Findings, GroupFactor

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.page import Document
    from photogram.show.sketch.plot import Plot


@dataclass(frozen=True, eq=False, repr=False)
class VarianceComponents(Judged, Documented, Brief):
    """Variance components of groups of observations.

    Attributes
    ----------
    estimate
        The components, the Helmert matrix, steps and messages.
    network
        The block or collection with all standard deviations multiplied by the roots of the components.
    result
        Its adjustment.
    first
        The adjustment with the given standard deviations.
    """

    estimate: Estimate
    network: Any
    result: AdjustedNetwork
    first: AdjustedNetwork

    @property
    def components(self) -> tuple[Component, ...]:
        """The components, estimated and held."""
        return self.estimate.components

    @property
    def worth_changing(self) -> list[Component]:
        """Those that differ significantly, and by more than 25 percent of the standard deviation, from 1."""
        return [each for each in self.components if each.worth_changing]

    def plot(self) -> Plot:
        """Plot factors of standard deviations with 95 percent intervals; circles are fixed components."""
        from photogram.results.components_document import components_sketch

        return components_sketch(self.components)

    def __getitem__(self, name: str) -> Component:
        """Return the component of a group."""
        for each in self.components:
            if name == each.name or name in each.members:
                return each
        raise KeyError(name)

    def table(self) -> pd.DataFrame:
        """Return the components as a data frame."""
        from photogram.results.components_document import components_table

        return components_table(self).frame()

    def _findings(self) -> Findings:
        """Return the components and the tests of the adjustment with their weights.

        Too optimistic weights would make gross errors of good observations. The global test is that of the
        given weights.
        """
        estimated = [
            GroupFactor(
                group=each.name,
                factor=each.factor_of_sd,
                interval=(math.sqrt(each.interval[0]), math.sqrt(each.interval[1])),
                significant=each.worth_changing,
            )
            for each in self.components
            if not each.held
        ]
        given = self.first._findings()
        from photogram.results.components_document import statement

        return replace(
            self.result._findings(),
            global_test=given.global_test,
            components=estimated,
            if_usable=statement(self)[:1],
            if_withheld=(),
        )

    def document(self) -> Document:
        """Return the document: judgement, what to do first, the components."""
        from photogram.results.components_document import components_document

        return components_document(self)

    def to_json(self) -> bytes:
        """Return the components as a JSON document (UTF-8)."""
        from photogram.results.components_document import components_table

        estimate, equality = self.estimate, self.estimate.equality
        of_equality = ("likelihood_ratio", "degrees_of_freedom", "probability")
        of_step = ("factors", "squares", "redundancy")
        return json.to_json(
            {
                "program": f"photogram {_photocore.__version__}",
                "verdict": self.verdict.document(),
                **members(estimate, "converged", "level", helmert_matrix="matrix"),
                "messages": [str(message) for message in estimate.messages],
                "components": records(components_table(self).columns),
                "all_equal": equality and dict(zip(of_equality, equality, strict=True)),
                "steps": [dict(zip(of_step, step, strict=True)) for step in estimate.steps],
            }
        )
