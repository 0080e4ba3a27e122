"""The annexes of a statement: check points, control left out, budgets, cameras, adjustment, survey, files."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.results.cameras import AdjustedCamera, units
from photogram.results.distortion import distortion_curve
from photogram.results.statement import translation
from photogram.results.statement.budget import Budget, Source, budget_line
from photogram.results.statement.comparison import in_order
from photogram.results.statement.document import kinds_of
from photogram.results.statement.drawings import overlap
from photogram.results.statement.figures import Figures
from photogram.results.statement.leave_one_out import limit_of
from photogram.results.statement.sheets import Written, decimals_for
from photogram.show.judgement import signs_of
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Fact,
    Facts,
    Part,
    Row,
    Section,
    Table,
    decimals_of,
)
from photogram.statistics.evidence import Test

if TYPE_CHECKING:
    from photogram import Statement

SOURCES = 12
"""Sources of a budget at a finer level than kinds that the page lists, those that contribute most."""
RADII = 11
"""Of the table of distortion."""
LISTED = 1000
"""Removed observations that the page lists at most; the table of them as a file lists all."""


def checks_annex(found: Statement) -> Section:
    """Return annex A: every check point."""
    texts, cells, own = found.texts, Written(found.texts), found.compared
    if found.of_all is None:
        return Section("annex-a", texts("annex.a"), [], annex=True)
    tests, unit = found.of_all.points, found.result.block.linear_unit
    decimals, without = decimals_for(tests.sd_adjusted), found.asked.without
    table = Table.of(
        texts("annex.a"),
        range(len(own)),
        [
            (
                cells.column("point", text=True),
                lambda k: Cell(own.names[k], tone="look" if own.names[k] in without else ""),
            ),
            (
                cells.column("cover", text=True),
                lambda k: texts(f"cover.{'vegetated' if own.vegetated[k] else 'open'}"),
            ),
            *cells.along_axes("difference", own.differences, decimals, unit),
            *cells.along_axes("sd", tests.sd_predicted, decimals, unit),
            *cells.along_axes("normalised", tests.normalised, 1),
            cells.numbers("T", tests.T, 1),
            (cells.column("p"), lambda k: cells.p(float(tests.p[k]), tests.limit)),
            (
                cells.column("others"),
                lambda k: cells.looked(float(tests.others[k]), 1, bad=bool(tests.p_others[k] < tests.limit)),
            ),
            (Column("CE90", unit), lambda k: cells.number(float(tests.ce90[k]), decimals)),
            (Column("LE90", unit), lambda k: cells.number(float(tests.le90[k]), decimals)),
        ],
    )
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
    texts, cells, own = found.texts, Written(found.texts), found.left_out
    if not own:
        return Section("annex-b", texts("annex.b"), [], annex=True)
    unit, sd = found.result.block.linear_unit, np.array([each.sd for each in own])
    decimals, limit = decimals_for(sd), limit_of(own)
    table = Table.of(
        texts("annex.b"),
        range(len(own)),
        [
            (cells.column("point", text=True), lambda k: own[k].point),
            *cells.along_axes("difference", np.array([each.difference for each in own]), decimals, unit),
            *cells.along_axes("sd", sd, decimals, unit),
            cells.numbers("T", [each.T for each in own], 1),
            (cells.column("p"), lambda k: cells.p(own[k].p, limit)),
        ],
    )
    return Section("annex-b", texts("annex.b"), [table], texts("annex.b.note"), annex=True)


def budgets_annex(found: Statement) -> Section:
    """Return annex C: what every source of error contributes."""
    texts = found.texts
    held = translation.held(texts, found.result) or texts("annex.c.nothing")
    parts = [part for each in found.taken_apart for part in _budget(found, each)]
    return Section("annex-c", texts("annex.c"), parts, texts("annex.c.note", held=held), annex=True)


def _budget(found: Statement, own: Budget) -> list[Table]:
    texts, cells = found.texts, Written(found.texts)
    single = Table.of(
        texts("table.single", quantity=own.subject),
        own.largest,
        [
            (
                cells.column("observation", text=True),
                lambda each: translation.observation(texts, each.observation),
            ),
            (cells.column("sd"), lambda each: cells.figures(each.sd)),
            (cells.column("sensitivity"), lambda each: cells.figures(each.sensitivity)),
            (cells.column("u", own.unit), lambda each: cells.figures(math.sqrt(each.contribution), 2)),
            (cells.column("share", "%"), lambda each: cells.number(100 * each.share, 1)),
        ],
    )
    return [_sources(found, own), single]


def _sources(found: Statement, own: Budget) -> Table:
    """Return kinds of observations, and of finer sources those that contribute most."""
    texts, cells = found.texts, Written(found.texts)
    finer = [each for level in ("strip", "camera", "point", "parameter") for each in own.at(level)]
    if len(own.at("camera")) < 2:
        finer = [each for each in finer if each.level != "camera"]
    finer = sorted(finer, key=lambda one: -one.contribution)[:SOURCES]
    estimated = own.freedom.of_kind if own.freedom.basis == "components" else {}

    def named(each: Source) -> str:
        if each.level == "kind":
            return translation.kind(texts, each.name)
        return f"– {texts(f'level.{each.level}', name=each.subject)}"

    def freedom(each: Source) -> float:
        return estimated.get(each.name, math.inf)

    return Table.of(
        budget_line(texts, own),
        [*own.at("kind"), *finer],
        [
            (cells.column("source", text=True), named),
            (cells.column("number"), lambda each: each.number),
            (cells.column("u", own.unit), lambda each: cells.figures(each.u, 2)),
            (cells.column("share", "%"), lambda each: cells.number(100 * each.share, 1)),
            (
                cells.column("dof"),
                lambda each: texts.number(freedom(each), 1) if each.level == "kind" else None,
            ),
            (
                cells.column("from", text=True),
                lambda each: (
                    ""
                    if each.level != "kind"
                    else texts("from.estimated" if math.isfinite(freedom(each)) else "from.given")
                ),
            ),
        ],
    )


def camera_annex(found: Statement) -> Section:
    """Return annex D: values, standard deviations and correlations of cameras, distortion with its band."""
    parts = [part for each in found.result.cameras for part in _camera(found, each)]
    return Section("annex-d", found.texts("annex.d"), parts, annex=True)


def _camera(found: Statement, camera: AdjustedCamera) -> list[Table]:
    texts, cells = found.texts, Written(found.texts)
    of, sd, estimated = units(camera.camera), camera.sd.tolist(), camera.estimated
    table = Table.of(
        texts("table.camera", camera=camera.name),
        range(len(of)),
        [
            (cells.column("parameter", text=True), lambda k: camera.names[k]),
            (Column("", text=True), lambda k: of[k]),
            (
                cells.column("value"),
                lambda k: cells.number(float(camera.values[k]), decimals_of(np.array([sd[k]]), unknown=6)),
            ),
            (cells.column("sd"), lambda k: cells.figures(sd[k], 2)),
            (
                cells.column("from", text=True),
                lambda k: texts("from.estimated" if k in estimated else "from.given"),
            ),
        ],
    )
    names = [camera.names[k] for k in estimated]
    if len(names) < 2:
        return [table, *_distortion(found, camera)]
    matrix = camera.correlations[np.ix_(estimated, estimated)].tolist()
    rows: list[list[Any]] = [
        [name, *(cells.number(value, 2) for value in row)] for name, row in zip(names, matrix, strict=True)
    ]
    heads = [cells.column("parameter", text=True), *map(Column, names)]
    correlations = Table(texts("table.correlations", camera=camera.name), heads, rows)
    return [table, correlations, *_distortion(found, camera)]


def _distortion(found: Statement, camera: AdjustedCamera) -> list[Table]:
    texts, cells = found.texts, Written(found.texts)
    curve = distortion_curve(found.result, camera)
    if curve is None:
        return []
    unit = found.result.block.image_unit
    inside = np.flatnonzero(curve.radii <= curve.observed)
    rows = inside[np.unique(np.linspace(0, len(inside) - 1, RADII).round().astype(int))]
    decimals = decimals_for(curve.sd[rows])
    columns = [
        (cells.column("radius", unit), lambda k: cells.figures(float(curve.radii[k]))),
        cells.numbers("correction", curve.values, decimals, unit),
        cells.numbers("sd", curve.sd, decimals, unit),
    ]
    return [Table.of(texts("table.distortion", camera=camera.name), rows.tolist(), columns)]


def adjustment_annex(found: Statement) -> Section:
    """Return annex E: what was adjusted, how well it fits, what was taken out, residuals of markers."""
    texts, cells, result = found.texts, Written(found.texts), found.result
    kinds = Table.of(
        texts("table.kinds"),
        [(name, *numbers) for name, numbers in kinds_of(result).items()],
        [
            (cells.column("kind", text=True), lambda each: translation.kind(texts, each[0])),
            (cells.column("number"), lambda each: each[1]),
            (cells.column("redundancy"), lambda each: cells.number(each[2], 1)),
            (cells.column("squares"), lambda each: cells.number(each[3], 1)),
        ],
    )
    parts: list[Part] = [kinds]
    if result.verdict.tests:
        parts.append(_tests(found))
    if found.removed:
        parts.append(_removed(found))
    parts += [*_markers(found), _overlap(found)]
    intro = texts.text(result.verdict.message)
    return Section("annex-e", texts("annex.e"), parts, intro, annex=True)


def _removed(found: Statement) -> Table:
    """Return the removed observations, on the page at most :data:`LISTED` of them."""
    texts, cells, count = found.texts, Written(found.texts), len(found.removed)
    return Table.of(
        texts("table.removed"),
        found.removed[:LISTED],
        [
            (cells.column("observation", text=True), lambda each: texts.text(each.subject)),
            (cells.column("reason", text=True), lambda each: texts(f"removed.{each.reason}")),
        ],
        texts("table.removed.note", shown=LISTED, all=count) if count > LISTED else "",
    )


def _tests(found: Statement) -> Table:
    """Return all tests of the verdict on the adjustment."""
    texts, cells = found.texts, Written(found.texts)
    return Table.of(
        texts("table.tests"),
        found.result.verdict.tests,
        [
            (cells.column("test", text=True), lambda each: _test(found, each)),
            (cells.column("statistic", text=True), lambda each: signs_of(each.statistic)),
            (cells.column("value"), lambda each: cells.figures(each.value, 4)),
            (cells.column("low"), lambda each: cells.figures(each.limits[0], 4)),
            (cells.column("high"), lambda each: cells.figures(each.limits[1], 4)),
            (cells.column("p"), lambda each: cells.p(each.p, each.level)),
            (cells.column("level"), lambda each: cells.figures(each.level, 2)),
            (cells.column("tests"), lambda each: each.tests),
            (
                cells.column("outcome", text=True),
                lambda each: (
                    Cell(texts("test.passes")) if each.accepted else Cell(texts("test.rejects"), tone="look")
                ),
            ),
        ],
        texts("table.tests.note"),
    )


def _test(found: Statement, test: Test) -> str:
    kind, subject = (found.texts.text(each) for each in (test.kind, test.subject))
    return f"{kind[:1].upper()}{kind[1:]}{f': {subject}' if subject else ''}"


def _overlap(found: Statement) -> Drawing:
    texts, unit = found.texts, found.result.block.linear_unit
    labels = {name: texts(f"column.{name}") for name in ("east", "north", "photos")}
    labels |= {"unit": unit, "decimal": texts("number.decimal")}
    sketch = partial(overlap, found.result, labels)
    return Drawing("map-overlap", texts("page.overlap"), texts("page.overlap.caption"), sketch)


def _markers(found: Statement) -> list[Table]:
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
    table = Table.of(
        texts("table.markers"),
        in_order(result.block, own).tolist(),
        [
            (cells.column("point", text=True), lambda row: result.block.point_ids[row]),
            (cells.column("use", text=True), lambda row: texts(f"use.{kinds[row]}")),
            (cells.column("photos"), lambda row: int(counts[row])),
            cells.numbers("rms", np.sqrt(total / np.maximum(counts, 1)), 2, unit),
            cells.numbers("largest", largest, 2, unit),
        ],
    )
    return [table]


def survey_annex(found: Statement) -> Section:
    """Return annex F: control and check points as they were given."""
    texts, cells, own = found.texts, Written(found.texts), found.survey
    if own.system is None or not own.names:
        return Section("annex-f", texts("annex.f"), [], annex=True)
    decimals = max(3, decimals_for(own.sd))
    table = Table.of(
        texts("annex.f"),
        range(len(own.names)),
        [
            (cells.column("point", text=True), lambda k: own.names[k]),
            (cells.column("use", text=True), lambda k: texts(f"use.{own.kinds[k]}")),
            *(
                (
                    Column(translation.axis(texts, name), texts.word("unit", unit)),
                    lambda k, of=column, count=8 if unit == "deg" else decimals: cells.number(
                        float(of[k]), count
                    ),
                )
                for (name, unit), column in zip(own.system.axes, own.positions.T, strict=True)
            ),
            *cells.along_axes("sd", own.sd, decimals, found.result.block.linear_unit),
        ],
        texts("assume.crs", crs=own.system.crs) if own.system.crs else "",
    )
    return Section("annex-f", texts("annex.f"), [table], annex=True)


def files_annex(found: Statement) -> Section:
    """Return annex G: what it was made of, so that it can be made again."""
    texts, cells = found.texts, Written(found.texts)
    facts = [Fact(texts("page.program"), f"photogram {_photocore.__version__}")]
    if found.command:
        facts.append(Fact(texts("page.command"), found.command))
    parts: list[Part] = [Facts(texts("page.program"), facts)]
    if found.inputs:
        files = Table.of(
            texts("table.files"),
            found.inputs,
            [
                (Column(texts("page.file"), text=True), lambda each: each.path.name),
                (cells.column("size", texts("unit.bytes")), lambda each: each.size),
                (Column("SHA-256", text=True), lambda each: each.sha256),
            ],
        )
        parts.append(files)
    return Section("annex-g", texts("annex.g"), parts, annex=True)
