"""The page of an adjusted block."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from photogram.results.axes import point_axes
from photogram.results.calibration import Calibration, GroupTest, ParameterTest, calibrations
from photogram.results.calibration_report import law_of, outcome, values_written
from photogram.results.courses import POSES, courses_table, notable, notable_courses
from photogram.results.features import Features
from photogram.results.features_report import expansion, through, written
from photogram.results.film_report import film_table, form_table, mark_table, scanner_table
from photogram.results.page.network import drawings, network_page, size_section
from photogram.results.page.tables import beside_section, check_section, control_section, stations_section
from photogram.results.report import rms_of, size_of
from photogram.results.result import Result
from photogram.results.tables import redundancy_by_kind, unknowns
from photogram.show.cells import page_table, unit_written
from photogram.show.methods import page_of
from photogram.show.page import (
    Cell,
    Column,
    Document,
    Drawing,
    Fact,
    Facts,
    Layers,
    Part,
    Remarks,
    Row,
    Section,
    Table,
    Text,
    decimals_of,
    fixed,
    significant,
)


@page_of.register(Result)
@np.errstate(over="ignore", invalid="ignore")
def block_page(result: Result) -> Document:
    """Return the report of an adjusted block for the browser."""
    pictures = drawings(result)
    given = [
        control_section(result),
        check_section(result),
        beside_section(result),
        stations_section(result),
        _cameras_section(result, [pictures[name] for name in ("correlations", "distortion")]),
        _films_section(result, pictures["films"]),
        _unknowns_section(result),
    ]
    return network_page(
        result,
        "Adjustment of a block of photos",
        _size_section(result),
        given,
        photos=len(result.block.photo_ids),
        title=result.block.title,
        more=_accuracy(result),
        redundancy=_redundancy_tables(result),
        beside=[_features_section(result.features, pictures["features"])],
        datum=_datum(result),
        poses=POSES if result.block.timed else "",
    )


def _accuracy(result: Result) -> list[Fact]:
    """Return what check points say, and standard deviations of points."""
    axes, found = point_axes(result.block), list[Fact]()
    factors = np.array([axis.factor for axis in axes])
    check = result.used_points & (result.point_kinds == "check")
    if check.any():
        columns = (result.point_differences[check] * factors).T
        worst = zip(axes, (rms_of(column[np.isfinite(column)]) for column in columns), strict=True)
        note = ", ".join(f"{axis.name} {significant(each, 2)}" for axis, each in worst if math.isfinite(each))
        unit = "" if result.geographic else f" {axes[2].small}"
        found.append(Fact("Check points", f"{np.count_nonzero(check)}", note=f"rms {note}{unit}"))
    height = result.point_sd[result.used_points]
    known = height[np.isfinite(height).all(axis=1)] * factors
    if len(known):
        x, y, z = (significant(float(each), 2) for each in np.median(known, axis=0))
        units = [unit_written(axis.small) for axis in axes]
        note = f"{axes[0].name} {x} {units[0]}, {axes[1].name} {y} {units[1]}"
        found.append(Fact(f"sd of points in {axes[2].name}, median", z, units[2], note))
    return found


def _size_section(result: Result) -> Section:
    variance, more = result.variance_of_unit_weight, list[Fact]()
    if result.dropped:
        more.append(Fact("Points left out", f"{len(result.dropped)}", note=_reasons(result)))
    value = f"{variance:.6f}" if variance is not None else "undefined"
    good = [Fact("Variance of unit weight", value, note=_BASIS[result.unit_variance])]
    return size_section(result, size_of(result), more, good)


_BASIS = {
    "free": "rule of 1987: the weights of photos and cameras do not count",
    "constrained": "of all weighted values, those of photos and cameras among them",
    "unity": "set to 1",
    "redundancy": "based on redundancy numbers",
}


def _reasons(result: Result) -> str:
    counts = Counter(result.dropped.values())
    return ", ".join(f"{count}: {reason}" for reason, count in counts.items())


def _redundancy_tables(result: Result) -> list[Table]:
    note = (
        "The factor is the root of sum over redundancy: what standard deviations of the kind would have to be"
        " multiplied by to agree, if the others are right."
    )
    table = page_table("Redundancy by kind of observation", redundancy_by_kind(result), note)
    return [table] if table.rows else []


def _unknowns_section(result: Result) -> Section:
    if not result.unknowns:
        return Section("unknowns", "Common unknowns", [])
    intro = (
        "Lever arms, boresights, sensors, levels, planes and lines that several observations have in common;"
        " clocks, readout times and coefficients of trajectories."
    )
    (shown, note), (every, said) = notable(result.unknowns), notable_courses(result)
    tables = [page_table("Common unknowns", unknowns(shown), _sentence(note))] if shown else []
    if every:
        said = said or "The largest correction in the span of the table, and its time."
        tables.append(
            page_table("Trajectories", courses_table(every, result.block.linear_unit), _sentence(said))
        )
    return Section("unknowns", "Common unknowns", tables, intro)


def _sentence(said: str) -> str:
    return f"{said[:1].upper()}{said[1:].removesuffix('.')}." if said else ""


def _datum(result: Result) -> str:
    if result.datum.is_chosen:
        return f"Datum: {result.datum}."
    return f"Coordinates and standard deviations refer to the datum that is {result.datum}."


LISTED = 12
"""Cameras with a table of their own."""


def _cameras_section(result: Result, drawings: Sequence[Drawing]) -> Section:
    """Return adjusted cameras with their tests, correlations and distortion, and those that are held."""
    found = calibrations(result)
    shown, note = found[:LISTED], "the table of cameras has all"
    tables = [_parameters(each, law_of(result)) for each in shown]
    parts: list[Part] = [Layers("camera-layers", tables)] if len(tables) > 1 else [*tables]
    if groups := [(each.camera.name, group) for each in shown for group in each.groups]:
        parts.append(_terms_together(groups))
    parts += drawings
    if remarks := [
        f"{each.camera.name}: {sentence}" for each in shown for sentence in (*_pairs(each), *each.remarks())
    ]:
        parts.append(Remarks(remarks))
    held = [each for each in result.cameras if each.given.is_held]
    facts = [
        Fact(
            f"{each.name}: {each.camera.model}",
            values_written(each.camera),
            each.camera.unit or "",
            f"{each.photos} photos, {each.images} images",
        )
        for each in held[:LISTED]
    ]
    if len(held) > LISTED:
        facts.append(Fact("Not shown here", f"{len(held) - LISTED}", note=note))
    if facts:
        parts.append(Facts("Cameras that are held", facts))
    if len(found) > LISTED:
        parts.append(Facts("More cameras", [Fact("Not shown here", f"{len(found) - LISTED}", note=note)]))
    intro = "The interior orientation: what was given, what was found, and what the images say about it."
    return Section("cameras", "Cameras", parts, intro if found else "")


def _parameters(found: Calibration, law: str) -> Table:
    def written(each: ParameterTest, value: float) -> Cell:
        decimals = min(decimals_of(np.array([each.sd])) + 1, 15)
        return Cell(fixed(value, decimals) if math.isfinite(value) else value, sorts=value)

    camera = found.camera
    return Table.of(
        camera.name,
        found.parameters,
        [
            (Column("Parameter", text=True), lambda each: f"{each.name}, {each.unit}".removesuffix(", ")),
            (Column("Given"), lambda each: written(each, each.given)),
            (
                Column("sd given", figures=3),
                lambda each: "free" if math.isinf(each.given_sd) else each.given_sd,
            ),
            (Column("Adjusted"), lambda each: written(each, each.value)),
            (Column("sd adjusted", figures=3), lambda each: each.sd),
            (Column("Change"), lambda each: written(each, each.change)),
            (Column("t", law, decimals=2), lambda each: each.test_value),
            (Column("p", figures=2), lambda each: each.probability),
            (Column("R", "with all others", decimals=4), lambda each: each.multiple_correlation),
            (
                Column("Outcome", text=True),
                lambda each: Cell(
                    outcome(each), tone="look" if not each.separable or each.contradicts else ""
                ),
            ),
        ],
        f"{camera.camera.model}, {camera.camera.direction}; {camera.photos} photos, {camera.images} images."
        " t tests terms of the lens against zero, the others against the given value; R is the multiple"
        " correlation with all other unknowns: near 1 nothing tells the parameter from them.",
    )


def _terms_together(groups: Sequence[tuple[str, GroupTest]]) -> Table:
    return Table.of(
        "Terms of the lens tested together",
        groups,
        [
            (Column("Camera", text=True), lambda each: each[0]),
            (Column("Terms together", text=True), lambda each: ", ".join(each[1].names)),
            (Column("F", decimals=2), lambda each: each[1].test_value),
            (Column("p", figures=2), lambda each: each[1].probability),
            (Column("Outcome", text=True), lambda each: each[1].outcome),
        ],
    )


def _pairs(found: Calibration) -> list[str]:
    """Name what is correlated by more than 0.95."""
    alike = [(f"{each.first} and {each.second}", each.coefficient) for each in found.correlations]
    alike += [
        (f"{each.parameter} and {each.component} of {len(each.photos)} photos", each.coefficient)
        for each in found.poses
    ]
    return [f"{both} are correlated by {coefficient:.4f}" for both, coefficient in alike]


def _features_section(features: Features | None, picture: Drawing) -> Section:
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
                (Column("What", text=True), through),
                (Column("T", figures=4), lambda each: each.statistic),
                (Column("of", decimals=0), lambda each: each.freedom),
                (Column("p", figures=2), lambda each: each.probability),
                (Column("Form", text=True), lambda each: each.form),
            ],
        )
        parts += [forms, picture]
    parts += [Text(each) for each in features.remarks]
    intro = (
        "Least-squares features through adjusted points, with what follows from the joint covariance of the"
        " points. T compares the deviations of the points from the feature with their standard deviations."
    )
    return Section("features", "Features", parts, intro)


def _films_section(result: Result, drawing: Drawing) -> Section:
    """Return the section of films, with the picture of marks and patterns; empty without films."""
    if not result.films:
        return Section("films", "Film and fiducials", [])
    intro = (
        "Where films lay and how their size has changed, the form of six numbers that other programs have,"
        " and marks of cameras: what a certificate was moved by, and what their readings leave."
    )
    form = (
        "reading = a0 + a1 x + a2 y, x and y in the frame of the marks (mm); the scanner is errorless in"
        " standard deviations."
    )
    scales = (
        "Scales are mm of the film in a mm of the camera; between axes is the angle between their images less"
        " 90 degrees."
    )
    photos, *rest = form_table(result)
    numbers, said = rest[:2], rest[2:]
    lost = "Lost are marks that were read on other photos. T is that of both coordinates of a reading."
    marks = "Mean residuals are in the frame of the camera, of all photos."
    parts: list[Part] = [
        page_table("Films", film_table(result), lost),
        page_table("The same as six numbers", [photos, *numbers], form),
        page_table("Scales, angle between the axes, rotation", [photos, *said], scales),
        drawing,
        page_table("Fiducial marks", mark_table(result), marks),
        page_table("Scanners", scanner_table(result)),
    ]
    return Section("films", "Film and fiducials", parts, intro)
