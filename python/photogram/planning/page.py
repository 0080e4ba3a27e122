"""The page of a plan: patterns of a network side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from photogram.planning.networks import Plan
from photogram.planning.pattern import Pattern
from photogram.planning.plot import plan_sketch
from photogram.planning.text import axis_figures, counts, motion_shown, on_the_ground, remarks, what_next
from photogram.show.angles import ARCSEC
from photogram.show.judgement import remarks_section
from photogram.show.methods import page_of
from photogram.show.page import (
    Column,
    Document,
    Drawing,
    Fact,
    Judgement,
    Layers,
    Part,
    Row,
    Section,
    Table,
    significant,
)

NOTICED = 1.05
"""Ratio of standard deviations below which patterns are called alike."""


@page_of.register(Plan)
def plan_page(made: Plan) -> Document:
    """Return the report of a plan for the browser."""
    patterns = made.patterns
    drawn = [_drawing(patterns)] if any(pattern.new_points.any() for pattern in patterns) else []
    sections = [
        Section("network", "Plan of the network", drawn),
        _comparison(patterns),
        Section("size", "How much", [_size(patterns)]),
        _layers("points", "New points", patterns, _points, _POINTS),
        _layers("photos", "Photos", patterns, _photos, ""),
        _layers("motion", "Motion", patterns, _motion, ""),
        _layers("control", "Control", patterns, _control, _CONTROL),
        remarks_section(remarks(patterns)),
    ]
    return Document(
        what="Prediction of a network before it is flown",
        title=patterns[0].block.title,
        judgements=[_judgement(patterns)],
        advice=what_next(patterns),
        highlights=_highlights(patterns),
        sections=sections,
    )


_POINTS = (
    "Standard deviations that the network promises, a priori: nothing has been measured. Detectable is"
    " the smallest error of an image coordinate that the test finds (level 0.001, power 0.80); its effect is"
    " what it moves at most while it stays in."
)
_CONTROL = (
    "How the network checks its control: an error below what is detectable goes into the result unseen."
)


def _drawing(patterns: Sequence[Pattern]) -> Drawing:
    caption = (
        "The patterns in plan, on one scale of colours: the expected standard deviation of points in height."
        " Control points are marked by what they hold."
    )
    title = "Expected standard deviation in height"
    return Drawing("picture-plan", title, caption, partial(plan_sketch, patterns))


def _judgement(patterns: Sequence[Pattern]) -> Judgement:
    """Say which pattern is better, by the rms in height of new points."""
    return Judgement("Prediction", _better(patterns))


def _better(patterns: Sequence[Pattern]) -> str:
    if not all(pattern.new_points.any() for pattern in patterns):
        return "There are no new points to be judged"
    unit = patterns[0].block.linear_unit
    heights = {pattern.name: pattern.points[-1].rms_sd[2] for pattern in patterns}
    best, worst = min(heights, key=heights.__getitem__), max(heights, key=heights.__getitem__)
    if len(patterns) == 1:
        return f"Heights of new points will have an rms of {significant(heights[best], 3)} {unit}"
    if heights[worst] <= NOTICED * heights[best]:
        return f"The patterns are alike: heights with an rms of {significant(heights[best], 3)} {unit}"
    return (
        f"“{best}” gives heights {heights[worst] / heights[best]:.2f} times better than “{worst}”:"
        f" rms {significant(heights[best], 3)} against {significant(heights[worst], 3)} {unit}"
    )


def _highlights(patterns: Sequence[Pattern]) -> list[Fact]:
    unit = patterns[0].block.linear_unit
    found = []
    for pattern in patterns:
        if pattern.new_points.any():
            x, y, z = pattern.points[-1].rms_sd
            plane = f"{pattern.axes[0]} {significant(x, 2)}, {pattern.axes[1]} {significant(y, 2)} {unit}"
            found.append(Fact(f"rms in {pattern.axes[2]}, {pattern.name}", significant(z, 2), unit, plane))
    error = significant(patterns[0].unit, 2)
    return [*found, Fact("An image error on the ground", error, unit, "standard deviation, mean of all")]


def _comparison(patterns: Sequence[Pattern]) -> Section:
    if not all(pattern.new_points.any() for pattern in patterns):
        return Section("comparison", "Side by side", [])
    unit = patterns[0].block.linear_unit
    rows: list[Row] = []
    for kind, axis, values in axis_figures(patterns):
        ratio = max(values) / min(values) if min(values) > 0 else math.nan
        rows.append([f"{'rms' if kind == 'rms' else 'largest'} {axis}", *values, ratio])
    columns = [
        Column("Standard deviation", text=True),
        *(Column(pattern.name, unit, figures=3) for pattern in patterns),
        Column("Largest over smallest", decimals=2),
    ]
    return Section("comparison", "Side by side", [Table("All new points", columns, rows)])


def _size(patterns: Sequence[Pattern]) -> Table:
    unit = patterns[0].block.linear_unit
    of_each = [counts(pattern) for pattern in patterns]
    rows: list[Row] = [[name.capitalize(), *(own[name] for own in of_each)] for name in of_each[0]]
    scale, error = on_the_ground(unit)
    rows.append([scale, *(significant(pattern.scale) for pattern in patterns)])
    rows.append([error, *(significant(pattern.unit, 3) for pattern in patterns)])
    return Table("How much", [Column("", text=True), *(Column(pattern.name) for pattern in patterns)], rows)


def _layers(
    name: str, title: str, patterns: Sequence[Pattern], table: Callable[[Pattern], Table | None], intro: str
) -> Section:
    tables = [made for pattern in patterns if (made := table(pattern)) is not None]
    parts: list[Part] = [Layers(f"{name}-layers", tables)] if len(tables) > 1 else [*tables]
    return Section(name, title, parts, intro)


def _points(pattern: Pattern) -> Table | None:
    shown = [quality for quality in pattern.points if quality.points]
    if not shown:
        return None
    unit = pattern.block.linear_unit
    columns = [
        Column("Group", text=True),
        Column("Points"),
        *(
            Column(f"{kind} {axis}", unit, figures=3)
            for axis in pattern.axes
            for kind in ("rms", "max")
        ),
        Column("Mean redundancy", decimals=3),
        Column("Unchecked", "%", decimals=0),
        Column("Detectable", "µm", decimals=1),
        Column("Effect", "sd", decimals=1),
    ]  # fmt: skip
    rows: list[Row] = []
    for each in shown:
        sd = [value for pair in zip(each.rms_sd, each.max_sd, strict=True) for value in pair]
        tests = [each.redundancy, 100 * each.unchecked, 1000 * each.detectable, each.effect]
        rows.append([each.group, each.points, *sd, *tests])
    return Table(pattern.name, columns, rows)


def _photos(pattern: Pattern) -> Table:
    linear = pattern.block.linear_unit
    rows: list[Row] = []
    for k, quality in enumerate(pattern.photos):
        factor, unit = (1.0, linear) if k < 3 else (1.0 / ARCSEC, "″")
        redundancy = quality.redundancy if math.isfinite(quality.redundancy) else None
        rows.append(
            [f"{quality.unknown}, {unit}", factor * quality.rms_sd, factor * quality.max_sd, redundancy]
        )
    columns = [
        Column("Unknown", text=True),
        Column("rms sd", figures=3),
        Column("Largest sd", figures=3),
        Column("Mean redundancy of given values", decimals=3),
    ]
    return Table(pattern.name, columns, rows)


def _motion(pattern: Pattern) -> Table | None:
    if not pattern.motion:
        return None
    rows: list[Row] = []
    for each in pattern.motion:
        factor, unit = motion_shown(each.unit)
        rows.append([f"{each.unknown}, {unit}", each.rms_sd / factor, each.max_sd / factor])
    for axis, sd in zip(pattern.axes, pattern.known_rms_sd or (), strict=False):
        what = f"{axis} of new points were the readout time known, {pattern.block.linear_unit}"
        rows.append([what, sd, None])
    columns = [Column("Unknown", text=True), Column("rms sd", figures=3), Column("Largest sd", figures=3)]
    return Table(pattern.name, columns, rows)


def _control(pattern: Pattern) -> Table | None:
    held = [quality for quality in pattern.control if quality.held]
    if not held:
        return None
    unit = pattern.block.linear_unit
    columns = [
        Column("Component", text=True),
        Column("Held"),
        Column("sd given", unit, figures=3),
        Column("Mean redundancy", decimals=3),
        Column("Detectable", unit, figures=3),
        Column("Effect", "sd", decimals=1),
    ]
    rows: list[Row] = [
        [each.component, each.held, each.sd, each.redundancy, each.detectable, each.effect] for each in held
    ]
    return Table(pattern.name, columns, rows)
