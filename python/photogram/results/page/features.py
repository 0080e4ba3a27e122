"""Features on the page of a block."""

from __future__ import annotations

import numpy as np

from photogram.results.features import Feature, Features
from photogram.results.features_report import expansion, through, written
from photogram.show.page import Cell, Column, Part, Row, Section, Table, Text

__all__ = ["features_section"]


def features_section(features: Features | None) -> Section:
    """Return features with their quantities, and whether their form is more than errors."""
    if not features:
        return Section("features", "Features", [])
    quantities: list[Row] = []
    forms: list[Row] = []
    for each in features:
        for k, own in enumerate(each.quantities):
            numbers = zip(written(each, own), (own.value, own.sd, own.expanded), strict=True)
            cells = [Cell(text, sorts=number) for text, number in numbers]
            quantities.append([each.name if k == 0 else "", own.name, *cells, own.unit])
        forms.append([each.name, through(each), *_form(each)])
    parts: list[Part] = [
        Table(
            "Quantities of features",
            [
                *(Column(head, text=True) for head in ("Feature", "Quantity")),
                *(Column(head) for head in ("Value", "sd", "U = k sd")),
                Column("Unit", text=True),
            ],
            quantities,
            f"Coverage factor k = {expansion(features)}.",
        ),
        Table(
            "Form of features",
            [
                *(Column(head, text=True) for head in ("Feature", "What")),
                Column("T", figures=4),
                Column("of", decimals=0),
                Column("p", figures=2),
                Column("Form", text=True),
            ],
            forms,
        ),
        *(Text(each) for each in features.remarks),
    ]
    intro = (
        "Least-squares features through adjusted points, with what follows from the joint covariance of the"
        " points. T compares the deviations of the points from the feature with their standard deviations."
    )
    return Section("features", "Features", parts, intro)


def _form(feature: Feature) -> list[str | float | None]:
    if feature.statistic is None:
        return [None, None, None, "not tested"]
    probability = np.nan if feature.probability is None else feature.probability
    return [feature.statistic, feature.freedom, probability, feature.form]
