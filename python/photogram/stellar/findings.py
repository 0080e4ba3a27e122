"""Tests of star plates and sky exposures, and findings for their verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import replace
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE
from photogram.stellar.parameters import SIGNIFICANT
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight, Result

_AXES = ("right ascension", "declination")


def _testable(values: Floats, redundancy: Floats) -> Floats:
    return np.where(np.nan_to_num(redundancy) > TESTABLE, values, np.nan)


def _sizes(tested: Tested) -> Tested:
    return replace(tested, values=np.abs(tested.values))


def _stars(values: Floats, redundancy: Floats, names: Sequence[str]) -> Tested:
    def star(index: tuple[int, ...]) -> Phrase:
        return phrase("stars.place", axis=_AXES[index[1]], star=names[index[0]])

    return Tested(phrase("stars.places"), _testable(values, redundancy), star)


def plate_standardized(result: Result, unit: float | None = None) -> list[Tested]:
    """Return standardized residuals of a plate for a mean error of unit weight; None: the one in use."""
    unit = unit or result.mean_error or math.nan
    problem, solved = result.problem, result.solved

    def image(index: tuple[int, ...]) -> Phrase:
        star = problem.star_ids[problem.image_stars[index[0]]]
        point = problem.image_points[index[0]]
        return phrase("stars.plate-coordinate", axis="xy"[index[1]], point=point, star=star)

    images = Tested(
        phrase("stars.plate-coordinates"), _testable(solved.standardized / unit, solved.redundancy), image
    )
    return [images, _stars(solved.star_standardized / unit, solved.star_redundancy, problem.star_ids)]


def plate_tests(result: Result) -> list[Tested]:
    """Return the sizes of the tests of a plate: w for a given unit weight (option 14), else t."""
    if result.problem.options.mean_error:
        return [_sizes(each) for each in plate_standardized(result)]
    squares, freedom = sum(result.solved.sums), result.degrees_of_freedom
    return [_sizes(each).studentized(squares, freedom) for each in plate_standardized(result, unit=1.0)]


def plate_findings(result: Result) -> Findings:
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


def night_standardized(result: CalibratedNight) -> list[Tested]:
    """Return residuals of exposures over their standard deviations for the given pixel sd."""
    found, catalogue, unit = result.calibration, result.night.catalogue, result.calibration.mean_error

    def image(index: tuple[int, ...]) -> Phrase:
        (x, y), exposure = found.xy[index[0]].tolist(), result.names[found.exposures[index[0]]]
        return phrase("stars.pixel-coordinate", axis="xy"[index[1]], x=x, y=y, exposure=exposure)

    images = Tested(
        phrase("stars.image-coordinates"), _testable(unit * found.standardized, found.redundancy), image
    )
    names = [catalogue.ids[star] for star in found.catalogue.tolist()]
    return [images, _stars(unit * found.star_standardized, found.star_redundancy, names)]


def night_tests(result: CalibratedNight) -> list[Tested]:
    """Return the tests of exposures: t, since the pixel standard deviation is assumed."""
    found = result.calibration
    squares, freedom = found.mean_error**2 * found.degrees_of_freedom, found.degrees_of_freedom
    return [each.studentized(squares, freedom) for each in night_standardized(result)]


def night_findings(result: CalibratedNight) -> Findings:
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
