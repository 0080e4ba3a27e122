"""A variance function of image coordinates, with plots, tables and documents."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from photogram import _photocore
from photogram.lazy_dataclasses import dataclass
from photogram.results.group_sums import GroupSum
from photogram.results.network import AdjustedNetwork
from photogram.show.judgement import remarks_section
from photogram.show.methods import Brief, Documented
from photogram.show.page import Document, Fact, Facts, Section
from photogram.show.quantity import Table, column, members, of_each
from photogram.show.sketch.marks import Line, Markers, Panel, error_bars, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.variance_function import FunctionEstimate

if TYPE_CHECKING:
    import pandas as pd

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
        """Return the bin of a group with the weights of the function."""
        found, interval = math.nan, (math.nan, math.nan)
        if each.test is not None:
            found = factor * each.squares / each.redundancy
            limits = [
                _photocore.chi_square_quantile(OUTSIDE, each.freedom, upper=upper) / each.freedom
                for upper in (True, False)
            ]
            interval = (found / limits[0], found / limits[1])
        return cls(value, each.count, each.redundancy, found, interval)


@dataclass(frozen=True, eq=False, repr=False)
class VarianceFunction(Documented, Brief):
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
        panel = Panel(limits, marks, "", f"{self.name}{unit}", "factor of the given variance", legend="best")
        return Plot(6.4, 4.0, [panel])

    def table(self) -> pd.DataFrame:
        """Return the bins as a data frame."""
        return self.bins_table().frame()

    def bins_table(self) -> Table:
        """Return the declared table: bin means, redundancy, both factors."""
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
        return Table("bins", "Quantiles: factor of the given variance", columns)

    def document(self) -> Document:
        """Return the document: the function, and quantiles of the radius."""
        estimate = self.estimate
        values = zip(("a^2", "b^2"), estimate.coefficients.tolist(), estimate.sd.tolist(), strict=True)
        facts = [
            Fact("Variance", f"given variance x (a^2 + b^2 ({self.name} / {self.largest:.6g})^2)"),
            *(Fact(name, f"{value:.4f}", note=f"sd {sd:.4f}") for name, value, sd in values),
            Fact(
                "b^2 / sd",
                f"{self.test_value:.2f}",
                note=f"probability {self.probability:.2g} where nothing grows",
            ),
        ]
        remarks = []
        if not estimate.converged:
            remarks.append(f"not converged after {estimate.steps} adjustments: do not use it")
        function = Section("function", "Function", [Facts("", facts)])
        more = {**members(estimate, "coefficients", "covariance", "converged")}
        more |= {"of": self.name, **members(self, "largest", "test_value", "probability")}
        sections = [remarks_section(remarks), function, Section.of(self.bins_table())]
        return Document("Variance function", "", [], [], [], sections, more)
