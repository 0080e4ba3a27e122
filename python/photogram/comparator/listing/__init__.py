"""Text listing with the page layout of the 1971 program."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.comparator.listing.parameters import (
    case_linear_page,
    case_polynomial_page,
    combined_linear_page,
    combined_polynomial_page,
    correction_table,
    residual_page,
    summary_page,
)
from photogram.comparator.listing.readings import averages_page, input_page, pointing_pages, title_page

if TYPE_CHECKING:
    from photogram.comparator import Calibration, CaseResult

__all__ = ["listing"]

STAGES = {
    "case_linear": "AVERAGE RESIDUALS AFTER INDIVIDUAL LINEAR ADJUSTMENTS",
    "case_nonlinear": "AVERAGE RESIDUALS AFTER INDIVIDUAL LINEAR AND NONLINEAR ADJUSTMENTS",
    "linear": "AVERAGE RESIDUALS AFTER APPLICATION OF FINAL LINEAR CALIBRATION CORRECTIONS",
    "nonlinear": "AVERAGE RESIDUALS AFTER APPLICATION OF ALL FINAL CALIBRATION CORRECTIONS",
}


def listing(calibration: Calibration, run_date: str = "") -> str:
    """Return the listing of a calibration, with form feeds between pages.

    The last page is the report with problems, tests and joint adjustment. If the options request the
    published program, the listing only contains its pages.

    Parameters
    ----------
    calibration
        The calibration.
    run_date
        Text for the run date on the title page; not used elsewhere.
    """
    pages = [title_page(calibration, run_date)]
    pages += [input_page(case) for case in calibration.cases]
    pages += pointing_pages(calibration)
    for case in calibration.cases:
        pages += _case_pages(calibration, case)
    pages += _averages(calibration, "case_linear", "case_nonlinear")
    pages.append(combined_linear_page(calibration))
    pages += [
        residual_page(f"CASE NUMBER {case.number} WITH FINAL LINEAR CORRECTIONS", case, fit.residuals)
        for case, fit in zip(calibration.cases, calibration.linear.cases, strict=True)
    ]
    if calibration.nonlinear:
        pages += [combined_polynomial_page(calibration), correction_table(calibration)]
        pages += [
            residual_page(f"CASE NUMBER {case.number} WITH ALL FINAL CORRECTIONS", case, fit.residuals)
            for case, fit in zip(calibration.cases, calibration.nonlinear.cases, strict=True)
        ]
    pages += _averages(calibration, "linear", "nonlinear")
    pages.append(summary_page(calibration))
    if not calibration.options.as_published:
        pages.append(calibration.report().splitlines())
    return "\f\n".join("\n".join(line.rstrip() for line in page) + "\n" for page in pages)


def _case_pages(calibration: Calibration, case: CaseResult) -> list[list[str]]:
    pages = [
        residual_page(
            f"CASE NUMBER {case.number} FREE ADJUSTMENT (ROTATION AND TRANSLATION)", case, case.free.residuals
        ),
        case_linear_page(case),
    ]
    if case.polynomial:
        pages.append(case_polynomial_page(case, case.polynomial))
        if calibration.session.plot_each_case:
            pages.append(correction_table(calibration, case))
    return pages


def _averages(calibration: Calibration, *stages: str) -> list[list[str]]:
    return [
        averages_page(STAGES[stage], result)
        for stage in stages
        for result in calibration.averages.get(stage, {}).values()
    ]
