"""Tests of all observations, and the tables of an adjusted block, quantity by quantity."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results import network_tables, parts
from photogram.results.features import Features, deviation_quantities, quantity_columns
from photogram.results.grouping import sums_by_kind
from photogram.results.network_tables import (
    component_axis,
    deviation,
    difference,
    names,
    point_axes,
    redundancy,
    test_value,
)
from photogram.results.network_trial import KINDS, OBSERVATION, type_name
from photogram.show.forms import unit_written
from photogram.show.quantity import Axis, Link, Quantity, Table, column, component, joined, long
from photogram.statistics.distributions import lambda0
from photogram.statistics.findings import Tested
from photogram.statistics.reliability import TESTABLE, minimal_detectable_error
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram import Result
    from photogram.results.network import AdjustedNetwork


@dataclass(frozen=True, eq=False, kw_only=True)
class ComponentTests(Tested):
    """(k, c) tests of the single components of k observations of one type."""

    type: str  # `image`, `control`, `station` or the type of observation
    axes: tuple[Axis, ...]
    residuals: Floats
    sd: Floats
    redundancy: Floats
    groups: Mapping[Phrase, slice]  # types of the tests of groups, and the components of these
    photos: Indices | None = None  # (k,) of the observations
    points: Indices | None = None

    @property
    def observed(self) -> Bools:
        """(k, c) components with a standard deviation and a residual."""
        return np.isfinite(self.sd) & (self.sd > 0) & np.isfinite(self.residuals)


class Tests:
    """The tests of an adjusted network: of single components, and of groups."""

    def __init__(self, result: AdjustedNetwork) -> None:
        self._result, self._terms = result, result._terms

    @cached_property
    def normal(self) -> list[ComponentTests]:
        """Standardized residuals w of all components, type by type."""
        result, terms, given = self._result, self._terms, self._result.given

        def of_network(
            title: str, kind: str, what: str, code: str, groups: Mapping[str, slice], **of: Any
        ) -> ComponentTests:
            def name(row: int) -> Phrase:
                return phrase(code, **{each[:-1]: str(getattr(terms, each)[of[each][row]]) for each in of})

            axes = {"image": terms.image_axes, "control": terms.point_axes, "station": terms.photo_axes}[kind]
            names = (f"{what or 'image_'}given_sd", f"{what}redundancy", f"{what}standardized")
            values = getattr(result, f"{what}residuals"), *(getattr(result, each) for each in names)
            return replace(_component_tests(phrase(title), kind, axes, name, values, groups), **of)

        every, images = slice(None), {"photos": given.image_photos, "points": result.image_points}
        points, photos = (np.arange(len(names)) for names in (terms.points, terms.photos))
        control, poses = {"control": every}, {"positions": slice(3), "attitudes": slice(3, None)}
        titles = ("test.image_coordinates", "test.components_of_control", "test.components_of_stations")
        found = [
            of_network(titles[0], "image", "", "named.point", {"images": every}, **images),
            of_network(titles[1], "control", "point_", "named.control", control, points=points),
            of_network(titles[2], "station", "photo_", "named.photo", poses, photos=photos),
        ]
        for each in terms.kinds:
            title = phrase("test.components", kind=parts.kind_words(each.kind))
            name = partial(lambda kind, row: parts.named_observation(kind.kind, kind.names[row]), each)
            axes = tuple(map(component_axis, each.components, each.units))
            values = each.residuals, each.sd, each.redundancy, each.standardized
            found.append(_component_tests(title, each.kind, axes, name, values, {"observations": every}))
        return found

    @cached_property
    def components(self) -> list[ComponentTests]:
        """The tests of all components: w if the unit weight is known, else t."""
        if self._result.known_weight:
            return self.normal
        return [tests.studentized(*self._result.sum_and_freedom) for tests in self.normal]

    @property
    def groups(self) -> list[Tested]:
        """Tests of groups by type: T if the unit weight is known, else F."""
        result, summary = self._result, self._result.reliability_summary
        if summary is None:
            return []
        suspects, testable = summary.suspects, summary.testable
        types = []
        for kind in range(len(KINDS)):
            groups = np.flatnonzero(suspects.kinds == kind)
            rows = suspects.subjects[groups]
            if kind != OBSERVATION:
                types.append((type_name(kind), groups, rows))
                continue
            rows = self._terms.observation_rows[rows]
            for each in sorted(self._terms.kinds, key=lambda each: each.kind):
                own = np.isin(rows, each.rows)
                types.append((type_name(kind, each.kind), groups[own], np.searchsorted(each.rows, rows[own])))
        found = [
            Tested(
                title,
                np.where(testable[groups], summary.tests.statistic[groups], math.nan),
                lambda place, groups=groups: suspects.name(int(groups[place[0]])),  # type: ignore[misc]
                "T",
                summary.tests.rank[groups].astype(np.float64),
                rows=rows,
            )
            for title, groups, rows in types
            if testable[groups].any()
        ]
        if result.known_weight:
            return found
        tested = summary.standing if result.loss else result
        return [tests.studentized(*tested.sum_and_freedom) for tests in found]

    @cached_property
    def outliers(self) -> list[Bools]:
        """Components of each type that are outliers, or belong to outlying groups."""
        verdict, found = self._result.verdict, []
        for tests in self.normal:
            marks = verdict.marks(tests.kind, tests.values.shape)
            for kind, components in tests.groups.items():
                marks[[place[0] for place in verdict.outlying.get(kind, ())], components] = True
            found.append(marks)
        return found

    def largest(self, count: int) -> Indices:
        """Return (n, 3) indices of largest test values: type, observation, component."""
        found = []
        for order, tests in enumerate(self.components):
            sizes = np.nan_to_num(np.abs(tests.values)).ravel()
            few = np.flatnonzero(sizes > 0)
            if len(few) > count:
                few = few[np.argpartition(-sizes[few], count)[:count]]
            for index in few.tolist():
                row, component = divmod(index, tests.values.shape[1])
                found.append((-sizes[index], str(tests.kind), row, component, order))
        places = [(order, row, component) for *_, row, component, order in sorted(found)[:count]]
        return np.array(places, dtype=np.int64).reshape(-1, 3)

    def columns(self, places: Indices | None = None) -> list[Quantity]:
        """Return columns of all observed components, or of (n, 3) indices."""
        types = self.components
        if places is None:
            observed = [np.argwhere(tests.observed) for tests in types]
            places = np.vstack([np.insert(own, 0, k, axis=1) for k, own in enumerate(observed)])
        of_type, rows, parts = places.T
        names = ("residuals", "sd", "redundancy", "values", "log_p")
        numbers = {name: np.full(len(rows), np.nan) for name in names}
        owners = {name: np.full(len(rows), -1) for name in ("photos", "points")}
        marked = np.zeros(len(rows), dtype=bool)
        for k, tests in enumerate(types):
            own = of_type == k
            place = rows[own], parts[own]
            for name in names[:-1]:
                numbers[name][own] = getattr(tests, name)[place]
            numbers["log_p"][own] = replace(tests, values=tests.values[place]).log_probability()
            marked[own] = self.outliers[k][place]
            for name, found in owners.items():
                if (every := getattr(tests, name)) is not None:
                    found[own] = every[rows[own]]
        axes = tuple(axis for tests in types for axis in tests.axes)
        of = np.cumsum([0, *(len(tests.axes) for tests in types)])[of_type] + parts
        sd, shares, values = (numbers[name] for name in ("sd", "redundancy", "values"))
        freedom = math.inf if self._result.known_weight else self._result.sum_and_freedom[1]
        detectable = minimal_detectable_error(sd, shares, math.sqrt(lambda0(dof=freedom)))
        statistic = types[0].statistic
        units = np.array([unit_written(axis.small) for axis in axes], dtype=object)
        type_names = np.array([tests.type for tests in types], dtype=object)
        return [
            Quantity(type_names[of_type], kind="name", name="type"),
            Quantity(rows, kind="name", name="row"),
            self._linked("photo", self._terms.photos, owners["photos"]),
            self._linked("point", self._terms.points, owners["points"]),
            *component(axes, of),
            Quantity(numbers["residuals"], axes, "deviation", "residual", head="Residual", of=of),
            deviation(sd, axes, head="sd given", of=of),
            Quantity(units[of], kind="name", head="Unit"),
            redundancy(shares, axes, of=of),
            Quantity(detectable, axes, "deviation", "detectable", head="Detectable error", of=of),
            Quantity(values, name=statistic, head=f"Test value {statistic}", decimals=2, marked=marked),
            Quantity(np.exp(numbers["log_p"]), name="p", head="p", figures=2),
            Quantity(marked, kind="name", name="outlier"),
        ]

    @staticmethod
    def _linked(kind: str, names: np.ndarray, rows: Indices) -> Quantity:
        texts = np.append(names.astype(object), "")[rows]
        return Quantity(texts, (), "name", kind, head=kind.capitalize(), link=Link(kind, rows))


def _component_tests(
    title: Phrase,
    kind: str,
    axes: tuple[Axis, ...],
    name: Callable[[int], Phrase],
    values: tuple[Floats, Floats, Floats, Floats],
    groups: Mapping[str, slice],
) -> ComponentTests:
    """Return tests of a type by residuals, sd, redundancy numbers and w."""
    residuals, sd, shares, w = values
    return ComponentTests(
        kind=title,
        values=np.where(shares > TESTABLE, w, np.nan),
        name=lambda place: parts.parts_of([axes[place[1]].name], name(place[0])),
        type=kind,
        axes=axes,
        residuals=residuals,
        sd=sd,
        redundancy=shares,
        groups={Phrase(f"test.{code}", title.fields): components for code, components in groups.items()},
    )


_EITHER = "standard deviation that was given, or is assumed: {}"


def check_points(result: Result) -> list[Quantity]:
    """Return check points: adjusted minus given, standard deviations of both, tests with probabilities."""
    checks = result.check_points
    statistic = p = np.full(len(checks.rows), math.nan)
    if checks.agreement is not None:
        tested = checks.agreement.points
        statistic, p = tested.values, np.exp(tested.log_probability())
    return [
        *_compared(result, checks.rows, checks.differences, checks.given_sd),
        column("assumed", checks.assumed, about="whether standard deviations of control are assumed"),
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
    terms, axes, sd = result._terms, point_axes(result.block), result.point_sd[rows]
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


def observations(kind: parts.ObservedKind) -> list[Quantity]:
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
_NOTHING = parts.ObservedKind(
    *("", np.zeros(0, dtype=np.int64), [], ("",), ("",)), *(_EMPTY, _EMPTY, _EMPTY, _EMPTY), *(_NONE, _NONE)
)


def redundancy_by_kind(result: Result) -> list[Quantity]:
    """Return number, redundancy, sum of squares and sd factor of every type, if known."""
    rows: dict[str, tuple[float, float, float]] = {}
    if result.redundancies is not None and result.loss is None:
        rows |= sums_by_kind(result)
        rows["all"] = math.nan, result.redundancies.total, result.sums_of_squares.total
    count, redundancy, squares = np.array([*rows.values()]).reshape(-1, 3).T
    own = redundancy > TESTABLE
    own[-1:] = False
    factor = np.sqrt(np.divide(squares, redundancy, out=np.full(len(own), np.nan), where=own))
    return [
        Quantity([*rows], kind="name", head="Kind of observation"),
        Quantity(count, head="Number", decimals=0),
        Quantity(redundancy, head="Redundancy", decimals=2),
        Quantity(squares, head="Weighted sum of squares", decimals=2),
        Quantity(factor, head="Factor of sd", decimals=3),
    ]


def unknowns(every: Sequence[parts.AdjustedUnknown]) -> list[Quantity]:
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


def camera_parameters(every: Sequence[parts.AdjustedCamera]) -> list[Quantity]:
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


TABLES: dict[str, Callable[[Any], list[Quantity]]] = {
    **network_tables.TABLES,
    "test": lambda result: Tests(result).columns(),
    "check": check_points,
    "observation": observed_components,
    "camera": lambda result: camera_parameters(result.cameras),
    "unknown": lambda result: unknowns(result.unknowns),
    "feature": lambda result: quantity_columns(result.features or Features(())),
    "deviation": lambda result: deviation_quantities(result.features or Features(())),
}


TABLE_FILES = {
    "control": "control",
    "check_points": "check",
    "stations": "station",
    "observations": "observation",
    "cameras": "camera",
    "unknowns": "unknown",
    "features": "feature",
    "feature_deviations": "deviation",
}
"""Files with the kinds of their tables, without those of photos, points and images."""


def table_frame(result: AdjustedNetwork, what: str) -> pd.DataFrame:
    """Return a table of a result as a data frame."""
    return Table(what, "", TABLES[what](result)).frame()
