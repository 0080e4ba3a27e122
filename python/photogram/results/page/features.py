"""Features on the page of a block."""

from __future__ import annotations

from photogram.results.features import Features
from photogram.results.features_report import expansion, through, written
from photogram.show.page import Cell, Column, Drawing, Part, Row, Section, Table, Text

__all__ = ["features_section"]


def features_section(features: Features | None, picture: Drawing) -> Section:
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
        if each.statistic is not None:
            forms.append(
                [each.name, through(each), each.statistic, each.freedom, each.probability, each.form]
            )
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
        )
    ]
    if forms:
        columns = [
            *(Column(head, text=True) for head in ("Feature", "What")),
            Column("T", figures=4),
            Column("of", decimals=0),
            Column("p", figures=2),
            Column("Form", text=True),
        ]
        parts += [Table("Whether form is more than errors of points", columns, forms), picture]
    parts += [Text(each) for each in features.remarks]
    intro = (
        "Least-squares features through adjusted points, with what follows from the joint covariance of the"
        " points. T compares the deviations of the points from the feature with their standard deviations."
    )
    return Section("features", "Features", parts, intro)
