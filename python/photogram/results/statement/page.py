"""The page of a statement: one sheet for the client, then annexes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, cast

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import replace
from photogram.network.point_sets import hull, outside
from photogram.results.distortion import distortion_curve, observed_rows
from photogram.results.features import quantity_columns, through, unit_deviations
from photogram.results.footprints import footprints
from photogram.results.network_sections import fit_of_images
from photogram.results.parts import AdjustedCamera
from photogram.results.statement import tables as declared
from photogram.results.statement.budget import Budget, Source, budget_fields
from photogram.results.statement.comparison import Compared, control_places, in_order
from photogram.results.statement.figures import Figures
from photogram.results.statement.judgement import fixed_values
from photogram.results.statement.standards import LengthTest
from photogram.results.statement.texts import Texts
from photogram.show.judgement import verdict_table
from photogram.show.page import Document, Drawing, Fact, Facts, Judgement, Part, Remarks, Section, Text
from photogram.show.quantity import Axis, Quantity, Table, named
from photogram.show.sketch import marks as shapes
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, SOFT, VERMILION, round_length

if TYPE_CHECKING:
    from photogram import Result, Statement

MAX_FINE_SOURCES = 12  # Sources of a budget in addition to the types of observations
MAX_RADII = 11


def annexes(statement: Statement) -> list[Section]:
    texts, result = statement.texts, statement.result
    checks = [
        declared.check_points(statement),
        *([] if statement.of_all is None else [_radii(texts, statement.of_all)]),
    ]
    held = fixed_values(texts, result) or texts("annex.c.nothing")
    budgets = [part for each in statement.taken_apart for part in _budget(texts, each)]
    left_out = declared.left_out_points(texts, statement.left_out)
    return [
        declared.annex(texts, "a", checks),
        declared.annex(texts, "b", [left_out], texts("annex.b.note")),
        declared.annex(texts, "c", budgets, texts("annex.c.note", held=held)),
        declared.annex(texts, "d", [part for each in result.cameras for part in _camera(statement, each)]),
        declared.annex(texts, "e", _adjustment(statement), texts.text(result.verdict.message)),
        declared.annex(texts, "f", _survey(statement)),
        declared.annex(texts, "h", _metrology(statement)),
        declared.annex(texts, "g", _files(statement)),
    ]


def _radii(texts: Texts, own: Figures) -> Table:
    columns, decimals = declared.Columns(texts), declared.decimals_for(own.points.sd_adjusted)
    radii = {name: radius for name, radius in own.radii.items() if radius is not None}
    number = partial(columns.number, decimals=decimals, unit=texts.unit)
    upper = [math.nan if radius["upper"] is None else radius["upper"] for radius in radii.values()]
    quantities = [
        columns.text(declared.BLANK, [name.upper() for name in radii]),
        number("sample", [radius["sample"] for radius in radii.values()]),
        number("upper", upper),
        number("moments", [own.of_moments[name] for name in radii]),
        number("mixture", [own.mixture.get(name, math.nan) for name in radii]),
    ]
    return Table("radii", texts("table.radii"), quantities, texts("table.radii.note"))


def _budget(texts: Texts, own: Budget) -> list[Table]:
    columns = declared.Columns(texts)
    finer = [each for level in ("strip", "camera", "point", "parameter") for each in own.at(level)]
    if len(own.at("camera")) < 2:
        finer = [each for each in finer if each.level != "camera"]
    finer = sorted(finer, key=lambda source: -source.contribution)[:MAX_FINE_SOURCES]
    kinds = own.at("kind")
    sources, blank = [*kinds, *finer], [None] * len(finer)
    estimated = own.freedom.of_kind if own.freedom.basis == "components" else {}
    dof = [estimated.get(each.name, math.inf) for each in kinds]
    origins = [texts("from.estimated" if math.isfinite(nu) else "from.given") for nu in dof]
    names = [texts.kind(each.name) for each in kinds]
    names += [f"– {texts(f'level.{each.level}', name=each.subject)}" for each in finer]
    largest = [cast("tuple[str, ...]", each.subject) for each in own.largest]

    def shares(rows: Sequence[Source]) -> list[Quantity]:
        number = columns.number("u", [each.u for each in rows], unit=own.unit, figures=2)
        return [number, columns.number("share", [100 * each.share for each in rows], 1, "%")]

    tables = [
        [
            columns.text("source", names),
            columns.number("number", [each.number for each in sources]),
            *shares(sources),
            columns.number("dof", [*dof, *blank], 1),
            columns.text("from", [*origins, *[""] * len(finer)]),
        ],
        [
            columns.text("observation", [texts.observation(name) for name in largest]),
            columns.number("sd", [each.sd for each in own.largest]),
            columns.number("sensitivity", [each.sensitivity for each in own.largest]),
            *shares(own.largest),
        ],
    ]
    titles = texts("budget.line", **budget_fields(texts, own)), texts("table.single", quantity=own.subject)
    return [Table("budget", title, quantities) for title, quantities in zip(titles, tables, strict=True)]


def _camera(statement: Statement, camera: AdjustedCamera) -> list[Table]:
    texts, columns, sd = statement.texts, declared.Columns(statement.texts), camera.sd
    of, estimated = [*map(camera.camera.unit_of, camera.names)], camera.estimated
    axes = tuple(Axis.of(name, unit) for name, unit in zip(camera.names, of, strict=True))
    names = [camera.names[k] for k in estimated]
    value = Quantity(
        camera.values, axes, "value", head=columns.head("value"), figures=6, of=np.arange(len(of))
    )
    origins = [texts("from.estimated" if k in estimated else "from.given") for k in range(len(of))]
    parameters = [
        columns.text("parameter", camera.names),
        columns.text(declared.BLANK, of),
        value,
        columns.number("sd", sd, figures=2),
        columns.text("from", origins),
    ]
    title = texts("table.camera", camera=camera.name)
    tables = [Table("camera", title, parameters, deviations=sd[np.newaxis])]
    if len(names) > 1:
        matrix = camera.correlations[np.ix_(estimated, estimated)]
        numbers = [
            Quantity(column, head=name, decimals=2) for name, column in zip(names, matrix.T, strict=True)
        ]
        title = texts("table.correlations", camera=camera.name)
        tables.append(Table("correlations", title, [columns.text("parameter", names), *numbers]))
    curve = distortion_curve(statement.result, camera)
    if curve is not None:
        unit, rows = statement.result.block.image_unit, observed_rows(curve, MAX_RADII)
        decimals = declared.decimals_for(curve.sd[rows])
        distortion = [
            columns.number("radius", curve.radii[rows], unit=unit),
            columns.number("correction", curve.values[rows], decimals, unit),
            columns.number("sd", curve.sd[rows], decimals, unit),
        ]
        tables.append(Table("distortion", texts("table.distortion", camera=camera.name), distortion))
    return tables


def _adjustment(statement: Statement) -> list[Part]:
    texts, columns = statement.texts, declared.Columns(statement.texts)
    kinds = declared.kinds_of(statement.result)
    counts, redundancy, squares = zip(*kinds.values(), strict=True)
    sums = [
        columns.text("kind", [texts.kind(name) for name in kinds]),
        columns.number("number", counts),
        columns.number("redundancy", redundancy, 1),
        columns.number("squares", squares, 1),
    ]
    caption = texts("page.overlap.caption")
    drawing = Drawing(
        "map-overlap", texts("page.overlap"), caption, partial(overlap, statement.result, texts)
    )
    return [
        Table("kinds", texts("table.kinds"), sums),
        verdict_table(statement.result.verdict, texts),
        declared.removed_observations(statement),
        _markers(statement),
        drawing,
    ]


def _markers(statement: Statement) -> Table:
    texts, columns, result = statement.texts, declared.Columns(statement.texts), statement.result
    block, kinds = result.block, result.point_kinds
    fit = fit_of_images(result, result.image_points, len(kinds))
    rows = in_order(block, np.flatnonzero((kinds != "pass") & (fit[:, 5] > 0)))
    number = partial(columns.number, decimals=2, unit=block.image_unit)
    quantities = [
        columns.text("point", [block.point_ids[row] for row in rows]),
        columns.text("use", [texts(f"use.{kind}") for kind in kinds[rows]]),
        columns.number("photos", fit[rows, 5].astype(int)),
        number("rms", np.hypot(*fit[rows, :2].T)),
        number("largest", fit[rows, 3]),
    ]
    return Table("markers", texts("table.markers"), quantities)


def _survey(statement: Statement) -> list[Table]:
    texts, columns, own = statement.texts, declared.Columns(statement.texts), statement.survey
    decimals = max(3, declared.decimals_for(own.sd))
    coordinates = [
        columns.number(texts(f"axis.{name}"), column, 8 if unit == "deg" else decimals, texts(f"unit.{unit}"))
        for (name, unit), column in zip(own.system.axes, own.positions.T, strict=True)
    ]
    quantities = [
        columns.text("point", own.names),
        columns.text("use", [texts(f"use.{kind}") for kind in own.kinds]),
        *coordinates,
        columns.directions("sd", own.sd, decimals, texts.unit),
    ]
    note = texts("assume.crs", crs=own.system.crs) if own.system.crs else ""
    return [Table("survey", texts("annex.f"), quantities, note)]


def _files(statement: Statement) -> list[Part]:
    texts, columns, files = statement.texts, declared.Columns(statement.texts), statement.inputs
    facts = [Fact(texts("page.program"), f"photogram {_photocore.__version__}")]
    if statement.command:
        facts.append(Fact(texts("page.command"), statement.command))
    quantities = [
        columns.text(texts("page.file"), [each.path.name for each in files]),
        columns.number("size", [each.size for each in files], unit=texts("unit.bytes"), decimals=0),
        columns.text("SHA-256", [each.sha256 for each in files]),
    ]
    return [Facts(texts("page.program"), facts), Table("files", texts("table.files"), quantities)]


def _metrology(statement: Statement) -> list[Part]:
    texts, parts = statement.texts, list[Part]()
    lengths, features = statement.standards.lengths, statement.result.features
    if features is not None and len(features):
        # Two figures of the least deviation per unit
        every = [(feature, own) for feature in features for own in feature.quantities]
        names = [f"{feature.name}: {texts.text(through(feature))}" for feature, _ in every]
        columns, of = declared.Columns(texts), quantity_columns(features)
        quantities = [
            columns.text("feature", names),
            columns.text("quantity", [texts(f"measured.{own.name}") for _, own in every]),
            *(replace(named(of, key), head=columns.head(key)) for key in ("value", "sd", "expanded")),
            columns.text(declared.BLANK, [own.unit for _, own in every]),
        ]
        note, by = f"k = {texts.number(features.k, 2)}", unit_deviations(features)
        parts.append(Table("features", texts("table.features"), quantities, note, deviations=by))
    if lengths is not None:
        sketch, caption = partial(drawn_lengths, lengths, texts), texts("picture.lengths.caption")
        drawing = Drawing("lengths", texts("picture.lengths"), caption, sketch)
        parts += [declared.test_lengths(texts, lengths), drawing]
    measures = [declared.quality_measures(statement)] if statement.standards.iso_19157 else []
    return [*parts, *measures]


_CLASSES = {"h": "v", "plan": "h", "all": "3d"}  # Parts of the components with classes


@np.errstate(over="ignore", invalid="ignore")
def statement_document(statement: Statement) -> Document:
    texts, asked, judged = statement.texts, statement.asked, statement.judged
    names = ("project", "client", "firm", "surveyor")
    head = [Fact(texts(f"page.{name}"), own) for name in names if (own := getattr(asked, name))]
    if asked.date:
        head.append(Fact(texts("page.date"), texts.day(asked.date)))
    tone = judged.tone
    mark = texts(f"mark.{tone or 'good'}")
    assumed = Remarks([text for _, text in judged.assumptions], 40)
    sketch = partial(differences, statement.compared, control_places(statement.result.block), texts)
    drawing = Drawing("map-differences", texts("page.map"), texts("page.map.caption"), sketch)
    return Document(
        what=texts("page.what"),
        title=asked.title or statement.result.block.title,
        judgements=[Judgement(mark, statement.headline, [text for _, text in judged.sentences], tone)],
        sections=[
            Section("figures", texts("page.figures"), [*_figures(statement), *_notes(statement)]),
            Section("assumptions", texts("page.assumptions"), [assumed, drawing]),
            Section("remarks", texts("page.remarks"), [Remarks(judged.remarks, 40)]),
            Section("signature", "", [Text(texts("page.signature"))]),
            *annexes(statement),
        ],
        members=partial(declared.statement_members, statement),
        head=head,
        first=texts("page.first"),
        words=texts,
    )


def _figures(statement: Statement) -> list[Part]:
    own, texts, rest = statement.of_all, statement.texts, statement.of_rest
    if own is None:
        return []
    columns = declared.Columns(texts)
    shown = [
        (part, sized, predicted)
        for part, sized in own.parts.items()
        if sized and (predicted := own.prediction[part])
    ]
    known = [each.predicted_rmse_of_product for each in own.prediction.values() if each is not None]
    decimals = declared.decimals_for(np.array(known))
    number = partial(columns.number, decimals=decimals)
    intervals = [
        " – ".join(texts.number(limit, decimals) for limit in predicted.rmse_interval_95)
        for *_, predicted in shown
    ]
    # Parts in standards: RMSE of the survey, and combined with the RMSE of the differences.
    rmse = own.rmse
    of_parts = {"plan": (rmse["rmse_h2"], rmse["rmse_h"]), "h": (rmse["rmse_v2"], rmse["rmse_v"])}
    of_parts["all"] = math.hypot(rmse["rmse_h2"], rmse["rmse_v2"]), rmse["rmse_3d"]
    surveys = [of_parts.get(part, (math.nan, math.nan)) for part, *_ in shown]
    quantities = [
        columns.text("component", [texts(f"component.{part}") for part, *_ in shown]),
        columns.number("n", [sized.n for _, sized, _ in shown]),
        *(number(key, [getattr(sized, key) for _, sized, _ in shown]) for key in ("mean", "sd", "rmse")),
        columns.text("interval", intervals),
        number("predicted", [predicted.predicted_rmse for *_, predicted in shown]),
        number("survey", [survey for survey, _ in surveys]),
        number("combined", [combined for _, combined in surveys]),
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


def _notes(statement: Statement) -> list[Text]:
    """Return notes on the sum of squares of the ASPRS."""
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


WIDTH = 6.3  # Inches
REACH = 0.08  # Length of the largest arrow relative to the extent
NINETY_FIVE = 2.4477  # Semi-axes of the ellipse of 95 percent, in standard deviations
NAMED = 60
CELLS = 120  # Along the longer side of the map of overlap


def differences(found: Compared, control: Floats, texts: Texts) -> Plot | None:
    """Draw (k, 3) control, check points and differences, heights as colours."""
    if not len(found) and not len(control):
        return None
    places = np.concatenate([each[:, :2] for each in (found.places, control) if len(each)])
    extent, marks, bars, shades = np.ptp(places, axis=0), list[shapes.Mark](), list[shapes.ScaleBar](), None
    if len(control):
        marks.append(shapes.Markers(control[:, :2], "^", 6.0, SOFT, label=texts("use.control")))
    if len(found):
        plan, d = found.places[:, :2], found.differences
        heights = np.where(np.isfinite(d[:, 2]), d[:, 2], 0.0)
        most = max(float(np.abs(heights).max()), 1e-12)
        shades = shapes.Shades(-most, most, f"{texts('component.h')}, {texts.unit}", "signed")
        marks += [
            shapes.Markers(plan, "s", 5.1, edge=0.0, values=heights, shades=shades, layer=3.0),
            shapes.Markers(plan, "s", 5.1, face="none", edge=0.5, label=texts("use.check"), layer=3.5),
        ]
        both = np.isfinite(d[:, :2]).all(axis=1)
        if both.any():
            largest = max(float(np.hypot(*d[both, :2].T).max()), 1e-12)
            scale, length = REACH * max(float(extent.max()), 1e-9) / largest, round_length(largest)
            semi_axes, angles = shapes.ellipse_axes(found.blocks(found.covariance)[both, :2, :2])
            marks += [
                shapes.Ellipses(plan[both], NINETY_FIVE * scale * semi_axes, angles, BLUE, 0.6),
                shapes.Arrows(plan[both], scale * d[both, :2], VERMILION, 0.003, layer=4.0),
            ]
            sizes = (f"{size:.3g} {texts.unit}" for size in (length, length * scale))
            bars = [(length * scale, VERMILION, " = ".join(sizes).replace(".", texts("number.decimal")))]
        if len(found) <= NAMED:
            marks.append(shapes.Names(plan, found.names, [SOFT] * len(found)))
    height = float(np.clip(WIDTH * (extent[1] + 1e-9) / (extent[0] + 1e-9), 2.6, WIDTH))
    panel = _in_plan(shapes.around(places, 0.12), texts)
    return Plot(WIDTH, height, [replace(panel, marks=marks, bars=bars, shades=shades, legend="beside")])


def _in_plan(limits: Floats, texts: Texts) -> shapes.Panel:
    across, up = (f"{texts(f'column.{axis}')}, {texts.unit}" for axis in ("east", "north"))
    return shapes.Panel(limits, across=across, up=up, equal=True, decimal=texts("number.decimal"))


def drawn_lengths(test: LengthTest, texts: Texts) -> Plot:
    """Draw errors of calibrated lengths by length, with sd and limits."""
    order = np.argsort(test.calibrated, kind="stable")
    places = np.column_stack([test.calibrated, test.errors])
    ends = [test.errors - test.sd, test.errors + test.sd]
    marks: list[shapes.Mark] = [
        shapes.Line(shapes.error_bars(places, *ends), BLUE, 0.7),
        shapes.Markers(places, "o", 3.0, BLUE),
        shapes.horizontal_line(0.0, SOFT, 0.6),
    ]
    if test.limits is not None:
        for limit in (test.limits, -test.limits):
            ends.append(limit)
            line = np.column_stack([test.calibrated, limit])[order]
            marks.append(shapes.Line(line, VERMILION, 0.9, "--"))
    limits = np.column_stack([shapes.spread(test.calibrated), shapes.spread(0.0, *ends)])
    across, up = (f"{texts(f'column.{name}')}, {texts.unit}" for name in ("length", "error"))
    return Plot(WIDTH, 3.0, [shapes.Panel(limits, marks, "", across, up, decimal=texts("number.decimal"))])


def overlap(result: Result, texts: Texts) -> Plot | None:
    """Draw the number of photos of ground positions; None without footprints."""
    outlines = footprints(result).outlines[:, :, :2]
    outlines = outlines[np.isfinite(outlines).all(axis=(1, 2))]
    if not len(outlines):
        return None
    low, high = outlines.min(axis=(0, 1)), outlines.max(axis=(0, 1))
    cell = float((high - low).max()) / CELLS
    if not cell > 0:
        return None
    x, y = (np.arange(low[k] + cell / 2, high[k], cell) for k in (0, 1))
    counts = np.zeros((len(y), len(x)))
    for outline in outlines:
        columns, rows = (
            np.flatnonzero((centres >= side.min()) & (centres <= side.max()))
            for centres, side in zip((x, y), outline.T, strict=True)
        )
        if len(columns) and len(rows):
            grid = np.stack(np.meshgrid(x[columns], y[rows]), axis=-1)
            inside = ~outside(grid.reshape(-1, 2), hull(outline))
            counts[np.ix_(rows, columns)] += inside.reshape(grid.shape[:2])
    shades = shapes.Shades(0.0, float(counts.max()) or 1.0, texts("column.photos"))
    corners = np.array([low, low + cell * np.array([len(x), len(y)])])
    cells = shapes.Mesh(corners, np.where(counts > 0, counts, np.nan), shades)
    panel = replace(_in_plan(corners, texts), marks=[cells], shades=shades)
    return Plot(WIDTH, float(np.clip(WIDTH * len(y) / len(x), 2.4, WIDTH)), [panel])
