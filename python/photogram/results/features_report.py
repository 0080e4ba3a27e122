"""Features as a section and as a JSON document."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.results.features import Feature, Features, Quantity, directions
from photogram.show.page import Cell, Column, Drawing, Part, Row, Section, Table, Text, decimals_of, fixed
from photogram.show.quantity import members
from photogram.words import Phrase


def features_section(features: Features | None, picture: Drawing | None = None) -> Section:
    """Return features with their quantities, and whether their form is more than errors."""
    if not features:
        return Section("features", "Features", [])
    quantities: list[Row] = []
    for each in features:
        for k, own in enumerate(each.quantities):
            numbers = zip(written(each, own), (own.value, own.sd, own.expanded), strict=True)
            cells = [Cell(text, sorts=number) for text, number in numbers]
            quantities.append([each.name if k == 0 else "", own.name, *cells, own.unit])
    columns = [
        *(Column(head, text=True) for head in ("Feature", "Quantity")),
        *(Column(head) for head in ("Value", "sd", "U = k sd")),
        Column("Unit", text=True),
    ]
    note = f"Coverage factor k = {expansion(features)}."
    parts: list[Part] = [Table("Quantities of features", columns, quantities, note)]
    if tested := [each for each in features if each.statistic is not None]:
        forms = Table.of(
            "Whether form is more than errors of points",
            tested,
            [
                (Column("Feature", text=True), lambda each: each.name),
                (Column("What", text=True), lambda each: str(through(each))),
                (Column("T", figures=4), lambda each: each.statistic),
                (Column("of", decimals=0), lambda each: each.freedom),
                (Column("p", figures=2), lambda each: each.probability),
                (Column("Form", text=True), lambda each: each.form),
            ],
        )
        parts += [forms, *([] if picture is None else [picture])]
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


def written(feature: Feature, quantity: Quantity) -> list[str]:
    """Return value, standard deviation and U as they are written: two figures of the standard deviation.

    Quantities of one unit have the same decimals, those that the smallest standard deviation takes.
    """
    alike = [each.sd for each in feature.quantities if each.unit == quantity.unit and each.sd > 0]
    decimals = decimals_of(np.array([min(alike, default=np.nan)]))
    return [fixed(each, decimals) for each in (quantity.value, quantity.sd, quantity.expanded)]


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
