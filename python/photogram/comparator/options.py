"""How a calibration is computed: the report's text, its listing, or better."""

from __future__ import annotations

from typing import Literal

from photogram.lazy_dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """Choices; the defaults follow the text of the report where its listing departs from it.

    Attributes
    ----------
    pointing_dof
        Degrees of freedom of pointings pooled over cases: `text` (readings less means, unbiased) or `listing`
        (readings less points).
    grid_sigma
        Standard deviation of the grid from average residuals: `unbiased` (expectations of the sums of squares
        with all fitted parameters accounted for), `text` (equation 64) or `listing` (2 N - 1).
    variance_grid
        Grid in the analysis of variance: `a priori` (as both text and listing; `computed` where a plate has
        none), or `computed`.
    case_polynomial_residuals
        Grid residuals of the polynomials of one case: `consistent` (measured less given, as everywhere) or
        `listing` (the reverse).
    nanometres
        Sigmas after the linear stage in the analysis of variance: `exact`, or `truncated` to whole nanometres
        as the listing stores them.
    free_residuals
        Comparator residuals of rigid fits: `report` (turned with the scale of the similarity transformation,
        which changes them by 1e-5 of themselves) or `exact`.
    order
        Points in the order `measured`, or in that of the listing's subroutine GROUP (`listing`).
    pages
        Pages of the listing: `all`, or only those that the program printed (`published`), without problems,
        tests and joint adjustment.
    polynomial
        Whether to fit polynomials.
    joint
        Whether to adjust everything together as well.
    estimate_grid
        Whether the joint adjustment estimates the standard deviation of the grid even where one is known.
    """

    pointing_dof: Literal["text", "listing"] = "text"
    grid_sigma: Literal["unbiased", "text", "listing"] = "unbiased"
    variance_grid: Literal["a priori", "computed"] = "a priori"
    case_polynomial_residuals: Literal["consistent", "listing"] = "consistent"
    nanometres: Literal["exact", "truncated"] = "exact"
    free_residuals: Literal["report", "exact"] = "report"
    order: Literal["measured", "listing"] = "measured"
    pages: Literal["all", "published"] = "all"
    polynomial: bool = True
    joint: bool = True
    estimate_grid: bool = False

    @classmethod
    def as_published(cls) -> Options:
        """Return the choices that give the figures and pages of the program of 1971."""
        return cls(
            pointing_dof="listing",
            grid_sigma="listing",
            variance_grid="a priori",
            case_polynomial_residuals="listing",
            nanometres="truncated",
            order="listing",
            pages="published",
        )
