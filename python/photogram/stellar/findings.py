"""Tests of star plates and sky exposures, and findings for their verdicts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE
from photogram.stellar.parameters import SIGNIFICANT
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight, Result

_PLACES = phrase("stars.places")
_AXES = ("right ascension", "declination")


def _testable(values: Floats, redundancy: Floats, unit: float) -> Floats:
    return np.where(np.nan_to_num(redundancy) > TESTABLE, values * unit, np.nan)


def plate_tests(result: Result) -> list[Tested]:
    """Return the tests of a plate: w for a given unit weight (option 14), else t."""
    problem, solved, given = result.problem, result.solved, result.problem.options.mean_error

    def image(index: tuple[int, ...]) -> Phrase:
        star = problem.star_ids[problem.image_stars[index[0]]]
        point = problem.image_points[index[0]]
        return phrase("stars.plate-coordinate", axis="xy"[index[1]], point=point, star=star)

    def star(index: tuple[int, ...]) -> Phrase:
        return phrase("stars.place", axis=_AXES[index[1]], star=problem.star_ids[index[0]])

    unit = 1 / given if given else 1.0
    images = np.abs(_testable(solved.standardized, solved.redundancy, unit))
    stars = np.abs(_testable(solved.star_standardized, solved.star_redundancy, unit))
    tests = [Tested(phrase("stars.plate-coordinates"), images, image), Tested(_PLACES, stars, star)]
    if given:
        return tests
    return [each.studentized(sum(solved.sums), result.degrees_of_freedom) for each in tests]


def plate_findings(result: Result) -> Findings:
    """Return the findings on a plate."""
    given = bool(result.problem.options.mean_error)
    weak = [name for name, ratio in result.significance().items() if ratio < SIGNIFICANT]
    return Findings(
        status="converged" if result.converged else "not converged",
        observations=plate_tests(result),
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.freedom" if given else "untested.mean-error"),
        scaled=not given,
        spoiled=result.spoiled,
        if_usable=[
            *([Phrase("advice.weak-terms", {"names": weak})] if weak else []),
            Phrase("advice.camera-of-plate"),
        ],
        if_withheld=[Phrase("advice.camera-withheld")],
    )


def night_tests(result: CalibratedNight) -> list[Tested]:
    """Return the tests of exposures: t, since the pixel standard deviation is assumed."""
    found, freedom = result.calibration, result.calibration.degrees_of_freedom

    def image(index: tuple[int, ...]) -> Phrase:
        (x, y), exposure = found.xy[index[0]].tolist(), result.names[found.exposures[index[0]]]
        return phrase("stars.pixel-coordinate", axis="xy"[index[1]], x=x, y=y, exposure=exposure)

    def star(index: tuple[int, ...]) -> Phrase:
        name = result.night.catalogue.ids[found.catalogue[index[0]]]
        return phrase("stars.place", axis=_AXES[index[1]], star=name)

    images = _testable(found.standardized, found.redundancy, found.mean_error)
    stars = _testable(found.star_standardized, found.star_redundancy, found.mean_error)
    tests = [Tested(phrase("stars.image-coordinates"), images, image), Tested(_PLACES, stars, star)]
    return [each.studentized(found.mean_error**2 * freedom, freedom) for each in tests]


def night_findings(result: CalibratedNight) -> Findings:
    """Return the findings on exposures of the sky."""
    doubtful = [
        Phrase("part.exposure", {"name": str(name), "odds": float(odds)})
        for name, odds in result.doubtful.items()
    ]
    return Findings(
        status=result.calibration.status,
        observations=night_tests(result),
        degrees_of_freedom=result.calibration.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.freedom"),
        doubtful=[*doubtful, *([Phrase("part.mostly-left-out")] if result.mostly_left_out else [])],
        if_usable=[Phrase("advice.camera-of-night")],
        if_withheld=[Phrase("advice.cameras-withheld")],
    )
