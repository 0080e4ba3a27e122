"""Observations of every kind, as reports list and test them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.messages import counted, listed
from photogram.results.network import AdjustedNetwork, Observed
from photogram.results.network_tables import control, images, part, terms_of
from photogram.results.observation_kinds import parts_of, tested_kind
from photogram.show.lines import field, stacked, table_lines
from photogram.show.quantity import Quantity, chosen, labelled, long
from photogram.statistics.findings import Observations, Tested, by_t, by_w
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.verdict import Verdict
from photogram.words import Phrase

NOTABLE = 3.0
"""Test values above are listed; what decides is the limit of the tests, which stands in the verdict."""
SUSPECTS = 20
"""Image coordinates with large test values that are listed at most."""
IMAGE_COORDINATES = Phrase("test.image_coordinates")
"""The kind of single image coordinates."""
LISTED = 10_000
"""Photos, points, observations of a kind that a report lists at most; tables and documents have every one."""


def tested_observations(result: AdjustedNetwork) -> list[Observations]:
    """Return all observations with their standardized residuals, where these say something, kind by kind."""
    terms = terms_of(result)
    photos, points = terms.photos, terms.points

    def image(index: tuple[int, ...]) -> Phrase:
        point, photo = result.image_points[index[0]], result.given.image_photos[index[0]]
        return parts_of(
            "xy"[index[1]], Phrase("named.point", {"point": str(points[point]), "photo": str(photos[photo])})
        )

    def kind(
        what: Phrase, standardized: Floats, redundancy: Floats, named: Callable[[tuple[int, ...]], Phrase]
    ) -> Observations:
        tested = np.where(redundancy > TESTABLE, standardized, np.nan)
        return Observations(what, tested, named)

    return [
        kind(IMAGE_COORDINATES, result.standardized, result.redundancy, image),
        kind(
            Phrase("test.components_of_control"),
            result.point_standardized,
            result.point_redundancy,
            lambda index: parts_of(
                [terms.point_axes[index[1]].name], Phrase("named.control", {"point": str(points[index[0]])})
            ),
        ),
        kind(
            Phrase("test.components_of_stations"),
            result.photo_standardized,
            result.photo_redundancy,
            lambda index: parts_of(
                [terms.photo_axes[index[1]].name], Phrase("named.photo", {"photo": str(photos[index[0]])})
            ),
        ),
        *map(tested_kind, terms.kinds),
    ]


_GROUPS = {
    "test.image_coordinates": "test.images",
    "test.components_of_control": "test.control",
    "test.components": "test.observations",
}
"""Kinds of groups of observations by kinds of their components."""
_STATIONS = {"test.positions": slice(3), "test.attitudes": slice(3, None)}
"""Kinds of groups of stations, and their components."""


def outlying(verdict: Verdict, tested: Observations | Tested) -> Bools:
    """Return which components of observations are outliers of a verdict, or parts of groups that are."""
    found = np.zeros(np.shape(tested.values), dtype=bool)
    kind = tested.kind
    if not isinstance(kind, Phrase):
        return found
    groups = {_GROUPS[kind.code]: slice(None)} if kind.code in _GROUPS else _STATIONS
    for place in verdict.outlying.get(kind, ()):
        found[place] = True
    for code, components in groups.items():
        rows = [place[0] for place in verdict.outlying.get(Phrase(code, kind.fields), ())]
        found[rows, components] = True
    return found


def tested_singly(result: AdjustedNetwork) -> list[Tested]:
    """Return their tests: w where standard deviations are given, t where they hold but for a factor."""
    observations = tested_observations(result)
    if result.KNOWN:
        return [by_w(each) for each in observations]
    return [by_t(each, *result.sum_and_freedom) for each in observations]


def image_lines(result: AdjustedNetwork) -> list[str]:
    """List the image observations, one point a line: what `tested` has."""
    used = np.flatnonzero(result.used_images)
    photos, points, *numbers = images(result, used[:LISTED])
    forms = ((".2f", "{name} residual {unit}"), (".3f", "{name} redundancy"), (".2f", "{name} standardized"))
    own = [part(each, slice(axis, axis + 1)) for axis in (0, 1) for each in numbers]
    fields = [field(each, 16, *form) for each, form in zip(own, forms * 2, strict=True)]
    names = [*field(photos, 10, head="photo"), *field(points, 10, head="point", gap=" ")]
    found = table_lines([*names, *chain(*fields)])
    if len(used) > LISTED:
        found.append(f"and {len(used) - LISTED} more; the JSON document and the table of images have all")
    return found


def largest(table: Sequence[Quantity], sizes: Floats, of: str) -> tuple[list[Quantity], list[str]]:
    """Return what a report lists of a table, those with the largest sizes (r,), and a line on all others."""
    if len(sizes) <= LISTED:
        return [*table], []
    more = f"and {len(sizes) - LISTED} more, of smaller {of}; the JSON document and the tables have all"
    return chosen(table, largest_of(sizes, LISTED)), [more]


def largest_of(sizes: Floats, most: int) -> Indices:
    """Return the rows of the `most` largest sizes, in their order; unknown ones are the smallest."""
    return np.sort(np.argsort(-np.nan_to_num(sizes), kind="stable")[:most])


def observed_lines(table: Sequence[Quantity], kind: str) -> list[str]:
    """List observed photos or points, four lines for each: what was observed, and how it fits."""
    forms = {"sd": ".5f", "difference": ".5f", "redundancy": ".3f", "standardized": ".2f"}
    tests = np.nan_to_num(np.abs(labelled(table, "standardized").values))
    table, more = largest(table, tests.max(axis=1, initial=0.0), "test values")
    lines = stacked(table[0], kind, [(labelled(table, label), form) for label, form in forms.items()])
    return [*lines, *more]


def is_held(control: Observed) -> Bools:
    """Return (r,) whether points are held in all their coordinates: nothing tests them."""
    found: Bools = (control.sd == 0).all(axis=1)
    return found


def control_lines(result: AdjustedNetwork) -> list[str]:
    """List control as observations; points that are held in one line."""
    table, held = control(result), is_held(result.control)
    weighted, names = np.flatnonzero(~held), [str(each) for each in np.asarray(table[0].values)[held]]
    told = [f"{counted(len(names), 'point')} held where given, which nothing tests: {listed(names)}"]
    return [*(observed_lines(chosen(table, weighted), "point") if len(weighted) else ()), *told[: len(names)]]


def suspect_lines(result: AdjustedNetwork, tests: Floats, statistic: str) -> list[str]:
    """List image coordinates whose |test values|, (m, 2), are above `NOTABLE`, the largest first."""
    size = np.where(result.redundancy > TESTABLE, np.nan_to_num(np.abs(tests), posinf=np.inf), 0.0)
    places = np.argwhere(size > NOTABLE)
    order = np.argsort(-size[tuple(places.T)], kind="stable")[:SUSPECTS]
    rows, axis = places[order].T
    *own, values = images(result, rows)
    table = long([*own, replace(values, values=tests[rows])], np.column_stack([np.arange(len(rows)), axis]))
    photos, points, names, _, residuals, redundancy, values = table
    found = table_lines(
        [
            *field(photos, 10, head="photo"),
            *field(points, 10, head="point", gap=" "),
            *field(names, 5, gap=" ", head=""),
            *field(residuals, 12, ".2f", "residual"),
            *field(redundancy, 12, ".3f", "redundancy"),
            *field(values, 14, ".2f", statistic),
        ]
    )
    return found if len(rows) == len(places) else [*found, f"and {len(places) - len(rows)} more"]
