"""The page of a statement: one sheet for the client, then annexes."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.results.features import Features
from photogram.results.features_report import through
from photogram.results.statement.annexes import (
    adjustment_annex,
    budgets_annex,
    camera_annex,
    checks_annex,
    files_annex,
    left_out_annex,
    survey_annex,
)
from photogram.results.statement.comparison import control_places
from photogram.results.statement.drawings import differences
from photogram.results.statement.drawings import lengths as drawn_lengths
from photogram.results.statement.figures import Figures
from photogram.results.statement.sheets import Written, decimals_for
from photogram.results.statement.texts import Texts
from photogram.show.page import (
    Cell,
    Column,
    Document,
    Drawing,
    Fact,
    Judgement,
    Part,
    Remarks,
    Row,
    Section,
    Table,
    Text,
    decimals_of,
)

if TYPE_CHECKING:
    from photogram import Statement

_CLASSES = {"h": "v", "plan": "h", "all": "3d"}
"""Parts of the components with classes."""


@np.errstate(over="ignore", invalid="ignore")
def statement_document(found: Statement) -> Document:
    """Return the page of a statement, for the browser and for paper."""
    texts, asked, judged = found.texts, found.asked, found.judged
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
        title=asked.title or found.result.block.title,
        judgements=[Judgement(mark, found.headline, [text for _, text in judged.sentences], tone)],
        advice=[],
        highlights=[],
        sections=[
            Section("figures", texts("page.figures"), [*_figures(found), *_notes(found)]),
            Section("assumptions", texts("page.assumptions"), [assumed, _map(found)]),
            Section("remarks", texts("page.remarks"), remarks),
            Section("signature", "", [Text(texts("page.signature"))]),
            checks_annex(found),
            left_out_annex(found),
            budgets_annex(found),
            camera_annex(found),
            adjustment_annex(found),
            survey_annex(found),
            *_metrology(found),
            files_annex(found),
        ],
        head=head,
        language=texts.language,
        first=texts("page.first"),
        contents=texts("page.contents"),
        more=texts("page.more", count="{}"),
        numbers=texts("page.numbers", number="{number}", total="{total}"),
    )


def _figures(found: Statement) -> list[Table]:
    """Return the table of the first sheet: with classes, and RMSE without points beside those of all."""
    own = found.of_all
    if own is None:
        return []
    texts, cells = found.texts, Written(found.texts)
    keys = ("mean", "sd", "rmse", "interval", "predicted", "survey", "combined", "largest")
    columns = [
        cells.column("component", text=True),
        cells.column("n"),
        *(cells.column(key) for key in keys),
        cells.column("point", text=True),
    ]
    rest = found.of_rest
    if rest is not None:
        columns.append(Column(texts("column.without", points=texts.listed(list(found.asked.without), 3))))
    classes = bool(found.asked.classes)
    if classes:
        columns += [cells.column("class"), cells.column("verdict", text=True)]
    known = [each.predicted_rmse_of_product for each in own.prediction.values() if each is not None]
    decimals = decimals_for(np.array(known))
    rows: list[Row] = []
    for part in own.parts:
        row = _row(found, own, part, decimals)
        if not row:
            continue
        if rest is not None:
            left = rest.parts[part]
            row.append(cells.number(math.nan if left is None else left.rmse, decimals))
        rows.append([*row, *(_class(found, part, decimals, cells) if classes else [])])
    unit = found.result.block.linear_unit
    return [Table(texts("table.figures", unit=unit), columns, rows)]


def _row(found: Statement, own: Figures, part: str, decimals: int) -> list[Cell | str | float | None]:
    texts, cells = found.texts, Written(found.texts)
    sized, predicted = own.parts[part], own.prediction[part]
    if sized is None or predicted is None:
        return []
    survey, combined = _survey(own, part)
    low, high = (texts.number(each, decimals) for each in predicted.rmse_interval)
    numbers = (sized.mean, sized.sd, sized.rmse), (predicted.predicted_rmse, survey, combined, sized.largest)
    before, after = ([cells.number(each, decimals) for each in group] for group in numbers)
    return [texts(f"component.{part}"), sized.n, *before, f"{low} – {high}", *after, sized.point]


def _survey(own: Figures, part: str) -> tuple[float, float]:
    """Return RMSE of the survey, and combined with what was found, of parts that standards have."""
    if part == "plan":
        return own.rmse_h2, own.rmse_h
    if part == "h":
        return own.rmse_v2, own.rmse_v
    if part == "all":
        return math.hypot(own.rmse_h2, own.rmse_v2), own.rmse_3d
    return math.nan, math.nan


def _class(found: Statement, part: str, decimals: int, cells: Written) -> list[Cell | str | None]:
    asked, name = found.asked.classes, _CLASSES.get(part, "")
    if name not in asked or found.standards.asprs is None:
        return [None, ""]
    verdict = found.standards.asprs.verdicts.get(name, "")
    return [cells.number(asked[name], decimals), found.texts(f"asprs.verdict.{verdict}") if verdict else ""]


def _notes(found: Statement) -> list[Text]:
    """Return what the sum of squares of the ASPRS means."""
    texts, of_all, asprs = found.texts, found.of_all, found.standards.asprs
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


def _map(found: Statement) -> Drawing:
    texts, control = found.texts, control_places(found.result.block)
    labels = {
        "control": texts("use.control"),
        "check": texts("use.check"),
        "east": texts("column.east"),
        "north": texts("column.north"),
        "height": texts("component.h"),
        "unit": found.result.block.linear_unit,
        "decimal": texts("number.decimal"),
    }
    sketch = partial(differences, found.compared, control, labels)
    return Drawing("map-differences", texts("page.map"), texts("page.map.caption"), sketch)


def _features(texts: Texts, features: Features) -> Table:
    """Return the quantities of features: two figures of the smallest deviation among those of one unit."""
    cells = Written(texts)
    columns = [
        cells.column("feature", text=True),
        cells.column("quantity", text=True),
        *(cells.column(key) for key in ("value", "sd", "expanded")),
        Column("", text=True),
    ]
    rows: list[Row] = []
    for each in features:
        name = f"{each.name}: {texts.text(through(each))}"
        for own in each.quantities:
            alike = np.array([other.sd for other in each.quantities if other.unit == own.unit])
            decimals = decimals_of(alike, smallest=True)
            numbers = (cells.number(value, decimals) for value in (own.value, own.sd, own.expanded))
            rows.append([name, texts.word("measured", own.name), *numbers, own.unit])
    return Table(texts("table.features"), columns, rows, f"k = {texts.number(features.k, 2)}")


def _metrology(found: Statement) -> list[Section]:
    """Return features, and calibrated lengths: results of metrology."""
    texts, cells = found.texts, Written(found.texts)
    tables: list[Part] = []
    features, lengths = found.result.features, found.standards.lengths
    unit = found.result.block.linear_unit
    if features is not None and len(features):
        tables.append(_features(texts, features))
    if lengths is not None:
        test, decimals = lengths.test, decimals_for(lengths.test.sd)
        limits = np.full(len(lengths.lines), math.nan) if test.limits is None else test.limits
        columns: list[tuple[Column, Any]] = [
            (cells.column("line", text=True), lambda k: f"{lengths.lines[k]}: {' – '.join(lengths.ends[k])}"),
            cells.numbers("length", lengths.calibrated, decimals, unit),
            cells.numbers("error", test.errors, decimals, unit),
            cells.numbers("sd", test.sd, decimals, unit),
            cells.numbers("normalised", test.normalised, 2, unit),
            cells.numbers("limit", limits, decimals, unit),
        ]
        tables.append(Table.of(texts("table.lengths"), range(len(lengths.lines)), columns))
        labels = {name: texts(f"column.{name}") for name in ("length", "error")}
        labels |= {"unit": unit, "decimal": texts("number.decimal")}
        sketch = partial(drawn_lengths, lengths, labels)
        title, caption = texts("picture.lengths"), texts("picture.lengths.caption")
        tables.append(Drawing("lengths", title, caption, sketch))
    if found.standards.iso_19157:
        measures = Table.of(
            texts("table.iso"),
            found.standards.iso_19157,
            [
                (cells.column("measure", text=True), lambda each: each["measure"]),
                (cells.column("id"), lambda each: each["measure_id"]),
                (cells.column("value"), lambda each: _measured(texts, each["value"])),
                (Column(""), lambda each: each["unit"]),
            ],
        )
        tables.append(measures)
    if not tables:
        return []
    return [Section("annex-h", texts("annex.h"), tables, annex=True)]


def _measured(texts: Texts, value: Any) -> str:
    values = value if isinstance(value, list) else [value]
    return " / ".join("–" if each is None else texts.significant(each, 3) for each in values)
