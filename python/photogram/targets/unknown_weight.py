"""Results whose corner standard deviations are only ratios."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import ClassVar

import numpy as np

from photogram.results.findings import block_findings
from photogram.results.result import Result
from photogram.statistics.findings import Findings
from photogram.statistics.limits import GlobalTest
from photogram.words import phrase


class UnknownWeight(Result):
    """Result without a global test."""

    KNOWN: ClassVar[bool] = False

    @property
    def global_test(self) -> GlobalTest | None:
        """None: the standard deviation of corners is unknown."""
        return None

    def _findings(self) -> Findings:
        return replace(block_findings(self), untested=phrase("untested.corners"))


def with_unknown_weight(result: Result) -> Result:
    """Return a copy of a result with unknown unit weight."""
    return UnknownWeight(**{each.name: getattr(result, each.name) for each in fields(Result)})


def deviation_of_corners(result: Result) -> float:
    """Return the ratio of the corner sd from residuals to the given one."""
    used = result.used_images
    weighted = (result.residuals[used] / result.image_given_sd[used]) ** 2
    return float(np.sqrt(weighted.sum() / np.nansum(result.redundancy[used])))
