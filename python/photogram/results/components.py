"""Variance components of an adjusted network, and the ways to show them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from photogram import _photocore
from photogram.io import json
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.network import AdjustedNetwork
from photogram.show.lines import padded
from photogram.show.methods import Shown, columns_of, document_of, findings_of, report_of
from photogram.show.sections import Section, composed, headline, verdict_sections
from photogram.show.summary import Brief
from photogram.statistics.components import Component, Estimate
from photogram.statistics.findings import Findings, GroupFactor

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.sketch.plot import Plot

__all__ = ["VarianceComponents", "component_lines", "component_sections", "statement", "statement_lines"]


@dataclass(frozen=True, eq=False, repr=False)
class VarianceComponents(Shown, Brief):
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
        return self._table("component")


@findings_of.register(VarianceComponents)
def _findings(found: VarianceComponents) -> Findings:
    """Return what the verdict on the given weights rests on: components and, with their weights, the tests.

    Too optimistic weights would make gross errors of good observations. The global test is that of the given
    weights.
    """
    estimated = [
        GroupFactor(
            group=each.name,
            factor=each.factor_of_sd,
            interval=(math.sqrt(each.interval[0]), math.sqrt(each.interval[1])),
            significant=each.worth_changing,
        )
        for each in found.components
        if not each.held
    ]
    given = findings_of(found.first)
    first = statement(found)[0]
    told = [f"{first[:1].upper()}{first[1:]}."]
    return replace(
        findings_of(found.result),
        global_test=given.global_test,
        components=estimated,
        if_usable=told,
        if_withheld=(),
    )


@columns_of.register(VarianceComponents)
def _columns(found: VarianceComponents, what: str) -> dict[str, Any]:
    """`group`, its sums, `factor` of the variance with its deviation and interval, `held` where it is."""
    del what
    rows, reference = found.components, found.estimate.reference
    return {
        "group": [each.name for each in rows],
        "observations": [each.count for each in rows],
        "redundancy": [each.redundancy for each in rows],
        "sum_of_squares": [each.squares for each in rows],
        "factor": [each.factor for each in rows],
        "sd_factor": [each.sd for each in rows],
        "least_sd_factor": [each.least_sd for each in rows],
        "low": [each.interval[0] for each in rows],
        "high": [each.interval[1] for each in rows],
        "factor_of_sd": [each.factor_of_sd for each in rows],
        "factor_to_images": [each.factor / reference for each in rows],
        "test_value": [each.test_value for each in rows],
        "probability": [each.probability for each in rows],
        "significant": [each.significant for each in rows],
        "held": [each.held for each in rows],
    }


@document_of.register(VarianceComponents)
def _document(found: VarianceComponents) -> bytes:
    """Return the components as JSON (UTF-8)."""
    estimate = found.estimate
    columns, equality = _columns(found, "component"), estimate.equality
    rows = zip(*columns.values(), strict=True)
    of_equality = ("likelihood_ratio", "degrees_of_freedom", "probability")
    of_step = ("factors", "squares", "redundancy")
    return json.to_json(
        {
            "program": f"photogram {_photocore.__version__}",
            "verdict": found.verdict.document(),
            "converged": estimate.converged,
            "level": estimate.level,
            "components": [dict(zip(columns, row, strict=True)) for row in rows],
            "helmert_matrix": estimate.matrix,
            "all_equal": equality and dict(zip(of_equality, equality, strict=True)),
            "steps": [dict(zip(of_step, step, strict=True)) for step in estimate.steps],
            "messages": [str(each) for each in estimate.messages],
        }
    )


@report_of.register(VarianceComponents)
def _report(found: VarianceComponents) -> str:
    """Return the components as text: what to do first."""
    held = ("Groups that were merged or held", [str(each) for each in found.estimate.messages])
    return composed(headline("variance components"), [*component_sections(found), held])


def component_sections(found: VarianceComponents) -> list[Section]:
    """Return what a reader wants first, as titled sections: verdict, what to do next, components."""
    return [*verdict_sections(found.verdict), ("Variance components", statement_lines(found))]


def statement_lines(found: VarianceComponents) -> list[str]:
    """Return what to do, and the components."""
    return [*statement(found), *component_lines(found)]


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


def component_lines(found: VarianceComponents) -> list[str]:
    """Write a line for each component: plain numbers, but for the number of observations."""
    reference = found.estimate.reference
    columns = ("redundancy", "v P v", "component", "sd", "from", "to", "to images", "factor of sd", "p")
    head, *names = padded(["group", *(each.name for each in found.components)], 34)
    lines = [f"{head}{'number':>8}" + "".join(f"{column:>13}" for column in columns)]
    for name, each in zip(names, found.components, strict=True):
        parts = (
            each.redundancy,
            each.squares,
            each.factor,
            each.sd,
            *each.interval,
            each.factor / reference,
            each.factor_of_sd,
        )
        cells = "".join(f"{part:>13.3f}" if math.isfinite(part) else f"{'-':>13}" for part in parts)
        p = f"{each.probability:>13.2g}" if not each.held else f"{'held':>13}"
        lines.append(f"{name}{each.count:>8}{cells}{p}")
    return lines
