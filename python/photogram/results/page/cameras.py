"""Cameras: adjusted parameters, their correlations, distortion."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.results.calibration import Calibration, ParameterTest, calibrations
from photogram.results.calibration_report import outcome
from photogram.results.result import Result
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Fact,
    Facts,
    Layers,
    Part,
    Remarks,
    Row,
    Section,
    Table,
    decimals_of,
    fixed,
)

__all__ = ["cameras_section"]

LISTED = 12
"""Cameras with a table of their own."""


def cameras_section(result: Result, drawings: Sequence[Drawing]) -> Section:
    """Return adjusted cameras with their tests, correlations and distortion, and those that are held."""
    found = calibrations(result)
    tables = [_parameters(result, each) for each in found[:LISTED]]
    parts: list[Part] = [Layers("camera-layers", tables)] if len(tables) > 1 else [*tables]
    groups = [row for each in found[:LISTED] for row in _groups(each)]
    if groups:
        columns = (
            Column("Camera", text=True),
            Column("Terms together", text=True),
            Column("F", decimals=2),
            Column("p", figures=2),
            Column("Outcome", text=True),
        )
        parts.append(Table("Terms of the lens tested together", columns, groups))
    parts += drawings
    remarks = [
        f"{each.camera.name}: {sentence}"
        for each in found[:LISTED]
        for sentence in (*_pairs(each), *each.remarks())
    ]
    if remarks:
        parts.append(Remarks(remarks))
    if held := _held(result):
        parts.append(held)
    if len(found) > LISTED:
        parts.append(
            Facts(
                "More cameras",
                [Fact("Not shown here", f"{len(found) - LISTED}", note="the table of cameras has all")],
            )
        )
    intro = (
        "The interior orientation: what was given, what was found, and what the images say about it."
        if found
        else ""
    )
    return Section("cameras", "Cameras", parts, intro)


def _parameters(result: Result, found: Calibration) -> Table:
    law = "Student" if result.unit_variance != "unity" and result.variance_of_unit_weight else "normal"
    columns = (
        Column("Parameter", text=True),
        Column("Given"),
        Column("sd given", figures=3),
        Column("Adjusted"),
        Column("sd adjusted", figures=3),
        Column("Change"),
        Column("t", law, decimals=2),
        Column("p", decimals=4),
        Column("R", "with all others", decimals=4),
        Column("Outcome", text=True),
    )
    rows = [_parameter(each) for each in found.parameters]
    camera = found.camera
    note = (
        f"{camera.camera.model}, {camera.camera.direction}; {camera.photos} photos, {camera.images} images."
        " t tests terms of the lens against zero, the others against the given value; R is the multiple"
        " correlation with all other unknowns: near 1 nothing tells the parameter from them."
    )
    return Table(camera.name, columns, rows, note)


def _parameter(each: ParameterTest) -> Row:
    decimals = min(decimals_of(np.array([each.sd])) + 1, 15)

    def written(value: float) -> Cell:
        return Cell(fixed(value, decimals) if math.isfinite(value) else value, sorts=value)

    return [
        f"{each.name}, {each.unit}" if each.unit else each.name,
        written(each.given),
        "free" if math.isinf(each.given_sd) else each.given_sd,
        written(each.value),
        each.sd,
        written(each.change),
        each.test_value,
        each.probability,
        each.multiple_correlation,
        Cell(outcome(each), tone="look" if not each.separable or each.contradicts else ""),
    ]


def _groups(found: Calibration) -> list[Row]:
    return [
        [
            found.camera.name,
            ", ".join(each.names),
            each.test_value,
            each.probability,
            "significant" if each.significant else "not significant",
        ]
        for each in found.groups
    ]


def _pairs(found: Calibration) -> list[str]:
    """Name what is correlated by more than 0.95."""
    pairs = [
        f"{each.first} and {each.second} are correlated by {each.coefficient:.4f}"
        for each in found.correlations
    ]
    poses = [
        f"{each.parameter} and {each.component} of {len(each.photos)} photos are correlated by"
        f" {each.coefficient:.4f}"
        for each in found.poses
    ]
    return [*pairs, *poses]


def _held(result: Result) -> Facts | None:
    held = [each for each in result.cameras if each.given.is_held]
    if not held:
        return None
    facts = [
        Fact(
            f"{each.name}: {each.camera.model}",
            ", ".join(f"{name} {value:.8g}" for name, value in each.camera.parameters.items() if value != 0),
            each.camera.unit or "",
            f"{each.photos} photos, {each.images} images",
        )
        for each in held[:LISTED]
    ]
    if len(held) > LISTED:
        facts.append(Fact("Not shown here", f"{len(held) - LISTED}", note="the table of cameras has all"))
    return Facts("Cameras that are held", facts)
