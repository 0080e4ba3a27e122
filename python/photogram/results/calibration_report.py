"""The part of the report, and of the JSON document, on cameras that an adjustment has calibrated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.network.cameras import Camera
from photogram.results.calibration import Calibration, ParameterTest, calibrations
from photogram.results.distortion import DistortionCurve, LensField, distortion_curve, lens_field
from photogram.results.result import Result
from photogram.show.lines import padded
from photogram.show.page import probability_written
from photogram.show.quantity import members
from photogram.show.sections import Section

LISTED = 20
"""Cameras that a report describes in full; the table of cameras and the JSON document have all."""
NAMED = 3
"""Photos that are named of each correlation."""
RADII = 9
"""Radii of a curve in the report."""


def calibration_sections(result: Result) -> list[Section]:
    """Return a titled section for each camera with unknown parameters."""
    found = calibrations(result)
    sections = [_section(result, each) for each in found[:LISTED]]
    if len(found) > LISTED:
        sections.append(
            ("More cameras", [f"{len(found) - LISTED}; the table of cameras and the JSON document have all"])
        )
    return sections


def _section(result: Result, found: Calibration) -> Section:
    camera = found.camera
    lines = [
        f"model {camera.camera.model} ({camera.camera.direction}), {camera.photos} photos,"
        f" {camera.images} images",
        "",
        *_parameter_lines(result, found),
        *_group_lines(found),
        *_correlation_lines(found),
    ]
    curve = distortion_curve(result, camera)
    if curve is not None:
        lines += ["", *_curve_lines(curve, str(camera.camera.unit))]
    field = lens_field(result, camera)
    if field is not None:
        lines += ["", _field_line(field, str(camera.camera.unit))]
    remarks = found.remarks()
    return f"Calibration of {camera.name}", [*lines, *([""] if remarks else []), *remarks]


def law_of(result: Result) -> str:
    """Return the distribution of the tests of parameters."""
    return "Student" if result.unit_variance != "unity" and result.variance_of_unit_weight else "normal"


def values_written(camera: Camera) -> str:
    """Return the parameters of a camera that are not zero."""
    return ", ".join(f"{name} {value:.8g}" for name, value in camera.parameters.items() if value != 0)


def _parameter_lines(result: Result, found: Calibration) -> list[str]:
    heads = ("value", "sd", "change", f"t ({law_of(result)})", "probability", "R", "redundancy", "gain")
    titles = ["parameter", *(f"{each.name} {each.unit}".strip() for each in found.parameters)]
    head, *names = padded(titles, 16)
    lines = [head + "".join(f"{head:>15}" for head in heads) + "  verdict"]
    for name, each in zip(names, found.parameters, strict=True):
        cells = (
            f"{each.value:>15.8g}",
            f"{each.sd:>15.3g}",
            f"{each.change:>15.4g}",
            f"{each.test_value:>15.2f}",
            f"{probability_written(each.probability):>15}",
            f"{each.multiple_correlation:>15.5f}",
            f"{each.redundancy:>15.3f}" if 0 < each.given_sd < math.inf else f"{'free':>15}",
            f"{each.gain:>15.4g}",
        )
        lines.append(f"{name}{''.join(cells)}  {outcome(each)}")
    return lines


def outcome(each: ParameterTest) -> str:
    """Say what was found of a parameter."""
    words = ["significant" if each.significant else "not significant"]
    if not each.is_lens:
        words = ["differs from the given value" if each.significant else "as given"]
    if not each.separable:
        words.append("not separable")
    if each.from_prior:
        words.append("from its prior")
    return ", ".join(words)


def _group_lines(found: Calibration) -> list[str]:
    if not found.groups:
        return []
    titles = ["terms together", *(", ".join(each.names) for each in found.groups)]
    head, *names = padded(titles, 31)
    lines = ["", f"{head}{'F':>15}{'probability':>15}"]
    return lines + [
        f"{name}{each.test_value:>15.2f}{probability_written(each.probability):>15}  {each.outcome}"
        for name, each in zip(names, found.groups, strict=True)
    ]


def _correlation_lines(found: Calibration) -> list[str]:
    if not (found.correlations or found.poses):
        return ["", "no parameter is correlated with another, or with a pose, by more than 0.95"]
    pairs = [f"  {each.first} and {each.second}: {each.coefficient:.4f}" for each in found.correlations]
    pairs += [
        f"  {each.parameter} and {each.component} of {_first_photos(each.photos)}: {each.coefficient:.4f}"
        for each in found.poses
    ]
    return ["", "correlated by more than 0.95:", *pairs]


def _first_photos(photos: Sequence[str]) -> str:
    """Name three photos at the most."""
    named = f"photo {', '.join(photos[:NAMED])}"
    return named if len(photos) <= NAMED else f"{named} and {len(photos) - NAMED} others"


def _curve_lines(curve: DistortionCurve, unit: str) -> list[str]:
    factor, written = (1000.0, "um") if unit == "mm" else (1.0, "px")
    added = "measured" if curve.direction == "backward" else "ideal"
    lines = [
        f"radial distortion in {written}, added to {added} coordinates, over the {added} radius up to"
        f" {curve.observed:.4g} {unit};",
        "sd of the mapping: of curve and principal distance together",
        f"balanced: zero at {curve.balanced_at:.4g} {unit}, where the principal distance is"
        f" {curve.balanced_distance:.7g} {unit}",
        f"{f'radius {unit}':>15}{'distortion':>15}{'sd':>15}{'sd of mapping':>15}{'balanced':>15}{'sd':>15}",
    ]
    inside = np.flatnonzero(curve.radii <= curve.observed * (1 + 1e-9))
    for k in np.unique(np.linspace(0, len(inside) - 1, RADII).round().astype(int)).tolist():
        columns = (curve.values, curve.sd, curve.sd_mapping, curve.balanced, curve.sd_balanced)
        cells = "".join(f"{factor * float(column[k]):>15.3f}" for column in columns)
        lines.append(f"{curve.radii[k]:>15.4f}{cells}")
    return lines


def _field_line(field: LensField, unit: str) -> str:
    factor, written = (1000.0, "um") if unit == "mm" else (1.0, "px")
    at = field.largest
    x, y = field.positions[at]
    (dx, dy), (sx, sy) = field.vectors[at], np.sqrt(np.diag(field.covariances[at]))
    return (
        f"{', '.join(field.names)}: at the most {factor * dx:.3f} and {factor * dy:.3f} {written} (sd"
        f" {factor * sx:.3f} and {factor * sy:.3f}), at x {x:.4g}, y {y:.4g} {unit}"
    )


def calibration_members(result: Result) -> list[dict[str, Any]]:
    """Return what the JSON document says of each camera with unknown parameters."""
    return [_member(result, each) for each in calibrations(result)]


def _member(result: Result, found: Calibration) -> dict[str, Any]:
    curve, field = distortion_curve(result, found.camera), lens_field(result, found.camera)
    tested = ("test_value", "probability", "significant")
    return {
        "camera": found.camera.name,
        "parameters": [
            members(each, "name", "unit", "value", "sd", "change", *tested)
            | members(each, "multiple_correlation", "from_prior", "gain")
            for each in found.parameters
        ],
        "groups": [members(each, "names", *tested) for each in found.groups],
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
