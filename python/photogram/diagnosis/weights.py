"""Contradicted standard deviations by type: one step of variance components."""

from __future__ import annotations

from photogram.messages import Message
from photogram.results.result import Result
from photogram.statistics import global_test
from photogram.words import phrase

LEAST_REDUNDANCY = 10.0  # Of a type whose standard deviations are tested
NOTABLE = 1.5  # Least reported factor of standard deviations, of the mean and of the median


def weight_hints(result: Result) -> list[Message]:
    """Report observation types whose standard deviations are too small or too large.

    With v'Pv the sum of squares of a type and r the sum of its redundancy numbers, the factor is the root of
    v'Pv / r. A type is reported if v'Pv and the median of the standardized residuals exceed their limits.
    """
    found, summary = [], result.reliability_summary
    for each in () if summary is None else summary.types:
        enough = each.redundancy >= LEAST_REDUNDANCY
        test = global_test(each.squares, round(each.redundancy)) if enough else None
        if test is None:
            continue
        fields = {"kind": each.group, "sum": each.squares, "redundancy": each.redundancy}
        if test.rejected_high and min(each.factor, each.median) > NOTABLE:
            found.append(Message(phrase("weighting.small", factor=each.median, **fields)))
        elif test.rejected_low and max(each.factor, each.median) < 1 / NOTABLE:
            found.append(Message(phrase("weighting.large", factor=1 / each.median, **fields)))
    return found
