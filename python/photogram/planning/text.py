"""A plan as text: patterns in columns, groups of points in rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import compress
from textwrap import wrap
from typing import TYPE_CHECKING

from photogram.planning.statistics import PointQuality
from photogram.show.angles import ARCSEC
from photogram.show.sections import composed, headline

if TYPE_CHECKING:
    from photogram.planning.pattern import Pattern

_NOTICED = 1.005
"""Ratio of standard deviations that two decimals show."""
_MUCH = 1.1
"""Times that points would be better for it to be told."""
_HEAD = 3
"""Lines of a block before its first row: its name, headings, units."""
_WIDEST = 108
"""Characters of a sentence in a line."""
_LABEL, _GAP = 11, "    "

# A column: its heading, its unit, and the text of its cell.
Column = tuple[str, str, Callable[[PointQuality], str]]


def report(patterns: Sequence[Pattern]) -> str:
    """Return the tables of a plan."""
    unit = patterns[0].block.linear_unit
    sections = [
        ("What to do next", [line for each in what_next(patterns) for line in wrap(each, _WIDEST)]),
        ("Network", _network(patterns)),
        (f"New points: expected standard deviations, {unit}", _standard_deviations(patterns, unit)),
        ("New points: the same, divided by the sd of image coordinates on the ground", _multiples(patterns)),
        ("Image coordinates of new points: reliability", _reliability(patterns)),
        ("Photos: expected standard deviations", _photos(patterns)),
        ("Motion: expected standard deviations", _motion(patterns)),
        ("New points: expected standard deviations were the readout time known", _known(patterns)),
        ("Control: reliability", _control(patterns)),
        ("Comparison: expected standard deviations of all new points", _comparison(patterns)),
    ]
    return composed(headline("plan", patterns[0].block.title), sections)


def _network(patterns: Sequence[Pattern]) -> list[str]:
    linear = patterns[0].block.linear_unit
    decimals = _decimals(patterns)
    blocks = []
    for pattern in patterns:
        lengths = (_fixed(pattern.scale, decimals), _fixed(pattern.unit, decimals))
        blocks.append([pattern.name, *map(str, counts(pattern).values()), *lengths])
    labels = ["", *counts(patterns[0]), *on_the_ground(linear)]
    return [*_labelled(labels, [_column(block) for block in blocks]), *remarks(patterns)]


def counts(pattern: Pattern) -> dict[str, int]:
    """Return how much of everything a pattern has, by names."""
    return {
        "photos": len(pattern.block.photo_ids),
        "new points": int(pattern.new_points.sum()),
        "control points": int((pattern.result.used_points & ~pattern.new_points).sum()),
        "points left out": len(pattern.result.dropped),
        "image points": int(pattern.result.used_images.sum()),
    }


def on_the_ground(linear: str) -> tuple[str, str]:
    """Return what the scale and the unit of a pattern are called, in a linear unit."""
    return f"1 mm in the photo on the ground, {linear}", f"sd of image coordinates on the ground, {linear}"


def axis_figures(patterns: Sequence[Pattern]) -> Iterator[tuple[str, str, list[float]]]:
    """Yield kind (rms, max), axis and expected standard deviations of all new points in each pattern."""
    every = [pattern.points[-1] for pattern in patterns]
    for k, axis in enumerate(patterns[0].axes):
        yield "rms", axis, [quality.rms_sd[k] for quality in every]
        yield "max", axis, [quality.max_sd[k] for quality in every]


def what_next(patterns: Sequence[Pattern]) -> list[str]:
    """Return what to do next: what would make the network check itself."""
    found = []
    for pattern in patterns:
        unchecked = pattern.points[-1].unchecked
        if pattern.new_points.any() and unchecked > 0.01:
            found.append(
                f"“{pattern.name}”: gross errors of {100 * unchecked:.0f} percent of the image"
                " coordinates could not be"
                " found. More rays a point (more overlap) make them checked."
            )
        weak = [quality for quality in pattern.control if quality.held and quality.redundancy < 0.2]
        if weak:
            named = ", ".join(quality.component for quality in weak)
            found.append(
                f"“{pattern.name}”: control in {named} is hardly checked by the network; more of it, or"
                " check points"
                " beside it, would show its errors."
            )
        readout = [each for each in pattern.motion if each.unit == "s"]
        times = _times_better(pattern)
        if readout and max(times) > _MUCH:
            found.append(
                f"“{pattern.name}”: the readout time is left open by {1e3 * readout[0].rms_sd:.2g} ms, and"
                f" points would be up to {max(times):.1f} times better were it known: give what is known of"
                " it, or fly strips across, faster or at another height."
            )
    return found


def _times_better(pattern: Pattern) -> list[float]:
    """Return by how many times new points would be better in each axis, were the readout time known."""
    known = pattern.known_rms_sd
    if known is None:
        return [1.0]
    return [sd / own for sd, own in zip(pattern.points[-1].rms_sd, known, strict=True)]


def remarks(patterns: Sequence[Pattern]) -> list[str]:
    """List each remark once, with the patterns that it is about unless it is about all."""
    about: dict[str, list[str]] = {}
    for pattern in patterns:
        for message in pattern.result.messages:
            about.setdefault(str(message), []).append(pattern.name)
    return [
        text if len(names) == len(patterns) else f"{'; '.join(names)}: {text}"
        for text, names in about.items()
    ]


def _standard_deviations(patterns: Sequence[Pattern], linear: str) -> list[str]:
    decimals = _decimals(patterns)
    return _side_by_side(
        patterns, lambda pattern: _sd_columns(pattern, linear, lambda sd: _fixed(sd, decimals))
    )


def _multiples(patterns: Sequence[Pattern]) -> list[str]:
    def columns(pattern: Pattern) -> list[Column]:
        return _sd_columns(pattern, "", lambda sd: _fixed(sd / pattern.unit, 2))

    return _side_by_side(patterns, columns)


def _sd_columns(pattern: Pattern, linear: str, text: Callable[[float], str]) -> list[Column]:
    def column(kind: str, axis: int) -> Column:
        def cell(quality: PointQuality) -> str:
            return text((quality.rms_sd if kind == "rms" else quality.max_sd)[axis])

        return f"{kind} {pattern.axes[axis]}", linear, cell

    points: Column = ("points", "", lambda quality: f"{quality.points}")
    return [points, *(column(kind, axis) for axis in range(3) for kind in ("rms", "max"))]


def _reliability(patterns: Sequence[Pattern]) -> list[str]:
    columns: list[Column] = [
        ("redundancy", "mean", lambda quality: _fixed(quality.redundancy, 3)),
        ("unchecked", "%", lambda quality: _fixed(100 * quality.unchecked, 0)),
        ("detectable", "um", lambda quality: _fixed(1000 * quality.detectable, 1)),
        ("effect", "sd", lambda quality: _fixed(quality.effect, 1)),
    ]
    return _side_by_side(patterns, lambda _: columns)


def _side_by_side(patterns: Sequence[Pattern], columns: Callable[[Pattern], list[Column]]) -> list[str]:
    """Lay out groups of points in rows, the same columns for each pattern; nothing without new points."""
    if not any(pattern.new_points.any() for pattern in patterns):
        return []

    def lines(pattern: Pattern) -> list[str]:
        own = columns(pattern)
        rows = [[name for name, _, _ in own], [unit for _, unit, _ in own]]
        rows += [[cell(each) if each.points else "-" for _, _, cell in own] for each in pattern.points]
        return _aligned(pattern.name, rows)

    groups = zip(*(pattern.points for pattern in patterns), strict=True)
    shown = [True] * _HEAD + [any(each.points for each in group) for group in groups]
    labels = [*[""] * _HEAD, *(each.group for each in patterns[0].points)]
    blocks = [list(compress(lines(pattern), shown)) for pattern in patterns]
    return _labelled(list(compress(labels, shown)), blocks)


def _in_blocks(
    patterns: Sequence[Pattern], labels: list[str], rows: Callable[[Pattern], list[list[str]]]
) -> list[str]:
    """Lay out rows of each pattern beside its labels, the heads of which are empty."""
    return _labelled(labels, [_aligned(pattern.name, rows(pattern)) for pattern in patterns])


def _photos(patterns: Sequence[Pattern]) -> list[str]:
    decimals = _decimals(patterns)
    linear = patterns[0].block.linear_unit
    weighted = any(math.isfinite(quality.redundancy) for p in patterns for quality in p.photos)

    def rows(pattern: Pattern) -> list[list[str]]:
        found = [["rms", "max", "redundancy"]]
        for k, quality in enumerate(pattern.photos):
            factor, digits = (1.0, decimals) if k < 3 else (1.0 / ARCSEC, 2)
            sd = [_fixed(factor * sd, digits) for sd in (quality.rms_sd, quality.max_sd)]
            found.append([*sd, _fixed(quality.redundancy, 3)])
        return found if weighted else [row[:2] for row in found]

    names = [f"{q.unknown}, {linear if k < 3 else 'arcsec'}" for k, q in enumerate(patterns[0].photos)]
    return _in_blocks(patterns, ["", "", *names], rows)


def motion_shown(unit: str) -> tuple[float, str]:
    """Return by what a motion in a unit is divided to be shown, and the unit that it is shown in."""
    return {"s": (1e-3, "ms"), "rad/s": (1e-3, "mrad/s"), "rad": (ARCSEC, "arcsec")}.get(unit, (1.0, unit))


def _motion(patterns: Sequence[Pattern]) -> list[str]:
    units = {each.unknown: each.unit for pattern in patterns for each in pattern.motion}
    if not units:
        return []

    def rows(pattern: Pattern) -> list[list[str]]:
        own = {each.unknown: (each.rms_sd, each.max_sd) for each in pattern.motion}
        values = [own.get(name, (math.nan, math.nan)) for name in units]
        factors = [motion_shown(unit)[0] for unit in units.values()]
        figures = zip(values, factors, strict=True)
        return [["rms", "max"], *([_fixed(sd / factor, 3) for sd in pair] for pair, factor in figures)]

    names = [f"{name}, {motion_shown(unit)[1]}" for name, unit in units.items()]
    return _in_blocks(patterns, ["", "", *names], rows)


def _known(patterns: Sequence[Pattern]) -> list[str]:
    """Say what points would be, were the readout time known."""
    if all(pattern.known_rms_sd is None for pattern in patterns):
        return []
    decimals = _decimals(patterns)

    def rows(pattern: Pattern) -> list[list[str]]:
        known = pattern.known_rms_sd or (math.nan,) * 3
        pairs = zip(known, _times_better(pattern) if pattern.known else known, strict=True)
        return [["rms", "times better"], *([_fixed(sd, decimals), _fixed(times, 2)] for sd, times in pairs)]

    names = [f"{axis}, {patterns[0].block.linear_unit}" for axis in patterns[0].axes]
    return _in_blocks(patterns, ["", "", *names], rows)


def _control(patterns: Sequence[Pattern]) -> list[str]:
    if not any(quality.held for pattern in patterns for quality in pattern.control):
        return []
    decimals = _decimals(patterns)
    linear = patterns[0].block.linear_unit

    def rows(pattern: Pattern) -> list[list[str]]:
        heads = [["held", "sd", "redundancy", "detectable", "effect"], ["", linear, "mean", linear, "sd"]]
        digits = (0, decimals, 3, decimals, 1)
        values = ((q.held, q.sd, q.redundancy, q.detectable, q.effect) for q in pattern.control)
        return [*heads, *(list(map(_fixed, row, digits)) for row in values)]

    return _in_blocks(patterns, ["", "", "", *(q.component for q in patterns[0].control)], rows)


def _comparison(patterns: Sequence[Pattern]) -> list[str]:
    """Say how many times the best pattern is better than the worst."""
    if len(patterns) < 2 or not all(pattern.new_points.any() for pattern in patterns):
        return []
    decimals = _decimals(patterns)
    blocks = [[pattern.name] for pattern in patterns]
    labels, verdicts = [""], [""]
    for kind, axis, values in axis_figures(patterns):
        best, worst = min(values), max(values)
        better, than = (patterns[values.index(value)].name for value in (best, worst))
        labels.append(f"{kind} {axis}, {patterns[0].block.linear_unit}")
        said = f"{better} is {worst / best:.2f} times better than {than}"
        verdicts.append(said if worst > _NOTICED * best else "no difference")
        for block, value in zip(blocks, values, strict=True):
            block.append(_fixed(value, decimals))
    return _labelled(labels, [*(_column(block) for block in blocks), verdicts])


def _labelled(labels: list[str], blocks: list[list[str]]) -> list[str]:
    """Put labels before the lines of blocks side by side; lines that stay empty are left out."""
    width = max(_LABEL, *(len(label) for label in labels)) + 2
    rows = zip(labels, *blocks, strict=True)
    lines = [f"{label:<{width}}{_GAP.join(cells)}".rstrip() for label, *cells in rows]
    return [line for line in lines if line]


def _column(cells: list[str]) -> list[str]:
    width = max(10, *(len(cell) for cell in cells))
    return [f"{cell:>{width}}" for cell in cells]


def _aligned(name: str, rows: list[list[str]]) -> list[str]:
    """Right-align the columns of a pattern, two blanks between them, its name in the middle above them."""
    widths = [max(5, *(len(row[column]) for row in rows)) for column in range(len(rows[0]))]
    lines = ["  ".join(f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True)) for row in rows]
    width = max(len(name), len(lines[0]))
    return [f"{name:^{width}}", *(f"{line:>{width}}" for line in lines)]


def _decimals(patterns: Sequence[Pattern]) -> int:
    """Decimals that give lengths at least three digits, where they are as large as an image error."""
    return max(0, 2 - math.floor(math.log10(min(pattern.unit for pattern in patterns))))


def _fixed(value: float, decimals: int) -> str:
    return f"{value:z.{decimals}f}" if math.isfinite(value) else "-"
