"""Options of a calibration: text of the report, its listing, or improvements."""

from __future__ import annotations

from typing import Literal

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass


@dataclass(frozen=True)
class Options(Checked):
    """Options of a calibration.

    The defaults follow the text of the report if its listing deviates.

    Attributes
    ----------
    pointing_dof
        Degrees of freedom of pointings pooled over cases: `text` (readings minus means, unbiased) or
        `listing` (readings minus points).
    grid_sigma
        Grid standard deviation from average residuals: `unbiased` (expected sums of squares with all fitted
        parameters), `text` (equation 64) or `listing` (2 N - 1).
    variance_grid
        Grid sd in the analysis of variance: `a priori` (text and listing; `computed` if unknown), or
        `computed`.
    case_polynomial_residuals
        Grid residuals of the polynomials of one case: `consistent` (measured minus given) or `listing` (given
        minus measured).
    nanometres
        Sigmas after the linear stage in the analysis of variance: `exact`, or `truncated` to whole nanometres
        as in the listing.
    free_residuals
        Comparator residuals of rigid fits: `report` (includes the scale of the similarity transformation, a
        relative change of 1e-5) or `exact`.
    order
        Order of points: `measured`, or the order of subroutine GROUP (`listing`).
    pages
        Pages of the listing: `all`, or only those printed by the program (`published`), without problems,
        tests and joint adjustment.
    polynomial
        Whether to fit polynomials.
    joint
        Whether to compute the joint adjustment.
    estimate_grid
        Whether the joint adjustment estimates the grid standard deviation even if one is given.
    """

    pointing_dof: Literal["text", "listing"] = "text"
    grid_sigma: Literal["unbiased", "text", "listing"] = "unbiased"
    variance_grid: Literal["a priori", "computed"] = "a priori"
    case_polynomial_residuals: Literal["consistent", "listing"] = "consistent"
    nanometres: Literal["exact", "truncated"] = "exact"
    free_residuals: Literal["report", "exact"] = "report"
    order: Literal["measured", "listing"] = "measured"
    pages: Literal["all", "published"] = "all"
    polynomial: bool = option(True, name="--polynomial/--linear-only")
    joint: bool = True
    estimate_grid: bool = False

    @classmethod
    def as_published(cls) -> Options:
        """Return options that reproduce values and pages of the program of 1971."""
        return cls(
            pointing_dof="listing",
            grid_sigma="listing",
            variance_grid="a priori",
            case_polynomial_residuals="listing",
            nanometres="truncated",
            order="listing",
            pages="published",
        )
