"""Results whose standard deviations of corners are ratios alone."""

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
    """A result without a global test."""

    KNOWN: ClassVar[bool] = False

    @property
    def global_test(self) -> GlobalTest | None:
        """None: the standard deviation of corners is unknown."""
        return None

    def _findings(self) -> Findings:
        return replace(block_findings(self), untested=phrase("untested.corners"))


def with_unknown_weight(result: Result) -> Result:
    """Return a result as one whose unit weight is unknown."""
    return UnknownWeight(**{each.name: getattr(result, each.name) for each in fields(Result)})


def deviation_of_corners(result: Result) -> float:
    """Return the ratio of the standard deviation of corners by their residuals to the given one."""
    used = result.used_images
    weighted = (result.residuals[used] / result.image_given_sd[used]) ** 2
    return float(np.sqrt(weighted.sum() / np.nansum(result.redundancy[used])))
