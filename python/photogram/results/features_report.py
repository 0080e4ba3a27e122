"""What reports and JSON documents say of features."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.messages import listed
from photogram.results.features import Feature, Features, Quantity, directions
from photogram.show.page import decimals_of, fixed, probability_written
from photogram.show.quantity import members
from photogram.show.sections import Section

SHOWN = 4
"""Points that are named of each feature."""


def features_sections(features: Features | None) -> list[Section]:
    """Return the section of a report, if there are features."""
    if not features:
        return []
    lines = [f"{'':<26}{'value':>18}{'sd':>16}{'U = k sd':>16}  k = {expansion(features)}"]
    for each in features:
        lines += [f"{each.name}: {through(each)}", *(_line(each, own) for own in each.quantities)]
        if each.form:
            p = probability_written(each.probability or 0.0)
            figures = f"T = {each.statistic:.4g} of {each.freedom}, p {'' if p[0] == '<' else '= '}{p}"
            lines += [f"  form: {each.form} ({figures})"]
    return [("Features", [*lines, *(f"{each[:1].upper()}{each[1:]}." for each in features.remarks)])]


def expansion(features: Features) -> str:
    """Return k, and where it comes from."""
    if features.coverage is None:
        return f"{features.k:g}"
    law = (
        "normal" if np.isinf(features.freedom) else f"Student with {features.freedom:.4g} degrees of freedom"
    )
    return f"{features.k:.3f} ({100 * features.coverage:g} %, {law})"


def through(feature: Feature) -> str:
    """Say what a feature is, and which points it goes through."""
    if feature.kind == "distance":
        return f"distance from {feature.points[0]} to {feature.points[1]}"
    return f"{feature.kind} through {len(feature.points)} points: {listed(list(feature.points), SHOWN)}"


def written(feature: Feature, quantity: Quantity) -> list[str]:
    """Return value, standard deviation and U as they are written: two figures of the standard deviation.

    Quantities of one unit have the same decimals, those that the smallest standard deviation takes.
    """
    alike = [each.sd for each in feature.quantities if each.unit == quantity.unit and each.sd > 0]
    decimals = decimals_of(np.array([min(alike, default=np.nan)]))
    return [fixed(each, decimals) for each in (quantity.value, quantity.sd, quantity.expanded)]


def _line(feature: Feature, quantity: Quantity) -> str:
    value, sd, expanded = written(feature, quantity)
    return f"  {quantity.name:<24}{value:>18}{sd:>16}{expanded:>16}  {quantity.unit}".rstrip()


def features_document(features: Features) -> dict[str, Any]:
    """Return what the JSON document says of features."""
    own = members(features, "k", "coverage", "remarks")
    return own | {"features": [_member(each) for each in features]}


def _member(feature: Feature) -> dict[str, Any]:
    across = directions(feature.kind)
    named = [*across, *(f"sd_{name}" for name in across)]
    numbers = np.hstack([feature.deviations, feature.deviation_sd]).tolist()
    form = members(feature, "statistic", "freedom", "probability", sentence="form")
    return {
        **members(feature, "name", "kind", "points"),
        "quantities": [vars(each) for each in feature.quantities],
        "covariance": feature.covariance,
        "deviations": [
            {"point": point, **dict(zip(named, row, strict=True))}
            for point, row in zip(feature.points, numbers, strict=False)
        ],
        "form": form if feature.statistic is not None else None,
    }
