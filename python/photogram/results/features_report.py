"""Features as a section and as a JSON document."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.results.features import Feature, Features, directions, quantity_columns, unit_deviations
from photogram.show.page import Drawing, Part, Section, Text
from photogram.show.quantity import Quantity, Table, members, of_each
from photogram.words import Phrase


def features_section(features: Features | None, picture: Drawing | None = None) -> Section:
    """Return features with their quantities, and whether their form is more than errors."""
    if not features:
        return Section("features", "Features", [])
    note = f"Coverage factor k = {expansion(features)}."
    columns = quantity_columns(features)
    title = "Quantities of features"
    parts: list[Part] = [Table("features", title, columns, note, deviations=unit_deviations(features))]
    if tested := [each for each in features if each.statistic is not None]:
        forms = [
            of_each(tested, "name", kind="name", head="Feature"),
            Quantity([str(through(each)) for each in tested], kind="name", head="What"),
            of_each(tested, "statistic", head="T", figures=4),
            of_each(tested, "freedom", head="of", decimals=0),
            of_each(tested, "probability", kind="probability", head="p"),
            of_each(tested, "form", kind="name", head="Form"),
        ]
        parts.append(Table("forms", "Whether form is more than errors of points", forms))
        parts += [] if picture is None else [picture]
    parts += [Text(each) for each in features.remarks]
    intro = (
        "Least-squares features through adjusted points, with what follows from the joint covariance of the"
        " points. T compares the deviations of the points from the feature with their standard deviations."
    )
    return Section("features", "Features", parts, intro)


def expansion(features: Features) -> str:
    """Return k, and where it comes from."""
    if features.coverage is None:
        return f"{features.k:g}"
    law = (
        "normal" if np.isinf(features.freedom) else f"Student with {features.freedom:.4g} degrees of freedom"
    )
    return f"{features.k:.3f} ({100 * features.coverage:g} %, {law})"


def through(feature: Feature) -> Phrase:
    """Return the form of a feature and its points as a message."""
    first, *_, last = points = list(feature.points)
    if feature.kind == "distance":
        return Phrase("feature.distance", {"first": first, "last": last})
    form = Phrase(f"feature.{feature.kind}")
    return Phrase("feature.through", {"feature": form, "count": len(points), "points": points})


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
