"""The tables of an adjusted block, quantity by quantity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.results import tests
from photogram.results.features import Features, deviation_quantities, quantity_columns
from photogram.results.group_sums import grouped, observables, sums_of
from photogram.results.network_tables import (
    component_axis,
    deviation,
    difference,
    names,
    point_axes,
    redundancy,
    test_value,
)
from photogram.results.parts import AdjustedCamera, AdjustedUnknown, ObservedKind
from photogram.show.quantity import Axis, Quantity, attribute, column, component, joined, long
from photogram.statistics.reliability import TESTABLE

if TYPE_CHECKING:
    from photogram import Result

_EITHER = "standard deviation that was given, or is assumed: {}"


def check_points(result: Result) -> list[Quantity]:
    """Return check points: adjusted minus given, standard deviations of both, tests with probabilities."""
    checks = result.check_points
    statistic, p = checks.statistics
    return [
        *_compared(result, checks.rows, checks.differences, checks.given_sd),
        attribute(checks, "assumed", about="whether standard deviations of control are assumed"),
        column("statistic", statistic, about="T, or F if the unit weight is estimated"),
        Quantity(p, name="probability", member="p", about="of a larger statistic without errors"),
    ]


def unheld(result: Result) -> list[Quantity]:
    """Return the free components of control with a given value."""
    held = np.isfinite(result.block.point_sd)
    there = held.any(axis=1, keepdims=True) & ~held & result.used_points[:, np.newaxis]
    differences = np.where(there, result.point_differences, np.nan)
    rows = np.flatnonzero(np.isfinite(differences).any(axis=1))
    unknown = np.full((len(rows), 3), np.nan)
    return _compared(result, rows, differences[rows], unknown)


def _compared(result: Result, rows: Indices, differences: Floats, given_sd: Floats) -> list[Quantity]:
    terms, axes, sd = result._terms(), point_axes(result.block), result.point_sd[rows]
    with np.errstate(all="ignore"):
        tests = differences / np.hypot(sd, np.nan_to_num(given_sd))
    return [
        names(terms, "point", rows, "id"),
        Quantity(result.given.point_positions[rows], axes, "value", head="Given"),
        Quantity(result.point_positions[rows], axes, "value", head="Adjusted"),
        difference(differences, axes),
        deviation(sd, axes, head="sd adjusted"),
        deviation(given_sd, axes, name="given_sd", member="given_sd", head="sd given", about=_EITHER),
        Quantity(tests, axes, head="Test value", decimals=2),
    ]


def observations(kind: ObservedKind) -> list[Quantity]:
    axes = tuple(map(component_axis, kind.components, kind.units))
    kinds, names = (np.array(texts, dtype=object) for texts in ([kind.kind] * len(kind.names), kind.names))
    return [
        column("kind", kinds, kind="name", about="what it is"),
        Quantity(names, kind="name", name="of", about="names of points and photos", head="Of"),
        deviation(kind.sd, axes, head="sd given"),
        column(
            "residual",
            kind.residuals,
            "Residual",
            axes=axes,
            kind="deviation",
            about="observed minus adjusted",
        ),
        redundancy(kind.redundancy, axes),
        test_value(kind.standardized, axes),
    ]


def observed_components(result: Result) -> list[Quantity]:
    """Return the observed and used components of observations as rows."""
    kinds = result.kinds.values() or [_NOTHING]
    return joined([long(observations(each), np.argwhere(~np.isnan(each.residuals))) for each in kinds])


_EMPTY, _NONE = np.zeros((0, 1)), np.zeros(0)
_NOTHING = ObservedKind(
    *("", np.zeros(0, dtype=np.int64), [], ("",), ("",)), *(_EMPTY, _EMPTY, _EMPTY, _EMPTY), *(_NONE, _NONE)
)


def redundancy_by_kind(result: Result) -> list[Quantity]:
    """Return number, redundancy, sum of squares and sd factor of every type, if known."""
    names, numbers = list[str](), np.zeros((0, 3))
    if result.redundancies is not None and result.loss is None:
        grouping = grouped(observables(result), "kind")
        counts, squares, redundancy = sums_of(result, grouping)
        names, numbers = list(grouping.groups.names), np.column_stack([counts, redundancy, squares])
        others = result.redundancies.total - float(redundancy.sum())
        if abs(others) > TESTABLE:
            names.append("cameras and common unknowns")
            numbers = np.vstack([numbers, [np.nan, others, np.nan]])
        names.append("all")
        total = [np.nan, result.redundancies.total, result.sums_of_squares.total]
        numbers = np.vstack([numbers, total])
    count, redundancy, squares = numbers.T
    own = redundancy > TESTABLE
    own[-1:] = False
    factor = np.sqrt(np.divide(squares, redundancy, out=np.full(len(own), np.nan), where=own))
    return [
        Quantity(names, kind="name", head="Kind of observation"),
        Quantity(count, head="Number", decimals=0),
        Quantity(redundancy, head="Redundancy", decimals=2),
        Quantity(squares, head="Weighted sum of squares", decimals=2),
        Quantity(factor, head="Factor of sd", decimals=3),
    ]


def unknowns(every: Sequence[AdjustedUnknown]) -> list[Quantity]:
    """Return components of common unknowns; given sd are infinite if free."""
    axes = tuple(
        component_axis(*both) for each in every for both in zip(each.components, each.units, strict=True)
    )
    rows: dict[str, Any] = {"of": np.arange(len(axes))}
    value = Quantity(_all(every, "values"), axes, "deviation", "value", "", "adjusted", **rows)
    return [
        Quantity(_each(every, "kind"), kind="name", name="kind", about="what it is", head="Kind"),
        Quantity(_each(every, "name"), kind="name", name="unknown", about="name of the unknown", head="Name"),
        *component(axes, **rows),
        deviation(_all(every, "given.deviations"), axes, **rows, **_GIVEN_SD),
        replace(value, head="Adjusted", figures=7),
        difference(_all(every, "change"), axes, **rows, name="change", head="Change"),
        deviation(_all(every, "sd"), axes, **rows, head="sd adjusted"),
        redundancy(_all(every, "redundancy"), axes, **rows),
        test_value(_all(every, "standardized"), axes, **rows),
    ]


def camera_parameters(every: Sequence[AdjustedCamera]) -> list[Quantity]:
    """Return camera parameters; given sd are infinite if free, 0 if fixed."""
    axes = tuple(Axis(name, each.camera.unit_of(name)) for each in every for name in each.names)
    rows: dict[str, Any] = {"of": np.arange(len(axes))}
    names, units = component(axes, **rows)
    about = "which of its parameters"
    return [
        Quantity(_each(every, "name"), kind="name", name="camera", about="name of the camera"),
        Quantity(_each(every, "camera.model"), kind="name", name="model", about="model of the camera"),
        replace(names, name="parameter", member="name", about=about),
        replace(units, member="unit"),
        Quantity(_all(every, "given.values"), axes, "value", "given", "given", "as it was given", **rows),
        deviation(_all(every, "given.deviations"), axes, **rows, member="sd_given", **_GIVEN_SD),
        Quantity(_all(every, "values"), axes, "value", "value", "value", "adjusted", **rows),
        deviation(_all(every, "sd"), axes, **rows),
        redundancy(_all(every, "redundancy"), axes, **rows),
    ]


_GIVEN_SD: dict[str, Any] = {
    "name": "sd_given",
    "head": "sd given",
    "about": "standard deviation that was given: infinite free, 0 held",
    "words": {np.inf: "free"},
}


def _all(every: Sequence[Any], what: str) -> Floats:
    return np.concatenate([np.zeros(0), *map(attrgetter(what), every)])


def _each(every: Sequence[Any], what: str) -> Any:
    counts = [len(each.values) for each in every]
    return np.repeat(np.array([*map(attrgetter(what), every)], dtype=object), counts)


TABLES: dict[str, Callable[[Result], list[Quantity]]] = {
    **tests.TABLES,
    "check": check_points,
    "observation": observed_components,
    "camera": lambda result: camera_parameters(result.cameras),
    "unknown": lambda result: unknowns(result.unknowns),
    "feature": lambda result: quantity_columns(result.features or Features(())),
    "deviation": lambda result: deviation_quantities(result.features or Features(())),
}
