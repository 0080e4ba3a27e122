"""Contradicted standard deviations by type: one step of variance components."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.robust import mad_sd
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.results.result import Result
from photogram.statistics import global_test
from photogram.words import Phrase, phrase

LEAST_REDUNDANCY = 10.0  # Of a type whose standard deviations are tested
NOTABLE = 1.5  # Least reported factor of standard deviations, of the mean and of the median


@dataclass(frozen=True, eq=False)
class _Kind:
    name: Phrase
    sum_of_squares: float
    redundancy: float
    standardized: Floats


def weight_hints(result: Result) -> list[Message]:
    """Report observation types whose standard deviations are too small or too large.

    With v'Pv the sum of squares of a type and r the sum of its redundancy numbers, the factor is the root of
    v'Pv / r. A type is reported if v'Pv and the median of the standardized residuals exceed their limits.
    """
    found = []
    for kind in _kinds(result):
        enough = kind.redundancy >= LEAST_REDUNDANCY
        test = global_test(kind.sum_of_squares, round(kind.redundancy)) if enough else None
        if test is None:
            continue
        factor = math.sqrt(kind.sum_of_squares / kind.redundancy)
        middle = mad_sd(kind.standardized)
        fields = {"kind": kind.name, "sum": kind.sum_of_squares, "redundancy": kind.redundancy}
        if test.rejected_high and min(factor, middle) > NOTABLE:
            found.append(Message(phrase("weighting.small", factor=middle, **fields)))
        elif test.rejected_low and max(factor, middle) < 1 / NOTABLE:
            found.append(Message(phrase("weighting.large", factor=1 / middle, **fields)))
    return found


def _kinds(result: Result) -> Iterator[_Kind]:
    redundancy = float(np.nansum(result.redundancy))
    images = phrase("weighting.images")
    yield _Kind(images, result.sums_of_squares.plates, redundancy, result.standardized)
    for name, observed in (("control", result.control), ("stations", result.stations)):
        weighted = (observed.sd > 0) & np.isfinite(observed.sd)
        square = float(((observed.residuals[weighted] / observed.sd[weighted]) ** 2).sum())
        own = phrase(f"weighting.{name}")
        yield _Kind(own, square, float(np.nansum(observed.redundancy)), observed.standardized)
    for kind in result.kinds.values():
        yield _Kind(
            phrase("weighting.kind", kind=kind.kind),
            kind.sum_of_squares,
            float(np.nansum(kind.redundancy)),
            kind.standardized,
        )
