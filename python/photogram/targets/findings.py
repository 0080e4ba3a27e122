"""What the verdict on a calibration rests on, where nobody has said how well corners are measured."""

from __future__ import annotations

from dataclasses import replace

from photogram.results.findings import block_findings
from photogram.show.ways import findings_of
from photogram.statistics.findings import Findings
from photogram.targets.calibrated import UnknownWeight

__all__ = ["findings"]


@findings_of.register(UnknownWeight)
def findings(result: UnknownWeight) -> Findings:
    """Return the tests of a block whose standard deviations of corners are ratios alone."""
    untested = "nobody has said how well corners are measured: --sd images=0.3"
    return replace(block_findings(result), untested=untested)
