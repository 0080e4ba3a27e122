"""Control that does not fit, with its remedies, and the key numbers of an adjustment (Appendix H)."""

from __future__ import annotations

import math

import numpy as np

from photogram.checks.editing import Edited
from photogram.checks.findings import Finding, Level, Section
from photogram.checks.robust import mad_sd
from photogram.giant.ground import CHECK_POINT
from photogram.results.result import Result

__all__ = ["control", "key_numbers"]

CODES = np.array([1, 2, 4])
WEIGHTS_UM = (5.0, 15.0)
"""Standard deviations of image coordinates that are usual, micrometres (Appendix H)."""
MANY = 0.2
"""Of the control: when more does not fit, it is hardly the points."""
VARIANCE = (0.5, 2.0)
"""Variance of unit weight between which the weights count as realistic."""


def control(edited: Edited) -> Section:
    """Say which control does not fit, and what may be done about it."""
    section = Section(
        "Control",
        "Control fails by misidentification, poor transfer of the point, or bad coordinates.",
    )
    result = edited.last
    if result is None:
        return section
    block = result.block
    controls = int((np.isfinite(block.point_sd).any(axis=1) & result.used_points).sum())
    common = len(edited.control) > max(MANY * controls, 3)
    if common:
        text = (
            f"{len(edited.control)} control points do not fit: rather than all of them, something common may"
            " be wrong (lens, film, refraction, curvature of the earth, datum, standard deviations)"
        )
        section.findings.append(Finding("control-system", "grave", text, [], list(edited.control)))
    for one, other in edited.exchanged:
        text = (
            f"the control points {one} and {other} are exchanged: each has the coordinates that the images"
            " give the other; what follows holds with them exchanged back"
        )
        section.findings.append(Finding("exchanged-control", "grave", text, [], [one, other]))
    spoilt = {point for finding in edited.section.findings for point in finding.points}
    for name, findings in edited.control.items():
        section.findings.append(
            _misfit(result, name, findings, name in spoilt, "look" if common else "grave")
        )
    held = np.isfinite(block.point_sd) & result.used_points[:, np.newaxis]
    names = ("longitude", "latitude", "height") if block.geographic else ("X", "Y", "Z")
    for axis, name in enumerate(names):
        section.lines.append(f"{f'held components that fit, {name}':<50}{int(held[:, axis].sum())}")
    return section


def _misfit(result: Result, name: str, findings: list[Finding], images_too: bool, level: Level) -> Finding:
    """Put the components of one control point together, with the remedies of the guide."""
    axes = sorted({int(finding.values["component"]) for finding in findings})
    row = result.block.point_ids.index(name)
    held = np.isfinite(result.block.point_sd[row])
    code = int(CODES[~held].sum())
    if code == CHECK_POINT:
        remedy = (
            "nothing of it fits: misidentified, or wrong coordinates; make it a pass point or re-measure it"
        )
    elif axes == [2]:
        remedy = f"the height only: lower the type (column 80: {code}), or raise its standard deviation"
    elif 2 not in axes:
        remedy = f"the planimetry only: lower the type (column 80: {code}), or look for poor point transfer"
    else:
        remedy = f"lower the type (column 80: {code}), raise the standard deviations, or re-measure it"
    if images_too:
        remedy += "; its images do not fit either: look at the plates first"
    text = "; ".join(finding.text for finding in findings) + ": " + remedy
    test = max(finding.values["test_value"] for finding in findings)
    return Finding("control-misfit", level, text, [], [name], {"test_value": test, "type_code": float(code)})


def key_numbers(edited: Edited) -> Section:
    """Return the numbers by which a run is judged."""
    section = Section(
        "Key numbers",
        "The variance of unit weight approaches 1 when residuals and standard deviations agree.",
    )
    first, last = edited.first, edited.last
    if first is None or last is None:
        level: Level = "grave" if edited.asked else "look"
        section.findings.append(Finding("no-adjustment", level, f"no adjustment: {edited.reason}"))
        return section
    _statuses(first, last, section)
    rows = [("as it is", first)] if first is last else [("as it is", first), ("without what is named", last)]
    for name, result in rows:
        variance = result.variance_of_unit_weight
        shown = f"{variance:.4f}" if variance is not None else "undefined"
        section.lines.append(
            f"{f'variance of unit weight, {name}':<50}{shown}"
            f" ({result.degrees_of_freedom} degrees of freedom)"
        )
    _variance(last, section)
    section.lines.append(
        f"{'weighted sum of squares, initial':<50}{last.initial_weighted_sum_of_squares:.4g}"
    )
    section.lines += [
        f"{f'weighted sum of squares, iteration {each.number}':<50}{each.weighted_sum_of_squares:.4g}"
        for each in last.iterations
    ]
    _weights(last, section)
    return section


def _statuses(first: Result, last: Result, section: Section) -> None:
    section.lines.append(f"{'status':<50}{last.status} after {len(last.iterations)} iterations")
    if not last.converged:
        text = f"the adjustment has {last.status}: the data are bad or the geometry is weak"
        section.findings.append(Finding("not-converged", "grave", text))
    elif not first.converged:
        text = f"with the observations named above the adjustment has {first.status}"
        section.findings.append(Finding("not-converged", "look", text))


def _variance(result: Result, section: Section) -> None:
    variance = result.variance_of_unit_weight
    if variance is None:
        section.findings.append(Finding("no-redundancy", "grave", "there are no degrees of freedom"))
    elif not VARIANCE[0] < variance < VARIANCE[1] and result.unit_variance != "unity":
        text = (
            f"the variance of unit weight is {variance:.3f}: if no gross or systematic error is left, the"
            f" standard deviations should be {math.sqrt(variance):.2f} times what they are"
        )
        section.findings.append(
            Finding("weights", "look", text, values={"variance_of_unit_weight": variance})
        )


def _weights(result: Result, section: Section) -> None:
    low, high = (1000 * float(value) for value in (result.block.image_sd.min(), result.block.image_sd.max()))
    section.lines.append(f"{'standard deviations of image coordinates':<50}{low:g} to {high:g} um")
    spread = mad_sd(result.standardized)
    section.lines.append(
        f"{'the same as the residuals have them':<50}{low * spread:.1f} to {high * spread:.1f} um"
    )
    if low < WEIGHTS_UM[0] or high > WEIGHTS_UM[1]:
        text = (
            f"standard deviations of image coordinates are usually {WEIGHTS_UM[0]:g} to {WEIGHTS_UM[1]:g} um:"
            " are these meant?"
        )
        section.findings.append(
            Finding("weights", "look", text, values={"least_um": low, "largest_um": high})
        )
