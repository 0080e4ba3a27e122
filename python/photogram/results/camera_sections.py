"""The section of cameras: adjusted ones with tests and distortion, fixed ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.results.calibration import Calibration, GroupTest, ParameterTest, calibrations
from photogram.results.distortion import DistortionCurve, distortion_curve, lens_field
from photogram.show.page import Drawing, Fact, Facts, Part, Remarks, Section, about, layered_tables
from photogram.show.quantity import Axis, Quantity, Table, component, members, of_each, records

if TYPE_CHECKING:
    from photogram import Result

LISTED = 12  # Number of cameras with individual tables
RADII = 9  # Rows of a distortion curve


def cameras_section(result: Result, drawings: Sequence[Drawing]) -> Section:
    """Return the section of adjusted and fixed cameras."""
    found = calibrations(result)
    shown, note = found[:LISTED], "the table of cameras has all"
    law = "Student" if result.unit_variance != "unity" and result.variance_of_unit_weight else "normal"
    tables = [parameters_table(each, law) for each in shown]
    groups = [(each.camera.name, group) for each in shown for group in each.groups]
    parts: list[Part] = [*layered_tables("camera", tables), _terms_together(groups)]
    curves = [
        _curve_table(each.camera.name, curve, str(each.camera.camera.unit))
        for each in shown
        if (curve := distortion_curve(result, each.camera)) is not None
    ]
    parts += [*drawings, *layered_tables("curve", curves)]
    remarks = [
        f"{each.camera.name}: {sentence}"
        for each in shown
        for sentence in (
            *(about("correlated", **vars(pair)) for pair in each.correlations),
            *(about("correlated.pose", **vars(pair)) for pair in each.poses),
            *_field_remarks(result, each),
            *each.remarks(),
        )
    ]
    held = [each for each in result.cameras if each.given.is_held]
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
        facts.append(Fact("Not shown here", f"{len(held) - LISTED}", note=note))
    more = [Fact("Not shown here", f"{len(found) - LISTED}", note=note)] if len(found) > LISTED else []
    parts += [Remarks(remarks), Facts("Cameras that are held", facts), Facts("More cameras", more)]
    return Section("cameras", "Cameras", parts, about("cameras") if found else "")


def parameters_table(found: Calibration, law: str = "") -> Table:
    every, camera = found.parameters, found.camera
    axes, of = tuple(Axis.of(each.name, each.unit) for each in every), np.arange(len(every))
    names = replace(component(axes, of)[0], head="Parameter")
    alike: dict[str, Any] = {"axes": axes, "of": of}
    free = {math.inf: "free"}
    columns = [
        of_each(every, "name", member="name", kind="name"),
        of_each(every, "unit", kind="name"),
        names,
        of_each(every, "given", kind="value", member="", head="Given", **alike),
        of_each(every, "given_sd", kind="deviation", member="", head="sd given", words=free, **alike),
        of_each(every, "value", kind="value", head="Adjusted", **alike),
        of_each(every, "sd", kind="deviation", head="sd adjusted", **alike),
        of_each(every, "change", kind="difference", head="Change", **alike),
        of_each(every, "test_value", head=f"t {law}".strip(), decimals=2),
        of_each(every, "probability", head="p", figures=2),
        of_each(every, "significant"),
        of_each(every, "multiple_correlation", head="R with all others", decimals=4),
        of_each(every, "from_prior"),
        of_each(every, "gain"),
        Quantity(
            [outcome(each) for each in every],
            kind="name",
            head="Outcome",
            marked=np.array([not each.separable or each.contradicts for each in every], dtype=bool),
        ),
    ]
    lens = {"model": camera.camera.model, "direction": camera.camera.direction}
    note = about("camera", **lens, photos=camera.photos, images=camera.images)
    deviations = np.array([each.sd for each in every])
    return Table(f"parameters-{camera.name}", camera.name, columns, note, "", deviations)


def gains_section(result: Result) -> Section:
    """Return redundancy numbers and gains of parameters, for text reports."""
    tables = []
    for found in calibrations(result)[:LISTED]:
        every, name = found.parameters, found.camera.name
        weighted = np.array([0 < each.given_sd < math.inf for each in every], dtype=bool)
        columns = [
            of_each(every, "name", kind="name", head="Parameter"),
            of_each(every, "redundancy", head="Redundancy", decimals=3, seen=weighted),
            of_each(every, "gain", head="Gain"),
        ]
        tables.append(Table(f"gains-{name}", name, columns))
    return Section("gains", "Redundancy numbers and gains of camera parameters", tables, about("gains"))


def outcome(each: ParameterTest) -> str:
    words = ["significant" if each.significant else "not significant"]
    if not each.is_lens:
        words = ["differs from the given value" if each.significant else "as given"]
    if not each.separable:
        words.append("not separable")
    if each.from_prior:
        words.append("from its prior")
    return ", ".join(words)


def _terms_together(groups: Sequence[tuple[str, GroupTest]]) -> Table:
    every = [group for _, group in groups]
    columns = [
        Quantity([camera for camera, _ in groups], kind="name", head="Camera"),
        Quantity([", ".join(each.names) for each in every], kind="name", head="Terms together"),
        of_each(every, "test_value", head="F", decimals=2),
        of_each(every, "probability", head="p", figures=2),
        of_each(every, "outcome", kind="name", head="Outcome"),
    ]
    return Table("camera-groups", "Terms of the lens tested together", columns)


def _curve_table(camera: str, curve: DistortionCurve, unit: str) -> Table:
    axes = (Axis("", unit, small="um", factor=1000.0) if unit == "mm" else Axis.of("", unit),)
    inside = np.flatnonzero(curve.radii <= curve.observed * (1 + 1e-9))
    rows = inside[np.unique(np.linspace(0, len(inside) - 1, RADII).round().astype(int))]
    added = "measured" if curve.direction == "backward" else "ideal"
    column: Any = partial(Quantity, axes=axes, kind="deviation", decimals=3)
    columns = [
        Quantity(curve.radii, (Axis.of("", unit),), "deviation", head="Radius", decimals=4),
        column(curve.values, head="Distortion"),
        column(curve.sd, head="sd"),
        column(curve.sd_mapping, head="sd of the mapping"),
        column(curve.balanced, head="Balanced"),
        column(curve.sd_balanced, head="sd of balanced"),
    ]
    sizes = {"observed": curve.observed, "zero": curve.balanced_at, "distance": curve.balanced_distance}
    note = about("curve", added=added, unit=unit, **sizes)
    return Table(f"distortion-{camera}", f"Radial distortion of {camera}", columns, note, shown=rows)


def _field_remarks(result: Result, found: Calibration) -> list[str]:
    field, unit = lens_field(result, found.camera), str(found.camera.camera.unit)
    if field is None:
        return []
    factor, written = (1000.0, "um") if unit == "mm" else (1.0, "px")
    at = field.largest
    x, y = field.positions[at]
    (dx, dy), (sx, sy) = field.vectors[at], np.sqrt(np.diag(field.covariances[at]))
    return [
        f"{', '.join(field.names)}: at the most {factor * dx:.3f} and {factor * dy:.3f} {written} (sd"
        f" {factor * sx:.3f} and {factor * sy:.3f}), at x {x:.4g}, y {y:.4g} {unit}"
    ]


def calibration_members(result: Result) -> list[dict[str, Any]]:
    return [_member(result, each) for each in calibrations(result)]


def _member(result: Result, found: Calibration) -> dict[str, Any]:
    curve, field = distortion_curve(result, found.camera), lens_field(result, found.camera)
    return {
        "camera": found.camera.name,
        "parameters": records(parameters_table(found).columns),
        "groups": [
            members(each, "names", "test_value", "probability", "significant") for each in found.groups
        ],
        "correlations": [vars(each) for each in found.correlations],
        "pose_correlations": [vars(each) for each in found.poses],
        "terms": [
            members(each, "names", "statistic", "probability", "worth_keeping", largest_effect_sd="effect")
            for each in found.terms
        ],
        "removable": found.removable,
        "remarks": found.remarks(),
        "distortion": curve
        and members(curve, "direction", observed_radius="observed")
        | members(curve, "balanced_at", "balanced_distance", radius="radii", distortion="values")
        | members(curve, "sd", sd_of_mapping="sd_mapping")
        | members(curve, "balanced", balanced_sd="sd_balanced"),
        "field": field
        and members(field, terms="names", position="positions", vector="vectors", covariance="covariances"),
    }
