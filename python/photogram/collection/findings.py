"""What the verdict on an adjusted collection rests on."""

from __future__ import annotations

import numpy as np

from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.held import collection_held
from photogram.results.findings import ROBUST, has_redundancy, unseen
from photogram.results.groups_tested import groups_tested
from photogram.results.observed import tested
from photogram.results.patterns import CameraImages, patterns
from photogram.show.ways import findings_of
from photogram.statistics.findings import Findings, Systematic, Tested, by_f, by_t
from photogram.statistics.limits import global_test
from photogram.statistics.outliers import Observations

__all__ = ["collection_findings", "names", "tested_observations"]

NO_DATUM = (
    "Nothing gives the network a datum: shapes and relative precision can be used, absolute positions and the"
    " scale mean nothing."
)


@findings_of.register(AdjustedCollection)
def collection_findings(result: AdjustedCollection) -> Findings:
    """Return the tests of a collection.

    Standard deviations of pixels are guesses: single observations are tested against all others.
    """
    omega, freedom = result.weighted_sum_of_squares, result.degrees_of_freedom
    return Findings(
        status=result.status,
        observations=[*_tested(result), *(by_f(each, omega, freedom) for each in collection_held(result))],
        degrees_of_freedom=freedom,
        global_test=None if result.loss else global_test(omega, freedom),
        untested=ROBUST if result.loss else "no degrees of freedom",
        computed=has_redundancy(result),
        systematic=_patterns(result),
        remarks=unseen(result),
        snoop="--snoop (photogram.snoop)",
        check="`photogram.diagnose` of the collection",
        take_out="`--snoop` (`photogram.snoop`) takes gross errors out one after the other; `--loss huber`"
        " or `cauchy` lowers their weights.",
        if_usable=[NO_DATUM] if result.datum else [],
    )


def _tested(result: AdjustedCollection) -> list[Tested]:
    """Return the tests of groups; of single coordinates where a loss has changed the weights."""
    unit_weight = result.weighted_sum_of_squares, result.degrees_of_freedom
    summary = result.reliability_summary
    if summary is None:
        return [by_t(each, *unit_weight) for each in tested_observations(result)]
    return groups_tested(summary, unit_weight=unit_weight)


def _patterns(result: AdjustedCollection) -> list[Systematic]:
    collection = result.collection
    photos, _ = names(result)
    return patterns(
        result,
        collection.image_photos,
        collection.image_xy,
        np.broadcast_to(collection.image_sd, collection.image_xy.shape),
        [CameraImages("the cameras", np.ones(len(photos), dtype=bool), 0)],
        photos,
        ("px", 1.0),
    )


def tested_observations(result: AdjustedCollection) -> list[Observations]:
    """Return all observations with their standardized residuals, kind by kind."""
    collection = result.collection
    return tested(result, collection.image_photos, *names(result), collection.parameters, "XYZ")


def names(result: AdjustedCollection) -> tuple[list[str], list[str]]:
    """Return what photos and points are called: numbers from 0."""
    return [str(photo) for photo in range(len(result.photo_parameters))], [
        str(point) for point in range(len(result.point_positions))
    ]
