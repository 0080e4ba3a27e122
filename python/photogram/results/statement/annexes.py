"""The annexes of a statement: check points, control left out, budgets, cameras, adjustment, survey, files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.results.cameras import AdjustedCamera, units
from photogram.results.distortion import distortion_curve
from photogram.results.statement import translation
from photogram.results.statement.budget import Budget, budget_line
from photogram.results.statement.comparison import in_order
from photogram.results.statement.document import kinds_of
from photogram.results.statement.drawings import overlap
from photogram.results.statement.figures import Figures
from photogram.results.statement.leave_one_out import limit_of
from photogram.results.statement.sheets import Written, decimals_for
from photogram.results.statement.statement import Statement
from photogram.show.judgement import signs_of
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Fact,
    Facts,
    Part,
    Remarks,
    Row,
    Section,
    Table,
    decimals_of,
)

__all__ = [
    "adjustment_annex",
    "budgets_annex",
    "camera_annex",
    "checks_annex",
    "files_annex",
    "left_out_annex",
    "survey_annex",
]

_AXES = ("e", "n", "h")
SOURCES = 12
"""Sources of a budget at a finer level than kinds that the page lists, those that contribute most."""
RADII = 11
"""Of the table of distortion."""


def checks_annex(found: Statement) -> Section:
    """Return annex A: every check point."""
    texts, cells, own = found.texts, Written(found.texts), found.compared
    if found.of_all is None:
        return Section("annex-a", texts("annex.a"), [], annex=True)
    tests, unit = found.of_all.points, found.result.block.linear_unit
    decimals = decimals_for(tests.sd_adjusted)
    columns = [
        cells.column("point", text=True),
        cells.column("cover", text=True),
        *cells.columns(("difference", "sd"), unit),
        *cells.columns(("normalised",), ""),
        cells.column("T"),
        cells.column("p"),
        cells.column("others"),
        Column("CE90", unit),
        Column("LE90", unit),
    ]
    rows: list[Row] = [
        [
            Cell(name, tone="look" if name in found.asked.without else ""),
            texts(f"cover.{'vegetated' if own.vegetated[k] else 'open'}"),
            *cells.vector(own.differences[k], decimals),
            *cells.vector(tests.sd_predicted[k], decimals),
            *cells.vector(tests.normalised[k], 1),
            cells.number(float(tests.T[k]), 1),
            cells.p(float(tests.p[k]), tests.limit),
            cells.looked(float(tests.others[k]), 1, bad=bool(tests.p_others[k] < tests.limit)),
            cells.number(float(tests.ce90[k]), decimals),
            cells.number(float(tests.le90[k]), decimals),
        ]
        for k, name in enumerate(own.names)
    ]
    table = Table(texts("annex.a"), columns, rows)
    return Section("annex-a", texts("annex.a"), [table, _radii(found, found.of_all)], annex=True)


def _radii(found: Statement, own: Figures) -> Table:
    texts, cells = found.texts, Written(found.texts)
    unit = found.result.block.linear_unit
    decimals = decimals_for(own.points.sd_adjusted)
    columns = [
        Column("", text=True),
        *(cells.column(key, unit) for key in ("sample", "upper", "moments", "mixture")),
    ]
    rows: list[Row] = []
    for name, radius in own.radii.items():
        if radius is not None:
            values = (radius.sample, radius.upper, own.of_moments[name], own.mixture.get(name, math.nan))
            numbers = [cells.number(math.nan if each is None else each, decimals) for each in values]
            rows.append([name.upper(), *numbers])
    return Table(texts("table.radii"), columns, rows, texts("table.radii.note"))


def left_out_annex(found: Statement) -> Section:
    """Return annex B: control points as the others predict them."""
    texts, cells = found.texts, Written(found.texts)
    if not found.left_out:
        return Section("annex-b", texts("annex.b"), [], annex=True)
    unit = found.result.block.linear_unit
    decimals = decimals_for(np.array([each.sd for each in found.left_out]))
    columns = [
        cells.column("point", text=True),
        *cells.columns(("difference", "sd"), unit),
        cells.column("T"),
        cells.column("p"),
    ]
    rows: list[Row] = [
        [
            each.point,
            *cells.vector(each.difference, decimals),
            *cells.vector(each.sd, decimals),
            cells.number(each.T, 1),
            cells.p(each.p, limit_of(found.left_out)),
        ]
        for each in found.left_out
    ]
    table = Table(texts("annex.b"), columns, rows)
    return Section("annex-b", texts("annex.b"), [table], texts("annex.b.note"), annex=True)


def budgets_annex(found: Statement) -> Section:
    """Return annex C: what every source of error contributes."""
    texts = found.texts
    held = translation.held(texts, found.result) or texts("annex.c.nothing")
    parts: list[Part] = []
    for each in found.taken_apart:
        parts += _budget(found, each)
    return Section("annex-c", texts("annex.c"), parts, texts("annex.c.note", held=held), annex=True)


def _budget(found: Statement, own: Budget) -> list[Part]:
    texts, cells = found.texts, Written(found.texts)
    columns = [
        cells.column("source", text=True),
        cells.column("number"),
        cells.column("u", own.unit),
        cells.column("share", "%"),
        cells.column("dof"),
        cells.column("from", text=True),
    ]
    estimated = own.freedom.basis == "components"
    rows: list[Row] = []
    for each in own.at("kind"):
        nu = own.freedom.of_kind.get(each.name, math.inf) if estimated else math.inf
        rows.append(
            [
                translation.kind(texts, each.name),
                each.number,
                cells.figures(each.u, 2),
                cells.number(100 * each.share, 1),
                texts.number(nu, 1),
                texts("from.estimated" if estimated and math.isfinite(nu) else "from.given"),
            ]
        )
    finer = [each for level in ("strip", "camera", "point", "parameter") for each in own.at(level)]
    if len(own.at("camera")) < 2:
        finer = [each for each in finer if each.level != "camera"]
    for each in sorted(finer, key=lambda one: -one.contribution)[:SOURCES]:
        of = translation.parameter(texts, each.name) if each.level == "parameter" else each.name
        name = texts(f"level.{each.level}", name=of)
        share = cells.number(100 * each.share, 1)
        rows.append([f"– {name}", each.number, cells.figures(each.u, 2), share, None, ""])
    title = budget_line(texts, own)
    single = [
        cells.column("observation", text=True),
        cells.column("sd"),
        cells.column("sensitivity"),
        cells.column("u", own.unit),
        cells.column("share", "%"),
    ]
    observed: list[Row] = [
        [
            translation.observation(texts, each.observation),
            cells.figures(each.sd),
            cells.figures(each.sensitivity),
            cells.figures(math.sqrt(each.contribution), 2),
            cells.number(100 * each.share, 1),
        ]
        for each in own.largest
    ]
    return [
        Table(title, columns, rows),
        Table(texts("table.single", quantity=translation.quantity(texts, own.quantity)), single, observed),
    ]


def camera_annex(found: Statement) -> Section:
    """Return annex D: values, standard deviations and correlations of cameras, distortion with its band."""
    parts: list[Part] = []
    for each in found.result.cameras:
        parts += _camera(found, each)
    return Section("annex-d", found.texts("annex.d"), parts, annex=True)


def _camera(found: Statement, camera: AdjustedCamera) -> list[Part]:
    texts, cells = found.texts, Written(found.texts)
    columns = [
        cells.column("parameter", text=True),
        Column("", text=True),
        cells.column("value"),
        cells.column("sd"),
        cells.column("from", text=True),
    ]
    estimated = set(camera.estimated)
    rows: list[Row] = []
    for k, (name, unit) in enumerate(zip(camera.names, units(camera.camera), strict=True)):
        sd = float(camera.sd[k])
        decimals = decimals_of(np.array([sd]), unknown=6)
        own = "from.estimated" if k in estimated else "from.given"
        rows.append(
            [name, unit, cells.number(float(camera.values[k]), decimals), cells.figures(sd, 2), texts(own)]
        )
    parts: list[Part] = [Table(texts("table.camera", camera=camera.name), columns, rows)]
    names = [camera.names[k] for k in camera.estimated]
    if len(names) > 1:
        matrix = camera.correlations[np.ix_(camera.estimated, camera.estimated)]
        between: list[Row] = [
            [name, *(cells.number(float(value), 2) for value in row)]
            for name, row in zip(names, matrix, strict=True)
        ]
        heads = [cells.column("parameter", text=True), *(Column(name) for name in names)]
        parts.append(Table(texts("table.correlations", camera=camera.name), heads, between))
    return [*parts, *_distortion(found, camera)]


def _distortion(found: Statement, camera: AdjustedCamera) -> list[Part]:
    texts, cells = found.texts, Written(found.texts)
    curve = distortion_curve(found.result, camera)
    if curve is None:
        return []
    unit = found.result.block.image_unit
    inside = np.flatnonzero(curve.radii <= curve.observed)
    rows_at = inside[np.unique(np.linspace(0, len(inside) - 1, RADII).round().astype(int))]
    decimals = decimals_for(curve.sd[rows_at])
    columns = [cells.column("radius", unit), cells.column("correction", unit), cells.column("sd", unit)]
    rows: list[Row] = [
        [
            cells.figures(float(curve.radii[k])),
            *cells.vector(np.array([curve.values[k], curve.sd[k]]), decimals),
        ]
        for k in rows_at.tolist()
    ]
    return [Table(texts("table.distortion", camera=camera.name), columns, rows)]


def adjustment_annex(found: Statement) -> Section:
    """Return annex E: what was adjusted, how well it fits, what was taken out, residuals of markers."""
    texts, cells, result = found.texts, Written(found.texts), found.result
    columns = [
        cells.column("kind", text=True),
        cells.column("number"),
        cells.column("redundancy"),
        cells.column("squares"),
    ]
    rows: list[Row] = []
    for name, (count, redundancy, squares) in kinds_of(result).items():
        rows.append(
            [translation.kind(texts, name), count, cells.number(redundancy, 1), cells.number(squares, 1)]
        )
    parts: list[Part] = [Table(texts("table.kinds"), columns, rows)]
    if result.verdict.tests:
        parts.append(_tests(found))
    if found.removed:
        removed = [translation.named(texts, each) for each in found.removed]
        parts += [Facts(texts("table.removed"), []), Remarks(removed, 60)]
    parts += [*_markers(found), _overlap(found)]
    intro = translation.verdict(texts, result.verdict)
    return Section("annex-e", texts("annex.e"), parts, intro, annex=True)


def _tests(found: Statement) -> Table:
    """Return all tests of the verdict on the adjustment."""
    texts, cells = found.texts, Written(found.texts)
    columns = [
        cells.column("test", text=True),
        cells.column("statistic", text=True),
        *(cells.column(key) for key in ("value", "low", "high", "p", "level", "tests")),
        cells.column("outcome", text=True),
    ]
    rows: list[Row] = [
        [
            translation.test(texts, each.name),
            signs_of(each.statistic),
            *(cells.figures(value, 4) for value in (each.value, *each.limits)),
            cells.p(each.p, each.level),
            cells.figures(each.level, 2),
            each.tests,
            Cell(texts("test.passes")) if each.accepted else Cell(texts("test.rejects"), tone="look"),
        ]
        for each in found.result.verdict.tests
    ]
    return Table(texts("table.tests"), columns, rows, texts("table.tests.note"))


def _overlap(found: Statement) -> Drawing:
    texts, unit = found.texts, found.result.block.linear_unit
    labels = {name: texts(f"column.{name}") for name in ("east", "north", "photos")}
    labels |= {"unit": unit, "decimal": texts("number.decimal")}
    draw = partial(overlap, found.result, labels)
    return Drawing("map-overlap", texts("page.overlap"), texts("page.overlap.caption"), draw)


def _markers(found: Statement) -> list[Part]:
    """Return rms and largest residual of the images of every control and check point."""
    texts, cells, result = found.texts, Written(found.texts), found.result
    kinds, unit = result.point_kinds, result.block.image_unit
    squares = np.where(result.used_images[:, np.newaxis], result.residuals, 0.0) ** 2
    points, n = result.image_points[result.used_images], len(kinds)
    total = np.bincount(result.image_points, weights=squares.sum(axis=1), minlength=n)
    counts = np.bincount(points, minlength=n)
    largest = np.zeros(n)
    np.maximum.at(largest, result.image_points, np.sqrt(squares.sum(axis=1)))
    own = np.flatnonzero((kinds != "pass") & (counts > 0))
    if not len(own):
        return []
    columns = [
        cells.column("point", text=True),
        cells.column("use", text=True),
        cells.column("photos"),
        cells.column("rms", unit),
        cells.column("largest", unit),
    ]
    rows: list[Row] = [
        [
            result.block.point_ids[row],
            texts(f"use.{kinds[row]}"),
            int(counts[row]),
            cells.number(math.sqrt(float(total[row]) / float(counts[row])), 2),
            cells.number(float(largest[row]), 2),
        ]
        for row in in_order(result.block, own).tolist()
    ]
    return [Table(texts("table.markers"), columns, rows)]


def survey_annex(found: Statement) -> Section:
    """Return annex F: control and check points as they were given."""
    texts, cells, own = found.texts, Written(found.texts), found.survey
    if own.system is None or not own.names:
        return Section("annex-f", texts("annex.f"), [], annex=True)
    decimals = max(3, decimals_for(own.sd))
    unit = found.result.block.linear_unit
    columns = [
        cells.column("point", text=True),
        cells.column("use", text=True),
        *(Column(translation.axis(texts, name), texts.word("unit", of)) for name, of in own.system.axes),
        *cells.columns(("sd",), unit),
    ]
    places = [8 if axis == "deg" else decimals for _, axis in own.system.axes]
    rows: list[Row] = [
        [
            name,
            texts(f"use.{own.kinds[k]}"),
            *_mixed(cells, own.positions[k], places),
            *cells.vector(own.sd[k], decimals),
        ]
        for k, name in enumerate(own.names)
    ]
    note = texts("assume.crs", crs=own.system.crs) if own.system.crs else ""
    return Section("annex-f", texts("annex.f"), [Table(texts("annex.f"), columns, rows, note)], annex=True)


def _mixed(cells: Written, values: Floats, decimals: Sequence[int]) -> list[Cell]:
    return [cells.number(float(value), own) for value, own in zip(values, decimals, strict=True)]


def files_annex(found: Statement) -> Section:
    """Return annex G: what it was made of, so that it can be made again."""
    texts, cells = found.texts, Written(found.texts)
    facts = [Fact(texts("page.program"), f"photogram {_photocore.__version__}")]
    if found.command:
        facts.append(Fact(texts("page.command"), found.command))
    parts: list[Part] = [Facts(texts("page.program"), facts)]
    if found.inputs:
        columns = [
            Column(texts("page.file"), text=True),
            cells.column("size", texts("unit.bytes")),
            Column("SHA-256", text=True),
        ]
        rows: list[Row] = [[each.path.name, each.size, each.sha256] for each in found.inputs]
        parts.append(Table(texts("table.files"), columns, rows))
    return Section("annex-g", texts("annex.g"), parts, annex=True)
