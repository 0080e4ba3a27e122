"""The page of a statement: one sheet for the client, then annexes."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.results.statement.annexes import annexes
from photogram.results.statement.comparison import control_places
from photogram.results.statement.drawings import differences
from photogram.results.statement.figures import Figures
from photogram.results.statement.tables import Columns, decimals_for, localized
from photogram.show.page import Document, Drawing, Fact, Judgement, Part, Remarks, Section, Text
from photogram.show.quantity import Table

if TYPE_CHECKING:
    from photogram import Statement

_CLASSES = {"h": "v", "plan": "h", "all": "3d"}  # Parts of the components with classes


@np.errstate(over="ignore", invalid="ignore")
def statement_document(statement: Statement) -> Document:
    """Return the page of a statement, for the browser and for paper."""
    texts, asked, judged = statement.texts, statement.asked, statement.judged
    names = ("project", "client", "firm", "surveyor")
    head = [Fact(texts(f"page.{name}"), own) for name in names if (own := getattr(asked, name))]
    if asked.date:
        head.append(Fact(texts("page.date"), texts.day(asked.date)))
    tone = judged.tone
    mark = texts(f"mark.{tone or 'good'}")
    assumed = Remarks([text for _, text in judged.assumptions], 40)
    remarks = [Remarks(judged.remarks, 40)] if judged.remarks else []
    return Document(
        what=texts("page.what"),
        title=asked.title or statement.result.block.title,
        judgements=[Judgement(mark, statement.headline, [text for _, text in judged.sentences], tone)],
        sections=[
            Section(
                "figures", texts("page.figures"), [*localized(texts, _figures(statement)), *_notes(statement)]
            ),
            Section("assumptions", texts("page.assumptions"), [assumed, _map(statement)]),
            Section("remarks", texts("page.remarks"), remarks),
            Section("signature", "", [Text(texts("page.signature"))]),
            *annexes(statement),
        ],
        head=head,
        language=texts.language,
        first=texts("page.first"),
        contents=texts("page.contents"),
        more=texts("page.more", count="{}"),
        numbers=texts("page.numbers", number="{number}", total="{total}"),
    )


def _figures(statement: Statement) -> list[Part]:
    """Return the table of the first sheet: with classes, and with RMSE without some points."""
    own, texts, rest = statement.of_all, statement.texts, statement.of_rest
    if own is None:
        return []
    columns = Columns(texts)
    pairs = {part: (own.parts[part], own.prediction[part]) for part in own.parts}
    rows = [(part, *pair) for part, pair in pairs.items()]
    shown = [(part, sized, predicted) for part, sized, predicted in rows if sized and predicted]
    known = [each.predicted_rmse_of_product for each in own.prediction.values() if each is not None]
    decimals = decimals_for(np.array(known))
    number = partial(columns.number, decimals=decimals)
    intervals = [
        " – ".join(texts.number(limit, decimals) for limit in predicted.rmse_interval)
        for *_, predicted in shown
    ]
    quantities = [
        columns.text("component", [texts(f"component.{part}") for part, *_ in shown]),
        columns.number("n", [sized.n for _, sized, _ in shown]),
        *(number(key, [getattr(sized, key) for _, sized, _ in shown]) for key in ("mean", "sd", "rmse")),
        columns.text("interval", intervals),
        number("predicted", [predicted.predicted_rmse for *_, predicted in shown]),
        number("survey", [_survey(own, part)[0] for part, *_ in shown]),
        number("combined", [_survey(own, part)[1] for part, *_ in shown]),
        number("largest", [sized.largest for _, sized, _ in shown]),
        columns.text("point", [sized.point for _, sized, _ in shown]),
    ]
    if rest is not None:
        head = texts("column.without", points=texts.listed(list(statement.asked.without), 3))
        left = [rest.parts[part] for part, *_ in shown]
        quantities.append(number(head, [math.nan if sized is None else sized.rmse for sized in left]))
    if statement.asked.classes:
        names = [_CLASSES.get(part, "") for part, *_ in shown]
        verdicts = {} if statement.standards.asprs is None else statement.standards.asprs.verdicts
        classes = [statement.asked.classes.get(name) for name in names]
        quantities.append(number("class", classes))
        outcomes = [texts(f"asprs.verdict.{verdicts[name]}") if name in verdicts else "" for name in names]
        quantities.append(columns.text("verdict", outcomes))
    return [Table("figures", texts("table.figures", unit=texts.unit), quantities)]


def _survey(own: Figures, part: str) -> tuple[float, float]:
    """Return RMSE of the survey, and combined with what was statement, of parts that standards have."""
    if part == "plan":
        return own.rmse_h2, own.rmse_h
    if part == "h":
        return own.rmse_v2, own.rmse_v
    if part == "all":
        return math.hypot(own.rmse_h2, own.rmse_v2), own.rmse_3d
    return math.nan, math.nan


def _notes(statement: Statement) -> list[Text]:
    """Return what the sum of squares of the ASPRS means."""
    texts, of_all, asprs = statement.texts, statement.of_all, statement.standards.asprs
    if of_all is None or asprs is None:
        return []
    fields = {}
    for name, part in (("h", "plan"), ("v", "h")):
        product, predicted = of_all.without_survey(name), of_all.prediction[part]
        below = texts("asprs.below")
        fields[f"product_{name}"] = texts.length(product) if math.isfinite(product) else below
        own = math.nan if predicted is None else predicted.predicted_rmse_of_product
        fields[f"predicted_{name}"] = texts.length(own)
    return [Text(f"{texts('asprs.footnote')} {texts('asprs.product', **fields)}")]


def _map(statement: Statement) -> Drawing:
    texts, control = statement.texts, control_places(statement.result.block)
    sketch = partial(differences, statement.compared, control, texts)
    return Drawing("map-differences", texts("page.map"), texts("page.map.caption"), sketch)
