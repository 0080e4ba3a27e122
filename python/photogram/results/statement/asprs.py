"""Figures and classes of the ASPRS standards, Edition 2 (2023; Version 2, 2024).

See section 2.2 of the specification of the statement, which lists confirmations by other texts and open
checks against the standard. Differences contain the errors of the product and of the check survey. The
standard adds the errors of the survey again: correct for common errors, otherwise conservative.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.freedom import rmse_interval

ENOUGH = 30  # Check points of a tested product (7.13); with fewer it is produced to meet a class
MOST_STEPS = 10  # Number of steps of 1,000 km2, after which the number of check points is constant
MEAN_SHARE, MOST_TIMES = 0.25, 3.0
"""Limits for means and differences that require an investigation, relative to a class (7.2)."""


@dataclass(frozen=True)
class Accuracy:
    """A figure of the standard with its components, in the linear unit."""

    count: int  # Check points
    # RMSE of the differences (RMSE_1), and of the check survey by its standard deviations (RMSE_2)
    found: float
    survey: float
    rmse: float  # The figure: the root of the sum of both squares
    # Its upper limit, from the interval of the found RMSE, with the survey's; NaN if missing
    upper: float
    # Estimate for the product only, the root of the difference of both squares; None if differences are
    # smaller than the survey's standard deviations
    product: float | None


@dataclass(frozen=True)
class Remark:
    """A mean or difference that requires an investigation first."""

    kind: str  # `mean` or `difference`
    component: str  # `e`, `n` or `h`
    value: float  # In the linear unit
    limit: float
    point: int | None = None  # Row of the difference; None for a mean


def points_asked_for(area: float) -> int:
    """Return required check points of an area (km2), for NVA and VVA (7.13, table C.1).

    Ten more for every 1,000 km2. Minimum and maximum are confirmed, the steps between are not.
    """
    return ENOUGH + 10 * (math.ceil(min(max(area / 1000.0, 1.0), MOST_STEPS)) - 1)


def accuracy(found: float, survey: float, freedom: float, count: int) -> Accuracy:
    """Return a figure of the standard: RMSE_H (7.11), RMSE_V of NVA or VVA, RMSE_3D.

    `found` and `survey` are RMSE_1 of the differences and RMSE_2 of the check survey in the linear unit:
    horizontal ones radial, both axes in one figure. `freedom` are effective degrees of freedom of RMSE_1, of
    the joint covariance of its rows (:func:`photogram.statistics.effective_freedom`).
    """
    rest, upper = (found - survey) * (found + survey), rmse_interval(found, freedom)[1]
    product = math.sqrt(rest) if rest >= 0 else None
    return Accuracy(count, found, survey, math.hypot(found, survey), math.hypot(upper, survey), product)


def three_d(horizontal: Accuracy, vertical: Accuracy, freedom: float) -> Accuracy:
    """Return RMSE_3D, the root of RMSE_H^2 + RMSE_V^2, of the NVA or the VVA area.

    `freedom` are effective degrees of freedom of all rows together.
    """
    found = math.hypot(horizontal.found, vertical.found)
    survey = math.hypot(horizontal.survey, vertical.survey)
    return accuracy(found, survey, freedom, min(horizontal.count, vertical.count))


def verdict(figure: Accuracy | None, limit: float) -> str:
    """Return the verdict on a class in the linear unit.

    `missed` if the figure is larger. Otherwise, by the upper limit of its interval, `met with confidence` or
    `met`; with fewer than 30 points `produced to meet` or `not decided` instead. `not tested` without a
    figure.
    """
    if figure is None:
        return "not tested"
    if figure.rmse > limit:
        return "missed"
    sure = figure.upper <= limit
    if figure.count < ENOUGH:
        return "produced to meet" if sure else "not decided"
    return "met with confidence" if sure else "met"


def wording(count: int) -> str:
    if count >= ENOUGH:
        return "tested"
    return "produced" if count else "none"


def survey_good_enough(survey: float, limit: float) -> bool:
    """Return whether a check survey has RMSE_2 <= N/2, half of the class (7.12).

    RMSE_H2 (radial) or RMSE_V2, and the class, in the linear unit.
    """
    return survey <= limit / 2


def control_good_enough(
    plan: float, height: float, class_h: float, class_v: float | None = None
) -> tuple[bool, bool]:
    """Return whether control is accurate enough in plan and in height (7.9).

    `plan` and `height` are root mean squares of its standard deviations, radial in plan, in the linear unit.
    The limits are half of the horizontal and vertical classes; the full horizontal class for height without a
    vertical class.
    """
    return plan <= class_h / 2, height <= (class_h if class_v is None else class_v / 2)


def remarks(
    differences: Floats, class_h: float | None = None, class_v: float | None = None
) -> tuple[Remark, ...]:
    """Return necessary investigations before a class is stated (7.2).

    Limits are a quarter of the class for means and three times the class for differences; in plan by axis,
    with the class divided by the root of 2. `differences` are (n, 3) east, north, height: adjusted minus
    given, in the linear unit; NaN if not given. Classes are None unless requested.
    """
    axis = None if class_h is None else class_h / math.sqrt(2)
    limits = {"e": axis, "n": axis, "h": class_v}
    return tuple(
        remark
        for (component, limit), column in zip(limits.items(), differences.T, strict=True)
        if limit is not None
        for remark in _beyond(component, limit, column)
    )


def _beyond(component: str, limit: float, values: Floats) -> Iterator[Remark]:
    """Yield values above the limits of an axis: the mean, then single differences."""
    known = np.flatnonzero(np.isfinite(values))
    mean = float(values[known].mean()) if known.size else 0.0
    if abs(mean) > MEAN_SHARE * limit:
        yield Remark("mean", component, mean, MEAN_SHARE * limit)
    for row in known[np.abs(values[known]) > MOST_TIMES * limit].tolist():
        yield Remark("difference", component, float(values[row]), MOST_TIMES * limit, row)
