"""Variance components and variance functions: values, plots, tables and documents."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np

from photogram import _photocore
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.grouping import GroupSum, sum_columns
from photogram.results.network import AdjustedNetwork
from photogram.show.judgement import remarks_section, verdict_document
from photogram.show.methods import Judged, Tabular
from photogram.show.page import (
    Document,
    Drawing,
    Fact,
    Facts,
    Part,
    Remarks,
    Section,
    about,
    fixed,
    probability_written,
    significant,
)
from photogram.show.quantity import Quantity, Table, column, members, of_each
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, error_bars, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.components import Component, Estimate
from photogram.statistics.findings import Findings, GroupFactor
from photogram.statistics.variance_function import FunctionEstimate
from photogram.words import Phrase, phrase

INCHES_OF_COMPONENT = 0.32
MARGIN = 1.1  # Limits relative to the extreme values


@dataclass(frozen=True, eq=False, repr=False)
class VarianceComponents(Judged, Tabular):
    """Variance components of groups of observations.

    Attributes
    ----------
    estimate
        The components, the Helmert matrix, steps and messages.
    network
        The block or collection with all standard deviations multiplied by the roots of the components.
    result
        The adjustment of this network.
    first
        The adjustment with the given standard deviations.
    """

    estimate: Estimate
    network: Any
    result: AdjustedNetwork
    first: AdjustedNetwork

    @property
    def components(self) -> tuple[Component, ...]:
        """The estimated and fixed components."""
        return self.estimate.components

    @property
    def worth_changing(self) -> list[Component]:
        """Components significantly different from 1, by more than 25 percent of the sd."""
        return [each for each in self.components if each.worth_changing]

    def plot(self) -> Plot:
        """Plot factors of standard deviations with 95 percent intervals; circles are fixed components."""
        marks, values = list[Mark](), [1.0]
        for place, each in enumerate(self.components):
            at = np.array([[each.factor_of_sd, place]])
            values.append(each.factor_of_sd)
            if each.held:
                marks.append(Markers(at, "o", 6.0, FAINT, "none"))
                continue
            colour, ends = MARKED if each.worth_changing else INK, each.interval_of_sd
            marks += [Line(np.column_stack([ends, [place, place]]), colour), Markers(at, "o", 6.0, colour)]
            values += ends
        known = np.array([value for value in values if math.isfinite(value) and value > 0])
        up = (len(self.components) - 0.5, -0.5)
        limits = np.column_stack([(known.min() / MARGIN, known.max() * MARGIN), up])
        given = Line(np.column_stack([[1.0, 1.0], up]), FAINT, 0.8)
        across = about("components.factors")
        names = [each.name for each in self.components]
        panel = Panel(limits, [given, *marks], "", across, up_names=names, log_across=True)
        return Plot(6.4, 1.6 + INCHES_OF_COMPONENT * len(self.components), [panel])

    def __getitem__(self, name: str) -> Component:
        for each in self.components:
            if name == each.name or name in each.members:
                return each
        raise KeyError(name)

    def _findings(self) -> Findings:
        """Return tests with these weights; optimistic given weights reject good observations."""
        estimated = [
            GroupFactor(each.name, each.factor_of_sd, each.interval_of_sd, each.worth_changing)
            for each in self.components
            if not each.held
        ]
        return replace(
            self.result._findings(),
            global_test=self.first._findings().global_test,
            components=estimated,
            if_usable=statement(self)[:1],
            if_withheld=(),
        )

    def document(self) -> Document:
        """Return the document: verdict, first actions, components."""
        estimate, equality = self.estimate, self.estimate.equality
        of_equality = ("likelihood_ratio", "degrees_of_freedom", "probability")
        of_step = ("factors", "squares", "redundancy")
        return verdict_document(
            self.verdict,
            "Variance components",
            "",
            sections=[components_section(self)],
            members={
                **members(estimate, "converged", "level", helmert_matrix="matrix"),
                "messages": [str(message) for message in estimate.messages],
                "all_equal": equality and dict(zip(of_equality, equality, strict=True)),
                "steps": [dict(zip(of_step, step, strict=True)) for step in estimate.steps],
            },
        )


def weighed_document(found: VarianceComponents, network: Document) -> Document:
    own = found.document()
    sections = [*own.sections, *network.sections]
    return replace(network, judgements=own.judgements, advice=own.advice, sections=sections)


def components_section(found: VarianceComponents) -> Section:
    rows, reference = found.components, found.estimate.reference
    low, high = np.array([each.interval for each in rows]).reshape(-1, 2).T
    codes = ["fixed" if each.held else "to-change" if each.worth_changing else "unchanged" for each in rows]
    held = np.array([bool(each.held) for each in rows], dtype=bool)
    columns = [
        *sum_columns(rows),
        of_each(rows, "factor", name="factor", head="Component", decimals=3),
        of_each(rows, "sd", name="sd_factor", head="sd", decimals=3),
        of_each(rows, "least_sd", name="least_sd_factor"),
        column("low", low, "From", decimals=3),
        column("high", high, "To", decimals=3),
        of_each(rows, "factor_of_sd", name="factor_of_sd", head="Factor of sd", decimals=3),
        column("factor_to_images", [each.factor / reference for each in rows], "To images", decimals=3),
        of_each(rows, "test_value", name="test_value"),
        of_each(rows, "probability", name="probability", head="p", figures=2, seen=~held),
        of_each(rows, "significant", name="significant"),
        of_each(rows, "held", kind="name", name="held"),
        Quantity([about(f"outcome.{code}") for code in codes], kind="name", head="Outcome"),
    ]
    parts: list[Part] = [
        Remarks([*map(str, statement(found))]),
        Drawing("picture-components", "Variance components", about("components.caption"), found.plot),
        Table("components", "Components", columns, about("components.interval")),
        Remarks([*map(str, found.estimate.messages)]),
    ]
    return Section("components", "Variance components", parts, about("components"))


def statement(found: VarianceComponents) -> list[Phrase]:
    """Return messages on necessary changes."""
    estimate = found.estimate
    if not estimate.converged:
        return [phrase("variance.not-converged")]
    messages = []
    for each in found.worth_changing:
        code, factor, (low, high) = "variance.small", each.factor_of_sd, each.interval_of_sd
        if factor < 1:
            code, factor, low, high = "variance.large", 1 / factor, 1 / high, 1 / low
        messages.append(phrase(code, group=each.name, factor=factor, low=low, high=high))
    messages = messages or [phrase("variance.unchanged")]
    if estimate.equality is not None:
        ratio, freedom, probability = estimate.equality
        messages.append(phrase("variance.equal", p=probability, ratio=ratio, freedom=freedom))
    return messages


OUTSIDE = 0.025  # Probability on each side of an interval


@dataclass(frozen=True)
class Bin:
    """Images with similar radii."""

    value: float  # Their mean radius
    count: int  # number of coordinates, sum of redundancy numbers
    redundancy: float
    factor: float  # Factor of the variance by residuals: that of the function, times q / r with its weights
    # Its 95 percent interval (Satterthwaite); NaN with too little redundancy
    interval: tuple[float, float]

    @classmethod
    def of(cls, each: GroupSum, value: float, factor: float) -> Self:
        if each.test is None:
            return cls(value, each.count, each.redundancy, math.nan, (math.nan, math.nan))
        found, quantile = factor * each.squares / each.redundancy, _photocore.chi_square_quantile
        high, low = (quantile(OUTSIDE, each.freedom, upper=upper) / each.freedom for upper in (True, False))
        return cls(value, each.count, each.redundancy, found, (found / high, found / low))


@dataclass(frozen=True, eq=False, repr=False)
class VarianceFunction(Tabular):
    """Variance of image coordinates: sigma^2 = sd^2 (a^2 + b^2 (r / R)^2).

    Attributes
    ----------
    name
        The argument: `radius` or `value`.
    largest
        R, the largest of the images.
    estimate
        The coefficients (a^2, b^2) with their covariance.
    bins
        Quantiles of the radius.
    network, result
        The network with these weights, and its adjustment.
    """

    name: str
    largest: float
    estimate: FunctionEstimate
    bins: tuple[Bin, ...]
    network: Any
    result: AdjustedNetwork

    @property
    def test_value(self) -> float:
        """The test value of the growth: b^2 over its standard deviation."""
        return float(self.estimate.coefficients[1] / self.estimate.sd[1])

    @property
    def probability(self) -> float:
        """One-sided probability of a larger growth by chance, since b^2 is not negative."""
        return math.erfc(self.test_value / math.sqrt(2)) / 2

    def factor(self, value: float) -> float:
        """Return the factor of the given variance at a radius."""
        a, b = self.estimate.coefficients.tolist()
        return float(a + b * (value / self.largest) ** 2)

    def plot(self) -> Plot:
        """Plot factors of ten quantiles with 95 percent intervals, and the function."""
        places = np.array([[each.value, each.factor] for each in self.bins])
        low, high = np.array([each.interval for each in self.bins]).T
        x = np.linspace(0.0, self.largest, 100)
        curve = np.array([self.factor(value) for value in x.tolist()])
        across = spread(x, places[:, 0])
        marks = [
            Line(error_bars(places, low, high), INK, 1.5),
            Markers(places, "o", 6.0, label="residuals, 95 percent"),
            Line(np.column_stack([x, curve]), MARKED, label="function"),
            Line(np.column_stack([across, [1.0, 1.0]]), FAINT, 0.8, label="given variance"),
        ]
        unit = f", {getattr(self.network, 'image_unit', 'px')}" if self.name == "radius" else ""
        limits = np.column_stack([across, (0.0, spread(0.0, 1.0, curve, places[:, 1], high)[1])])
        panel = Panel(limits, marks, "", f"{self.name}{unit}", "factor of the given variance", legend="below")
        return Plot(6.4, 4.0, [panel])

    def document(self) -> Document:
        """Return the document: the function, and quantiles of the radius."""
        estimate = self.estimate
        low, high = np.array([each.interval for each in self.bins]).reshape(-1, 2).T
        columns = [
            of_each(self.bins, "value", name=self.name, head=self.name.capitalize(), figures=4),
            of_each(self.bins, "count", name="coordinates", head="Number", decimals=0),
            of_each(self.bins, "redundancy", name="redundancy", head="Redundancy", decimals=2),
            of_each(self.bins, "factor", name="factor", head="Factor", decimals=3),
            column("low", low, "From", decimals=3),
            column("high", high, "To", decimals=3),
            column("function", [self.factor(each.value) for each in self.bins], "Function", decimals=3),
        ]
        bins = Table("bins", "Quantiles: factor of the given variance", columns)
        values = zip(("a^2", "b^2"), estimate.coefficients.tolist(), estimate.sd.tolist(), strict=True)
        facts = [
            Fact(
                "Variance",
                str(phrase("variance.model", name=self.name, largest=significant(self.largest, 6))),
            ),
            *(Fact.of(name, value, note=f"sd {fixed(sd, 4)}", decimals=4) for name, value, sd in values),
            Fact.of(
                "b^2 / sd",
                self.test_value,
                note=str(phrase("variance.no-growth", p=probability_written(self.probability))),
                decimals=2,
            ),
        ]
        remarks = []
        if not estimate.converged:
            remarks.append(phrase("variance.no-function", steps=estimate.steps))
        function = Section("function", "Function", [Facts("", facts)])
        more = {**members(estimate, "coefficients", "covariance", "converged")}
        more |= {"of": self.name, **members(self, "largest", "test_value", "probability")}
        sections = [remarks_section(remarks), function, Section.of(bins)]
        return Document("Variance function", "", [], [], [], sections, more)
