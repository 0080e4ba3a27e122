"""The adjustment report as text: problems, then how good it is, then values with their deviations."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from photogram.messages import Message
from photogram.network.geometry import lengths_of_units
from photogram.network.knots import Knot
from photogram.network.observations import Observation, Prior, Smoothness
from photogram.network.structuring import structure
from photogram.results.axes import image_axes, point_axes
from photogram.results.calibration_report import calibration_sections, values_written
from photogram.results.check_points import observed_control
from photogram.results.courses import POSES, courses_table, notable, notable_courses
from photogram.results.features_report import features_sections
from photogram.results.film_report import film_lines
from photogram.results.iteration_text import iteration_lines
from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import control, iterations, part, photos, points, stations
from photogram.results.observation_kinds import ObservedKind
from photogram.results.observation_rows import (
    NOTABLE,
    control_lines,
    image_lines,
    largest,
    largest_of,
    observed_lines,
    suspect_lines,
)
from photogram.results.result import Result
from photogram.results.tables import check_points, observed_components, redundancy_by_kind, unheld, unknowns
from photogram.results.weakest import weakest_lines
from photogram.show.lines import Field, blank, field, padded, stacked, table_lines
from photogram.show.methods import report_of
from photogram.show.quantity import Axis, Quantity, chosen, labelled
from photogram.show.sections import Section, composed, headline, problems, problems_or_none, verdict_sections
from photogram.statistics.limits import externally_studentized

if TYPE_CHECKING:
    from photogram.arguments.types import Floats

FLOWN, WORST = 100, 20
"""Observations of trajectories up to which all are listed, and components that are where they are more."""

ORDERINGS = {
    "input": "in input order",
    "rcm": "by reverse Cuthill-McKee",
    "amd": "by minimum degree",
    "dissection": "by nested dissection",
    "graph-dissection": "by dissection of the graph",
    "parts": "in parts, and the separators between them",
}


@report_of.register(Result)
@np.errstate(over="ignore")  # what is too large for its unit is infinite
def report(result: Result) -> str:
    """Return the report of an adjusted block."""
    sections = [*summary(result), *details(result)]
    return composed(headline("block adjustment", result.block.title), sections)


@np.errstate(over="ignore")
def details(result: Result) -> list[Section]:
    """Return what a report says behind its summary, as titled sections."""
    return [
        ("Redundancy by kind of observation", _redundancy(result)),
        ("Reliability", reliability_lines(result, result.block.linear_unit)),
        ("Iterations", iteration_lines(iterations(result), ".6f")),
        ("Check points: adjusted minus given, standard deviations, test", _check_points(result)),
        (
            "Control as observations: adjusted minus given, redundancy, standardized difference",
            control_lines(result),
        ),
        ("Components of control that are not held: adjusted minus given", _unheld(result)),
        (
            "Stations as observations: adjusted minus given, redundancy, standardized difference",
            observed_lines(stations(result), "photo"),
        ),
        (
            "Observations beside images: observed minus adjusted, redundancy, standardized residual",
            [line for each in result.kinds.values() for line in _kind(result, each)],
        ),
        *calibration_sections(result),
        ("Cameras that are held", _held_cameras(result)),
        ("Film and fiducials: films of photos, marks, scanners", film_lines(result)),
        ("Unknowns that observations have in common", _unknowns(result)),
        ("Trajectories: their corrections, in the span of their tables", _courses(result)),
        ("Photos", _photos(result)),
        ("Points", _points(result)),
        ("Weakest points and photos", weakest_lines(result)),
        ("Image points: observed minus computed, redundancy, standardized residual", image_lines(result)),
        ("Work", _work(result)),
    ]


@np.errstate(over="ignore")
def summary(result: Result) -> list[Section]:
    """Return what a reader wants first, as titled sections: verdict, problems, adjustment, residuals."""
    more = [*features_sections(result.features), ("Residuals", _residuals(result))]
    title, suspects = suspects_section(result)
    return [*first_sections(result, _adjustment(result)), *more, (title, suspects or ["none"])]


def first_sections(result: AdjustedNetwork, adjustment: list[str]) -> list[Section]:
    """Return what the summary of every network begins with: verdict, problems, adjustment."""
    return [
        *verdict_sections(result.verdict),
        ("Problems", problems_or_none(problems_of(result), result.verdict)),
        ("Adjustment", adjustment),
    ]


def suspects_section(result: AdjustedNetwork) -> Section:
    """List the image coordinates that fit worst; where unit weight is not known, in units of the others."""
    if result.KNOWN:
        name, title, tests = "standardized", "|standardized residual| > {}", result.standardized
    else:
        name, title = "t", "|t| > {} (externally studentized)"
        tests = externally_studentized(result.standardized, *result.sum_and_freedom)
    head = f"Image coordinates with {title.format(f'{NOTABLE:g}')}, largest first"
    return head, suspect_lines(result, tests, name)


def problems_of(result: AdjustedNetwork) -> list[str]:
    """Return what keeps a reader from using the values: a failed test and outliers before other remarks.

    The tests of outliers are those of the verdict.
    """
    messages = [*(Message(str(each)) for each in result.verdict.outliers), *result.messages]
    return problems(messages, result.status, result.variance_of_unit_weight, result.global_test)


def _adjustment(result: Result) -> list[str]:
    sums, variance = result.sums_of_squares, result.variance_of_unit_weight
    own = root = "undefined"
    if variance is not None:
        own, root = f"{variance:.6f} ({_BASIS[result.unit_variance]})", f"{math.sqrt(variance):.6f}"
    rows = [
        ("status", result.status),
        ("iterations", f"{len(result.iterations)}"),
        ("variance of unit weight", own),
        ("standard deviation of unit weight", root),
        ("degrees of freedom", f"{result.degrees_of_freedom:.8g}"),
        ("weighted sum of squares, photos", f"{sums.camera:.6f}"),
        ("weighted sum of squares, control", f"{sums.ground:.6f}"),
        ("weighted sum of squares, images", f"{sums.plates:.6f}"),
        *(
            (f"weighted sum of squares, {each.kind}", f"{each.sum_of_squares:.6f}")
            for each in result.kinds.values()
        ),
        ("weighted sum of squares, total", f"{sums.total:.6f}"),
        *size_of(result),
    ]
    return [f"{name:<35} {value}" for name, value in rows]


_BASIS = {
    "free": "rule of 1987",
    "constrained": "all weighted values",
    "unity": "set to 1",
    "redundancy": "redundancy numbers",
}


def size_of(result: Result) -> list[tuple[str, str]]:
    """Return what the block consists of: names and what there is."""
    block = result.block
    kinds = result.point_kinds[result.used_points].tolist()
    held = np.isfinite(block.point_sd)
    held[observed_control(block)] = True
    held &= result.used_points[:, np.newaxis]
    counts = zip(point_axes(block), held.sum(axis=0), strict=True)
    return [
        ("photos", f"{len(block.photo_ids)}"),
        *([("cameras", f"{len(block.cameras)}")] if block.cameras else []),
        ("points", ", ".join(f"{kinds.count(kind)} {kind}" for kind in ("pass", "control", "check"))),
        ("held components of control", ", ".join(f"{axis.name} {count}" for axis, count in counts)),
        ("image points", f"{int(result.used_images.sum())} used of {len(block.image_xy)}"),
        *(
            (f"observations, {each.kind}", f"{each.used} used of {len(each.rows)}")
            for each in result.kinds.values()
        ),
        ("object space", "geographic" if block.geographic else "rectangular"),
        ("rotation angles", "photo-to-ground" if block.photo_to_ground else "ground-to-photo"),
        ("datum", str(result.datum)),
        ("refraction", block.refraction.describe(block.linear_unit) if block.refraction else "none"),
    ]


def _residuals(result: Result) -> list[str]:
    used = result.used_images
    (axis, _) = image_axes(result.block.image_unit)
    unit, factor = axis.small, axis.factor
    rms = [rms_of(result.residuals[used][:, axis]) * factor for axis in (0, 1)]
    lines = [
        f"rms of image residuals              {value:.3f} {unit} in {name}"
        for value, name in zip(rms, "xy", strict=True)
    ]
    redundancy = result.redundancy[used]
    if np.isfinite(redundancy).all() and redundancy.size:
        lines.append(
            f"mean redundancy number              {redundancy.mean():.3f} (least {redundancy.min():.3f})"
        )
        largest = np.nan_to_num(np.abs(result.standardized[used])).max()
        lines.append(f"largest |standardized residual|     {largest:.2f}")
    for what, table in (
        ("control points", control(result)),
        ("unheld components", unheld(result)),
        ("check points", check_points(result)),
    ):
        differences = labelled(table, "difference").values
        values = [rms_of(column[np.isfinite(column)]) for column in differences.T]
        if np.isfinite(differences).any():
            lines.append(f"{f'rms of {what}':<36}{', '.join(_differences(result, values))}")
    return lines


def _redundancy(result: Result) -> list[str]:
    """List number, redundancy and sum of squares of every kind; the redundancies sum to the excess."""
    names, *numbers = redundancy_by_kind(result)
    heads = (
        ("number", ".0f", 8),
        ("redundancy", ".4f", 14),
        ("v P v", ".4f", 14),
        ("factor of sd", ".3f", 14),
    )
    fields = [field(each, w, form, head) for each, (head, form, w) in zip(numbers, heads, strict=True)]
    return table_lines([*field(names, 36, head="kind"), *chain(*fields)])


def reliability_lines(result: AdjustedNetwork, unit: str) -> list[str]:
    """Return what a report says of reliability, lengths in a unit."""
    summary = result.reliability_summary
    return [] if summary is None else summary.lines(unit)


def _unheld(result: Result) -> list[str]:
    names, *table = unheld(result)
    return table_lines(
        [*field(names, 10, head="point"), *field(labelled(table, "difference"), 18, ".5f", "d {name} {unit}")]
    )


def _check_points(result: Result) -> list[str]:
    """List differences with the standard deviations of both, T or F, and p."""
    names, *table = check_points(result)
    *_, statistic, p = table
    law = "F" if result.unit_variance != "unity" else "T"
    first = [*field(statistic, 12, ".2f", head=law), *field(p, 10, ".2g", head="p")]
    return stacked(names, "point", [(each, ".5f") for each in table if each.label], first, "d {name} {unit}")


def _kind(result: Result, kind: ObservedKind) -> list[str]:
    """Write a line for each component of every observation; of many of trajectories, of the worst."""
    table = observed_components([kind])
    tests = np.abs(labelled(table, "standardized").values)
    if len(kind.rows) > FLOWN and any(
        _is_flown(result.block.observations[row]) for row in kind.rows.tolist()
    ):
        worst = largest_of(tests, WORST)
        note = [f"{len(worst)} of {len(tests)} components, with the largest test values; the table has all"]
        table = chosen(table, worst)
    else:
        table, note = largest(table, tests, "test values")
    _, of, names, _, *numbers = table
    forms = [_decimals_of(labelled(numbers, "sd"), 5)] * 2 + [".3f", ".2f"]
    fields = [field(each, 14, form, str(each.label)) for each, form in zip(numbers, forms, strict=True)]
    first = field(of, 28, head=kind.kind)
    return [*table_lines([*first, *field(names, 22, head="component"), *chain(*fields)]), *note]


def _is_flown(observation: Observation) -> bool:
    """Whether an observation is of a trajectory or of a knot: there may be thousands."""
    of_knot = isinstance(observation, Prior) and isinstance(observation.unknown, Knot)
    return of_knot or observation.moment is not None or isinstance(observation, Smoothness)


def _unknowns(result: Result) -> list[str]:
    """Write a line for each component of common unknowns; of many coefficients, of the notable ones."""
    shown, note = notable(result.unknowns)
    kinds, own, names, _, *numbers = unknowns(shown)
    titles = replace(
        own, values=[f"{kind} {name}" for kind, name in zip(kinds.values, own.values, strict=True)]
    )
    forms = _decimals_of(labelled(numbers, "sd"), 6)
    fields = [
        field(replace(labelled(numbers, label), of=np.arange(len(forms))), 15, forms, label)
        for label in ("value", "change", "sd given", "sd")
    ]
    fields.append(field(labelled(numbers, "redundancy"), 15, ".3f", "redundancy"))
    first = field(titles, 28, head="unknown")
    lines = table_lines([*first, *field(names, 22, head="component"), *chain(*fields)])
    return [*lines, *([note] if note else [])]


def _decimals_of(sd: Quantity, least: int) -> list[str]:
    """Return a form for each row: so many decimals, or more where the standard deviation needs them."""
    own = sd.outward()
    sizes = np.where((own > 0) & np.isfinite(own), own, 1.0)
    return [f".{int(each)}f" for each in np.clip(1 - np.floor(np.log10(sizes)), least, 12).tolist()]


def _courses(result: Result) -> list[str]:
    """Write a line for the positions and one for the rotations of each trajectory."""
    every, note = notable_courses(result)
    names, of, basis, *numbers = courses_table(every, result.block.linear_unit)
    widths = {"count": (14, ".0f"), "first": (14, ".3f"), "last": (14, ".3f"), "largest": (20, ".6f")}
    widths |= {"at": (14, ".3f"), "tested": (14, ".2f")}
    fields = [
        *field(names, 20, head="trajectory"),
        *field(of, 18, head="correction"),
        *field(basis, 24, head="basis"),
        *(
            each
            for label, (width, form) in widths.items()
            for each in field(labelled(numbers, label), width, form, labelled(numbers, label).head.lower())
        ),
    ]
    return [*table_lines(fields), *([note] if note and every else [])]


def _datum(result: Result) -> list[str]:
    """Say what standard deviations refer to, where they would be others in another datum."""
    return [f"standard deviations: {result.datum}"] if result.datum.is_chosen else []


def _photos(result: Result) -> list[str]:
    sizes = np.linalg.norm(result.photo_sd[:, :3] * _lengths(result), axis=1)
    (names, values, sd), more = largest(photos(result), sizes, "standard deviations")
    place, turn, unit = slice(0, 3), slice(3, 6), "sd {unit}"
    (named,) = field(names, 10, head="photo")
    first = [*field(part(values, place), 20, ".4f"), *field(part(values, turn), 15, ".7f")]
    second = [*field(part(sd, place), 20, ".5f", unit), *field(part(sd, turn), 15, ".3f", unit)]
    lines = table_lines([named, *first], [blank(named), *second, *_long(result, sd)])
    return [*_datum(result), *([POSES] if result.block.timed else []), *lines, *more]


def _held_cameras(result: Result) -> list[str]:
    held = [each for each in result.cameras if each.given.is_held]
    return [
        f"{name}{each.camera.model}, {each.photos} photos: {values_written(each.camera)}"
        for name, each in zip(padded((each.name for each in held), 16), held, strict=True)
    ]


def _points(result: Result) -> list[str]:
    table = points(result)
    sizes = np.linalg.norm(np.asarray(table[-1].values) * _lengths(result), axis=1)
    (names, kinds, rays, values, sd), more = largest(table, sizes, "standard deviations")
    (named,) = field(names, 10, head="point")
    rest = [*field(rays, 4, ".0f", "rays", "  "), *field(kinds, 0, head="kind", gap="  ")]
    first = [named, *field(values, 20, ".4f"), *rest]
    lines = table_lines(first, [blank(named), *field(sd, 20, ".5f", "sd {unit}"), *_long(result, sd)])
    return [*_datum(result), *lines, *more]


def _work(result: Result) -> list[str]:
    order = ORDERINGS[result.ordering]
    lines = [f"photos eliminated {order}; normal equations formed {result.formations} times"]
    lines += [
        f"{f'multiply-adds if {ORDERINGS[name]}':<36}{predicted_operations(count, '.3e')}"
        for name, count in result.predictions.items()
        if name != result.ordering
    ]
    head, figures = bandwidths(result)
    lines += [head, *(f"{f'  {name}':<36}{value}" for name, value in figures)]
    lines += [f"{f'multiply-adds of one {name}':<36}{count:.3e}" for name, count in result.operations.items()]
    return lines


def predicted_operations(count: float, form: str) -> str:
    """Return the predicted operations of an ordering as text."""
    return "too large for this ordering" if math.isnan(count) else format(count, form)


def bandwidths(result: Result) -> tuple[str, list[tuple[str, str]]]:
    """Return what the 1987 program would have needed, for the order of the input and for the one chosen.

    A sentence, and names with values.
    """
    images = result.block.image_photos, result.block.image_points
    figures = []
    for name, order in (("of the input", None), ("chosen", result.photo_order)):
        found = structure(*images, order)
        value = f"{found.effective_bandwidth} effective, {found.naive_bandwidth} without sharing"
        figures.append((f"in the order {name}", value))
    return "bandwidth of the normal equations in sets of three unknowns (GIANT guide, Appendix A)", figures


def rms_of(values: Floats) -> float:
    """Return the root mean square of some values; NaN of none."""
    return math.sqrt(float(np.mean(values**2))) if values.size else math.nan


def _differences(result: Result, values: Iterable[float]) -> list[str]:
    """Write differences in the components, those that are angles also as lengths."""
    axes, lengths, unit = point_axes(result.block), _lengths(result).tolist(), result.block.linear_unit
    return [
        f"{axis.name} {value * axis.factor:.5f} {axis.small}"
        + (f" ({value * length:.4f} {unit})" if axis.angle else "")
        for axis, value, length in zip(axes, values, lengths, strict=True)
        if math.isfinite(value)
    ]


def _long(result: Result, sd: Quantity) -> list[Field]:
    """Return standard deviations in plan as lengths, where they are angles."""
    if not result.block.geographic:
        return []
    axes = tuple(Axis.of(name, result.block.linear_unit) for name in ("east", "north"))
    lengths = Quantity(sd.values[:, :2] * _lengths(result)[:2], axes, "deviation")
    return field(lengths, 15, ".4f", "sd {name} {unit}")


def _lengths(result: Result) -> Floats:
    """Return (3,) the lengths of the units of the coordinates in the middle of the block."""
    middle = result.photo_positions.mean(axis=0, keepdims=True)
    found: Floats = lengths_of_units(middle, result.block.spheroid)[0]
    return found
