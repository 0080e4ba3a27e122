"""What reports and JSON documents say of features."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.messages import listed
from photogram.results.features import Feature, Features, Quantity, directions
from photogram.show.page import decimals_of, fixed
from photogram.show.sections import Section

__all__ = ["features_document", "features_sections", "through", "written"]

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
            p = f"p = {each.probability:.2g}" if (each.probability or 0.0) > 1e-99 else "p < 1e-99"
            figures = f"T = {each.statistic:.4g} of {each.freedom}, {p}"
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
    return {
        "k": features.k,
        "coverage": features.coverage,
        "remarks": list(features.remarks),
        "features": [_member(each) for each in features],
    }


def _member(feature: Feature) -> dict[str, Any]:
    across: Sequence[str] = directions(feature.kind)
    rows = zip(feature.deviations.tolist(), feature.deviation_sd.tolist(), strict=True)
    tested = feature.statistic is not None
    return {
        "name": feature.name,
        "kind": feature.kind,
        "points": list(feature.points),
        "quantities": [vars(each) for each in feature.quantities],
        "covariance": feature.covariance.tolist(),
        "deviations": [
            {"point": point, **dict(zip(across, own, strict=True)), **_named("sd_", across, sd)}
            for point, (own, sd) in zip(feature.points, rows, strict=False)
        ],
        "form": {
            "statistic": feature.statistic,
            "freedom": feature.freedom,
            "probability": feature.probability,
            "sentence": feature.form,
        }
        if tested
        else None,
    }


def _named(prefix: str, names: Sequence[str], values: Sequence[float]) -> dict[str, float]:
    return {prefix + name: value for name, value in zip(names, values, strict=True)}
