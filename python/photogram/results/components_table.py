"""The table and the sentences of variance components."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.show.quantity import Quantity, Table, of_each
from photogram.statistics.components import Component

if TYPE_CHECKING:
    from photogram import VarianceComponents


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
