"""The page of a statement: one sheet for the client, then annexes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from photogram.results.features_report import through
from photogram.results.features_report import written as feature_written
from photogram.results.statement.annexes import (
    adjustment_annex,
    budgets_annex,
    camera_annex,
    checks_annex,
    files_annex,
    left_out_annex,
    survey_annex,
)
from photogram.results.statement.compared import control_places
from photogram.results.statement.drawings import differences, overlap
from photogram.results.statement.figures import Figures
from photogram.results.statement.sheets import Written, decimals_for
from photogram.results.statement.statement import Statement
from photogram.results.statement.texts import Texts
from photogram.show.page import Column, Drawing, Fact, Judgement, Page, Remarks, Row, Section, Table, Text
from photogram.show.ways import page_of

__all__ = ["statement_page"]

_PARTS = (("e", "e"), ("n", "n"), ("h", "h"), ("plan", "plan"), ("all", "all"))
_CLASSES = {"h": "v", "plan": "h", "all": "3d"}
"""Parts of the components with classes."""


@page_of.register(Statement)
@np.errstate(over="ignore", invalid="ignore")
def statement_page(found: Statement) -> Page:
    """Return the page of a statement, for the browser and for paper."""
    texts, asked, judged = found.texts, found.asked, found.judged
    names = ("project", "client", "firm", "surveyor")
    head = [Fact(texts(f"page.{name}"), own) for name in names if (own := getattr(asked, name))]
    if asked.date:
        head.append(Fact(texts("page.date"), texts.day(asked.date)))
    tone = judged.tone
    mark = texts(f"mark.{tone or 'good'}")
    return Page(
        what=texts("page.what"),
        title=asked.title or found.result.block.title,
        judgements=[Judgement(mark, found.headline, [text for _, text in judged.sentences], tone)],
        advice=[],
        highlights=[],
        sections=[
            Section("figures", texts("page.figures"), [*_figures(found), *_notes(found)]),
            Section(
                "assumptions", texts("page.assumptions"), [Remarks([t for _, t in judged.assumptions], 40)]
            ),
            Section(
                "remarks", texts("page.remarks"), [Remarks(judged.remarks, 40)] if judged.remarks else []
            ),
            Section("map", texts("page.map"), [*_maps(found), Text(texts("page.signature"))]),
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
    )


def _told(name: str, texts: Texts, sentences: Sequence[str]) -> Section:
    return Section(name, texts(f"page.{name}"), [Remarks(sentences, 40)] if sentences else [])


def _figures(found: Statement) -> list[Table]:
    if found.of_all is None:
        return []
    tables = [_figure_table(found, found.of_all, "")]
    if found.of_rest is not None:
        left = ", ".join(found.asked.without)
        tables.append(_figure_table(found, found.of_rest, found.texts("table.without", points=left)))
    return [*tables, _radii(found, found.of_all)]


def _figure_table(found: Statement, own: Figures, caption: str) -> Table:
    texts, cells = found.texts, Written(found.texts)
    unit = found.result.block.linear_unit
    decimals = decimals_for(own.points.sd_adjusted)
    keys = ("mean", "sd", "rmse", "interval", "predicted", "survey", "combined", "largest")
    columns = [
        cells.column("component", text=True),
        cells.column("n"),
        *(cells.column(key, unit) for key in keys),
        cells.column("point", text=True),
    ]
    classes = bool(found.asked.classes) and not caption
    if classes:
        columns += [cells.column("class", unit), cells.column("verdict", text=True)]
    rows: list[Row] = []
    for part, name in _PARTS:
        sized, predicted = own.parts[part], own.prediction[part]
        if sized is None or predicted is None:
            continue
        survey, combined = _survey(own, part)
        number = partial(cells.number, decimals=decimals)
        low, high = (texts.number(each, decimals) for each in predicted.rmse_interval)
        row: list[object] = [
            texts(f"component.{name}"),
            sized.n,
            number(sized.mean),
            number(sized.sd),
            number(sized.rmse),
            f"{low} – {high}",
            number(predicted.predicted_rmse),
            number(survey),
            number(combined),
            number(sized.largest),
            sized.point,
        ]
        if classes:
            row += _class(found, part, decimals, cells)
        rows.append(row)  # type: ignore[arg-type]
    return Table(caption or texts("page.figures"), columns, rows)


def _survey(own: Figures, part: str) -> tuple[float, float]:
    """Return RMSE of the survey, and combined with what was found, of parts that standards have."""
    if part == "plan":
        return own.rmse_h2, own.rmse_h
    if part == "h":
        return own.rmse_v2, own.rmse_v
    if part == "all":
        return math.hypot(own.rmse_h2, own.rmse_v2), own.rmse_3d
    return math.nan, math.nan


def _class(found: Statement, part: str, decimals: int, cells: Written) -> list[object]:
    asked, name = found.asked.classes, _CLASSES.get(part, "")
    if name not in asked or found.standards.asprs is None:
        return [None, ""]
    verdict = found.standards.asprs.verdicts.get(name, "")
    return [cells.number(asked[name], decimals), found.texts(f"asprs.verdict.{verdict}") if verdict else ""]


def _radii(found: Statement, own: Figures) -> Table:
    texts, cells = found.texts, Written(found.texts)
    unit = found.result.block.linear_unit
    decimals = decimals_for(own.points.sd_adjusted)
    columns = [
        Column("", text=True),
        *(cells.column(key, unit) for key in ("sample", "upper", "moments", "predicted")),
    ]
    rows: list[Row] = []
    for name, radius in own.radii.items():
        if radius is not None:
            values = (radius.sample, radius.upper, own.of_moments[name], own.mixture.get(name, math.nan))
            numbers = [cells.number(math.nan if each is None else each, decimals) for each in values]
            rows.append([name.upper(), *numbers])
    return Table(texts("table.radii"), columns, rows, texts("table.radii.note"))


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


def _maps(found: Statement) -> Sequence[Drawing]:
    texts, unit = found.texts, found.result.block.linear_unit
    labels = {
        "control": texts("use.control"),
        "check": texts("use.check"),
        "east": texts("column.east"),
        "north": texts("column.north"),
        "height": texts("component.h"),
        "photos": texts("column.photos"),
        "unit": unit,
    }
    control = control_places(found.result.block)
    return [
        Drawing(
            "map-differences",
            texts("page.map"),
            texts("page.map.caption"),
            lambda: differences(found.compared, control, labels),
        ),
        Drawing(
            "map-overlap",
            texts("page.overlap"),
            texts("page.overlap.caption"),
            lambda: overlap(found.result, labels),
        ),
    ]


def _metrology(found: Statement) -> list[Section]:
    """Return features, and calibrated lengths: results of metrology."""
    texts, cells = found.texts, Written(found.texts)
    tables: list[Table] = []
    features, lengths = found.result.features, found.standards.lengths
    unit = found.result.block.linear_unit
    if features is not None and len(features):
        rows: list[Row] = [
            [f"{each.name}: {through(each)}", own.name, *feature_written(each, own), own.unit]
            for each in features
            for own in each.quantities
        ]
        columns = [
            cells.column("feature", text=True),
            cells.column("quantity", text=True),
            *(cells.column(key) for key in ("value", "sd", "expanded")),
            Column("", text=True),
        ]
        tables.append(Table(texts("table.features"), columns, rows, f"k = {texts.number(features.k, 2)}"))
    if lengths is not None:
        decimals = decimals_for(lengths.test.sd)
        columns = [
            cells.column("line", text=True),
            *(cells.column(key, unit) for key in ("length", "error", "sd", "normalised", "limit")),
        ]
        own_limits = lengths.test.limits
        rows = [
            [
                f"{line}: {first} – {last}",
                cells.number(float(lengths.calibrated[k]), decimals),
                cells.number(float(lengths.test.errors[k]), decimals),
                cells.number(float(lengths.test.sd[k]), decimals),
                cells.number(float(lengths.test.normalised[k]), 2),
                cells.number(math.nan if own_limits is None else float(own_limits[k]), decimals),
            ]
            for k, (line, (first, last)) in enumerate(zip(lengths.lines, lengths.ends, strict=True))
        ]
        tables.append(Table(texts("table.lengths"), columns, rows))
    if found.standards.iso_19157:
        columns = [cells.column("measure", text=True), cells.column("id"), cells.column("value"), Column("")]
        rows = []
        for each in found.standards.iso_19157:
            values = each["value"] if isinstance(each["value"], list) else [each["value"]]
            shown = " / ".join(texts.significant(own, 3) if own is not None else "–" for own in values)
            rows.append([each["measure"], each["measure_id"], shown, each["unit"]])
        tables.append(Table(texts("table.iso"), columns, rows))
    if not tables:
        return []
    return [Section("metrology", texts("page.values"), tables, annex=True)]
