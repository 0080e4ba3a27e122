"""Variance components of an adjusted network, and the ways to show them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.io import json
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.network import AdjustedNetwork
from photogram.show.methods import Documented, Judged, findings_of
from photogram.show.quantity import Quantity, Table, members, of_each, records
from photogram.show.summary import Brief
from photogram.statistics.components import Component, Estimate
from photogram.statistics.findings import Findings, GroupFactor

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.page import Document
    from photogram.show.sketch.plot import Plot

__all__ = ["VarianceComponents", "components_table", "statement"]


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
        from photogram.results.components_picture import components_sketch

        return components_sketch(self.components)

    def __getitem__(self, name: str) -> Component:
        """Return the component of a group."""
        for each in self.components:
            if name == each.name or name in each.members:
                return each
        raise KeyError(name)

    def table(self) -> pd.DataFrame:
        """Return the components as a data frame."""
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
        given = findings_of(self.first)
        first = statement(self)[0]
        told = [f"{first[:1].upper()}{first[1:]}."]
        return replace(
            findings_of(self.result),
            global_test=given.global_test,
            components=estimated,
            if_usable=told,
            if_withheld=(),
        )

    def document(self) -> Document:
        """Return the document: judgement, what to do first, the components."""
        from photogram.results.components_document import components_document

        return components_document(self)

    def to_json(self) -> bytes:
        """Return the components as a JSON document (UTF-8)."""
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


def components_table(found: VarianceComponents) -> Table:
    """Return the declared table of the components, estimated and held."""
    rows, reference = found.components, found.estimate.reference
    low, high = np.array([each.interval for each in rows]).reshape(-1, 2).T
    outcomes = [
        "held" if each.held else "to be changed" if each.worth_changing else "stands" for each in rows
    ]
    held = np.array([bool(each.held) for each in rows], dtype=bool)
    columns = [
        of_each(rows, "name", kind="name", name="group", head="Group"),
        of_each(rows, "count", name="observations", head="Number", decimals=0),
        of_each(rows, "redundancy", name="redundancy", head="Redundancy", decimals=2),
        of_each(rows, "squares", name="sum_of_squares", head="Weighted sum of squares", decimals=2),
        of_each(rows, "factor", name="factor", head="Component", decimals=3),
        of_each(rows, "sd", name="sd_factor", head="sd", decimals=3),
        of_each(rows, "least_sd", name="least_sd_factor"),
        Quantity(low, name="low", member="low", head="From", decimals=3),
        Quantity(high, name="high", member="high", head="To", decimals=3),
        of_each(rows, "factor_of_sd", name="factor_of_sd", head="Factor of sd", decimals=3),
        Quantity(
            [each.factor / reference for each in rows],
            name="factor_to_images",
            member="factor_to_images",
            head="To images",
            decimals=3,
        ),
        of_each(rows, "test_value", name="test_value"),
        of_each(rows, "probability", name="probability", head="p", figures=2, seen=~held),
        of_each(rows, "significant", name="significant"),
        of_each(rows, "held", kind="name", name="held"),
        Quantity(outcomes, kind="name", head="Outcome"),
    ]
    note = "The interval holds the true component with 95 percent: the factor of the variance."
    return Table("components", "Components", columns, note)


def statement(found: VarianceComponents) -> list[str]:
    """Return what to do, in sentences."""
    estimate = found.estimate
    if not estimate.converged:
        return ["the components have not converged: do not use them"]
    worth = found.worth_changing
    lines = [
        f"standard deviations of {each.name} are too {'small' if each.factor > 1 else 'large'} by a factor of"
        f" {max(each.factor_of_sd, 1 / each.factor_of_sd):.2f} (95 percent: {_of_sd(each)})"
        for each in worth
    ]
    lines = lines or ["the given standard deviations stand: no component is significant and far from 1"]
    if estimate.equality is not None:
        ratio, freedom, probability = estimate.equality
        lines.append(
            f"that all are equal has the probability {probability:.2g} (likelihood ratio {ratio:.2f},"
            f" {freedom} degrees of freedom)"
        )
    return lines


def _of_sd(each: Component) -> str:
    ends = [math.sqrt(end) for end in each.interval]
    if each.factor < 1:
        ends = [1 / end for end in reversed(ends)]
    return f"{ends[0]:.2f} to {ends[1]:.2f}"
