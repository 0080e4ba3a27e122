"""Figures of accuracy in the words of ISO 19157 (data quality): elements, measures, numbers of measures.

Section 2.6 of the specification of the statement. Numbers are those of the edition of 2013, annex D; names as
the same table in GeoAPI has them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from photogram.arguments.arrays import one_of
from photogram.errors import InputError
from photogram.messages import unknown_name

ABSOLUTE = "absolute (external) positional accuracy"  # Of check points
RELATIVE = "relative (internal) positional accuracy"  # Of lengths, and of differences between points
MEASURES = {
    "bias": (128, "bias of positions"),
    "le90": (35, "linear map accuracy at 90 % significance level"),
    "le95": (36, "linear map accuracy at 95 % significance level"),
    "rmse": (39, "root mean square error"),
    "ce90": (44, "circular error at 90 % significance level"),
    "ce95": (45, "circular error at 95 % significance level"),
    "rmse_plan": (47, "root mean square error of planimetry"),
    "ellipse": (50, "uncertainty ellipse"),
}


def measures(
    values: Mapping[str, object],
    *,
    unit: str,
    date: str,
    scope: str,
    element: str = ABSOLUTE,
    evaluation: str = "direct external",
) -> list[dict[str, Any]]:
    """Return figures as measures of data quality, for JSON, in the order in which they are given.

    Figures go by their keys in `MEASURES`: numbers, or lists of them (components of a bias; semi-axes and
    azimuth of an ellipse); None is left out. `unit`, `date` and `scope` are those of the figures, of their
    evaluation, and what they hold for; `evaluation` is how they were found.
    """
    one_of("element", element, (ABSOLUTE, RELATIVE))
    unknown = next((key for key in values if key not in MEASURES), None)
    if unknown is not None:
        raise InputError(unknown_name("measure of ISO 19157", unknown, MEASURES))
    return [
        {
            "element": element,
            "measure": MEASURES[key][1],
            "measure_id": MEASURES[key][0],
            "value": value,
            "unit": unit,
            "evaluation": evaluation,
            "date": date,
            "scope": scope,
        }
        for key, value in values.items()
        if value is not None
    ]
