"""All observations of an adjusted network with their test values, for the tests of single observations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.results.network import AdjustedNetwork
from photogram.results.observation_kinds import parts_of, tested_kind
from photogram.statistics.findings import Observations, Tested, by_t, by_w
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.verdict import Verdict
from photogram.words import Phrase

IMAGE_COORDINATES = Phrase("test.image_coordinates")
"""The kind of single image coordinates."""


def tested_observations(result: AdjustedNetwork) -> list[Observations]:
    """Return all observations with their standardized residuals, where these say something, kind by kind."""
    terms = result._terms()
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
