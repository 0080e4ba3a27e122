"""Test values of observations against the normal distribution."""

from __future__ import annotations

from dataclasses import replace
from heapq import nlargest
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.show.sketch.marks import Line, Mark, Markers, Names, Panel, band, horizontal_line, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, INK, MARKED, SKY
from photogram.statistics.distributions import bonferroni, critical_normal
from photogram.statistics.patterns import SPEAKING
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.statistics.findings import Tested

NORMAL = NormalDist()
MAX_QUANTILES = 1500  # Test values drawn against the normal distribution, with all of the ends
END_VALUES = 200  # Smallest and largest test values that are all drawn
MAX_NAMES = 5
LEVEL = 0.05
MAX_TEST_VALUE = 6.0  # The histogram counts test values beyond at its ends


def tests(result: Any) -> Plot:
    """Plot test values w of all observations: histogram and quantiles against the normal distribution.

    w = residual / (standard deviation x root of redundancy number) is standard normal if the given standard
    deviations are correct and the data are free of gross errors.

    Raises
    ------
    InputError
        If test values were not computed (`covariance=False`).
    """
    drawn = result._plot_data()
    groups, outlying = [_speaking(each) for each in drawn.tested], drawn.outlying
    values = np.concatenate([each.values.ravel() for each in groups])
    tested = np.isfinite(values)
    marked, values = np.concatenate([each.ravel() for each in outlying])[tested], values[tested]
    if len(values) < 2:
        raise InputError(phrase("plot.tests"))
    found = (
        (float(each.values[index]), each, index)
        for each, own in zip(groups, outlying, strict=True)
        for index in map(tuple, np.argwhere(own & np.isfinite(each.values)).tolist())
    )
    largest = nlargest(MAX_NAMES, found, key=lambda one: abs(one[0]))
    worst = [(value, str(each.name(index))) for value, each, index in largest]
    quantiles = _quantiles(values, marked, worst, drawn.unit_weight)
    return Plot(10.0, 4.6, [_histogram(values, drawn.unit_weight), quantiles], 2)


def _speaking(group: Tested) -> Tested:
    """Return a group without components of negligible size, which peak at 0."""
    values = group.values
    largest = [np.fmax.reduce(np.abs(own), initial=0.0) for own in values.reshape(len(values), -1).T]
    silent = np.less(largest, SPEAKING).reshape(values.shape[1:])
    return replace(group, values=np.where(silent, np.nan, values)) if silent.any() else group


def _histogram(values: Floats, unit_weight: float) -> Panel:
    reach = float(np.clip(1.02 * np.abs(values).max(), 3.5 * min(unit_weight, 1.0), MAX_TEST_VALUE))
    number = int(np.clip(2 * round(np.sqrt(len(values))), 12, 60))
    counts, edges = np.histogram(values, number, (-reach, reach))
    density = counts / (len(values) * np.diff(edges))
    x = np.linspace(-reach, reach, 241)
    across, up = np.repeat(edges, 2)[1:-1], np.repeat(density, 2)
    marks: list[Mark] = [band(across, 0.0 * up, up, SKY, 0.6, f"{len(values):,} test values")]
    normal = np.column_stack([x, _bell(x, 1.0)])
    marks.append(Line(normal, label="normal, standard deviations as given"))
    if abs(unit_weight - 1.0) > 0.02:
        label = f"normal, standard deviations × {unit_weight:.3g}"
        marks.append(Line(np.column_stack([x, _bell(x, unit_weight)]), MARKED, dash="--", label=label))
    beyond = int((np.abs(values) > reach).sum())
    return Panel(
        np.column_stack([spread(edges), (0.0, 1.35 * max(float(density.max()), 0.4))]),
        marks,
        f"Histogram: mean {values.mean():.2f}, standard deviation {values.std():.2f}",
        "test value w",
        "density",
        notes=[f"{beyond:,} test values lie beyond ±{reach:.1f}" if beyond else ""],
        legend="below",
    )


def _bell(x: Floats, sd: float) -> Floats:
    return np.asarray(np.exp(-0.5 * (x / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi)))


def _quantiles(values: Floats, marked: Bools, worst: list[tuple[float, str]], unit_weight: float) -> Panel:
    order, n = np.argsort(values), len(values)
    rows, every = np.arange(n), values[order]
    if n > MAX_QUANTILES:  # All extremes, some between
        inner = np.linspace(END_VALUES, n - END_VALUES - 1, MAX_QUANTILES - 2 * END_VALUES)
        rows = np.r_[:END_VALUES, inner.round().astype(np.int64), n - END_VALUES : n]
    probability = (rows + 0.5) / n
    expected, ordered, beyond = normal_quantiles(probability), every[rows], marked[order][rows]
    # Approximate, for order statistics of independent values; residuals are nearly independent.
    spread = 1.96 * np.sqrt(probability * (1.0 - probability) / n) / _bell(expected, 1.0)
    ends, places = expected[[0, -1]], np.column_stack([expected, ordered])
    marks: list[Mark] = [
        band(expected, expected - spread, expected + spread, FAINT, 0.35, label="95 % of normal values"),
        Line(np.column_stack([ends, ends]), width=0.9, label="standard deviations as given"),
    ]
    if abs(unit_weight - 1.0) > 0.02:
        label = f"standard deviations × {unit_weight:.3g}"
        marks.append(Line(np.column_stack([ends, unit_weight * ends]), MARKED, 0.9, "--", label=label))
    limit = critical_normal(bonferroni(LEVEL, n))
    marks.append(Markers(places[~beyond], ".", 4.0, BLUE))
    if beyond.any():
        label = f"outliers of the verdict ({int(marked.sum()):,})"
        marks.append(Markers(places[beyond], "D", 4.0, MARKED, label=label))
    marks += [horizontal_line(height, FAINT, 0.7, ":") for height in (limit, -limit)]
    if worst:
        sizes, names = zip(*worst, strict=True)
        at = normal_quantiles((np.minimum(np.searchsorted(every, sizes), n - 1) + 0.5) / n)
        marks.append(Names(np.column_stack([at, sizes]), names, [INK] * len(worst)))
    reach = 1.3 * max(float(np.abs(ordered).max()), limit)
    return Panel(
        np.column_stack([1.08 * ends, [-reach, reach]]),
        marks,
        f"Quantiles: limit of {n:,} tests ±{limit:.2f} (dotted)",
        "normal quantile",
        "test value w",
        legend="below",
    )


def normal_quantiles(probability: Floats) -> Floats:
    return np.array([NORMAL.inv_cdf(p) for p in probability.tolist()])
