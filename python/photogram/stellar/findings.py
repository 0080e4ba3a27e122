"""What the verdicts on a plate of stars and on exposures of the sky rest on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE
from photogram.stellar.outliers import studentized
from photogram.stellar.result import SIGNIFICANT
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight, Result

Named = Callable[[tuple[int, ...]], str]


def plate_findings(result: Result) -> Findings:
    """Return the tests of a plate: w where the mean error of unit weight is given (option 14), else t."""
    problem, tests = result.problem, studentized(result)
    statistic, second = ("w", np.inf) if tests.known else ("t", max(result.degrees_of_freedom - 1, 1))

    def image(index: tuple[int, ...]) -> str:
        star = problem.star_ids[problem.image_stars[index[0]]]
        return f"{'xy'[index[1]]} of point {problem.image_points[index[0]]} of star {star}"

    def star(index: tuple[int, ...]) -> str:
        return f"{('right ascension', 'declination')[index[1]]} of star {problem.star_ids[index[0]]}"

    return Findings(
        status="converged" if result.converged else "not converged",
        observations=[
            Tested("plate coordinates", tests.images, image, statistic, second=second),
            Tested("places of stars", tests.stars, star, statistic, second=second),
        ],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.freedom" if problem.options.mean_error else "untested.mean-error"),
        scaled=not problem.options.mean_error,
        spoiled=result.spoiled,
        if_usable=[
            *_not_significant(result),
            Phrase("advice.camera-of-plate"),
        ],
        if_withheld=[Phrase("advice.camera-withheld")],
    )


def _not_significant(result: Result) -> list[Phrase]:
    """Name terms of the distortion that a calibration does better without."""
    weak = [name for name, ratio in result.significance().items() if ratio < SIGNIFICANT]
    return [Phrase("advice.weak-terms", {"names": weak})] if weak else []


def night_findings(result: CalibratedNight) -> Findings:
    """Return the tests of exposures of the sky against the standard deviation of their images."""
    found, freedom = result.calibration, result.calibration.degrees_of_freedom
    omega = found.mean_error**2 * freedom

    def image(index: tuple[int, ...]) -> str:
        exposure = result.names[found.exposures[index[0]]]
        x, y = found.xy[index[0]]
        return f"{'xy'[index[1]]} of the image at {x:.1f}, {y:.1f} of exposure {exposure}"

    def star(index: tuple[int, ...]) -> str:
        name = result.night.catalogue.ids[found.catalogue[index[0]]]
        return f"{('right ascension', 'declination')[index[1]]} of star {name}"

    def tested(kind: str, values: Floats, redundancy: Floats, name: Named) -> Tested:
        # The values are over mean errors a posteriori; the standard deviation of a pixel is a guess.
        w = np.where(np.nan_to_num(redundancy) > TESTABLE, values * found.mean_error, np.nan)
        return Tested(kind, w, name).studentized(omega, freedom)

    return Findings(
        status=found.status,
        observations=[
            tested("image coordinates", found.standardized, found.redundancy, image),
            tested("places of stars", found.star_standardized, found.star_redundancy, star),
        ],
        degrees_of_freedom=freedom,
        global_test=result.test,
        untested=Phrase("untested.freedom"),
        doubtful=[
            *(
                Phrase("part.exposure", {"name": str(name), "odds": float(odds)})
                for name, odds in result.doubtful.items()
            ),
            *([Phrase("part.mostly-left-out")] if result.mostly_left_out else []),
        ],
        if_usable=[Phrase("advice.camera-of-night")],
        if_withheld=[Phrase("advice.cameras-withheld")],
    )
