"""Options of a calibration: text of the report, or the published program."""

from __future__ import annotations

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass


@dataclass(frozen=True)
class Options(Checked):
    """Options of a calibration.

    Attributes
    ----------
    as_published
        Whether to compute and print like the program of 1971 if its listing deviates from the text of the
        report (docs/comparator.md, Differences between text and listing).
    polynomial
        Whether to fit polynomials.
    joint
        Whether to compute the joint adjustment.
    estimate_grid
        Whether the joint adjustment estimates the grid standard deviation even if one is given.
    """

    as_published: bool = False
    polynomial: bool = option(True, name="--polynomial/--linear-only")
    joint: bool = True
    estimate_grid: bool = False
