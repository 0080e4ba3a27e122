"""Sections of a check: structure of the block, residuals, control, key numbers (Appendices A and H)."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from photogram.arguments.types import Indices
from photogram.diagnosis.blunders import Edited
from photogram.diagnosis.findings import Finding, Level, Section, Words, finding, section_of, small_unit
from photogram.diagnosis.tested_values import mad_sd
from photogram.network.block import Block
from photogram.network.structuring import FEWEST_TIES, structure, ties
from photogram.results.document import bandwidths
from photogram.results.findings import HARMFUL
from photogram.results.fixed_tests import HELD
from photogram.results.result import Result
from photogram.show.quantity import Axis, Table, column
from photogram.statistics.evidence import SUSPECT, WITHHELD, Evidence
from photogram.statistics.findings import Findings, Systematic
from photogram.statistics.verdict import as_phrase
from photogram.words import phrase


def structure_section(block: Block, result: Result | None, words: Words) -> Section:
    """Report rays, ties and bandwidth, photos with few ties, and separate parts."""
    section = section_of("bandwidth" if words.bandwidth else "structure", order=words.order)
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    counts = np.bincount(block.image_photos, minlength=len(block.photo_ids))
    for number, points in zip(*np.unique(rays, return_counts=True), strict=True):
        section.figure(f"points on {number} photos", points)
    section.figure(
        "points on a photo, least, median, most", f"{counts.min()}, {np.median(counts):.0f}, {counts.max()}"
    )
    if words.bandwidth:
        _bandwidths(block, result, section)
    tied = ties(block)
    for photo in np.flatnonzero(tied < FEWEST_TIES).tolist():
        name, count = block.photo_ids[photo], int(tied[photo])
        fields = {"photo": name, "n": count, "least": FEWEST_TIES}
        section.note("grave", "check.few-ties", [name], [], {"ties": float(count)}, **fields)
    _parts(block, section)
    return section


def _bandwidths(block: Block, result: Result | None, section: Section) -> None:
    if result is not None:
        head, figures = bandwidths(result)
        section.remark("check.remark.bandwidth", description=head)
        for name, value in figures:
            section.figure(name, value)
        bandwidth = structure(result.block.image_photos, result.block.image_points).effective_bandwidth
    else:
        structured = structure(block.image_photos, block.image_points)
        bandwidth = structured.effective_bandwidth
        section.figure(
            "bandwidth in the order of the input",
            f"{bandwidth} sets of three effective, {structured.naive_bandwidth} without sharing",
        )
    photos = (bandwidth - 1) // 2
    reach = max(photos - 1, 0)
    section.remark("check.remark.sets", sets=bandwidth, photos=photos, reach=reach)


def _parts(block: Block, section: Section) -> None:
    parts = parts_of(block)
    numbers, sizes = np.unique(parts, return_counts=True)
    section.figure("parts without a common point", len(numbers))
    if len(numbers) < 2:
        return
    largest = numbers[sizes.argmax()]
    for number in numbers[numbers != largest].tolist():
        names = [block.photo_ids[photo] for photo in np.flatnonzero(parts == number).tolist()]
        section.note("grave", "check.separate-part", names, photos=names)


def parts_of(block: Block) -> Indices:
    """(P,) the first photo in the part of each photo."""
    photos, points = block.image_photos, block.image_points
    labels = np.arange(len(block.photo_ids))
    while True:
        by_point = np.full(len(block.point_ids), len(labels))
        np.minimum.at(by_point, points, labels[photos])
        fewer = labels.copy()
        np.minimum.at(fewer, photos, by_point[points])
        # Follow the labels of labels: the number of passes grows with the logarithm of the length.
        fewer = fewer[fewer]
        if (fewer == labels).all():
            return labels
        labels = fewer


def residuals(result: Result, patterns: Sequence[Systematic]) -> Section:
    """Describe residuals, and report the patterns that the verdict finds over frames and on photos."""
    section = section_of("patterns")
    used = result.used_images
    unit, factor = small_unit(result.block.image_unit)
    rays, squares = result.point_rays[result.block.image_points], result.residuals**2
    numbers = np.unique(rays[used])
    own = [used & (rays == number) for number in numbers]
    rms = factor * np.sqrt([squares[rows].mean(axis=0) for rows in own])
    axes = (Axis.of("x", unit), Axis.of("y", unit))
    columns = [
        column("rays", numbers, "Rays"),
        column("images", [int(rows.sum()) for rows in own], "Image observations"),
        column("rms", rms, "rms {}", axes=axes, kind="deviation", decimals=2),
        column("redundancy", [result.redundancy[rows].mean() for rows in own], "Mean redundancy", decimals=3),
    ]
    section.parts.append(Table("", "Residuals by number of rays", columns))
    for each in patterns:
        if each.significant and (each.large or each.subject):
            photos, values = [str(each.subject)] * bool(each.subject), {"statistic": each.value}
            kind = "photo-pattern" if photos else "systematic-pattern"
            found = finding("look", as_phrase(each.sentence), photos, values=values, kind=kind)
            section.findings.append(found)
    return section


MANY = 0.2  # Part of the control points above which a common cause is more probable


def control(edited: Edited, words: Words) -> Section:
    """Return the section on control that does not fit, with remedies."""
    section = section_of("control")
    result = edited.last
    if result is None:
        return section
    block = result.block
    controls = int((np.isfinite(block.point_sd).any(axis=1) & result.used_points).sum())
    common = len(edited.control) > max(MANY * controls, 3)
    if common:
        section.note("grave", "check.control-system", [], [*edited.control], n=len(edited.control))
    spoilt = {point for blunder in edited.section.findings for point in blunder.points}
    for name, findings in edited.control.items():
        section.findings.append(_misfit(result, name, findings, name in spoilt, common, words))
    held = np.isfinite(block.point_sd) & result.used_points[:, np.newaxis]
    names = ("longitude", "latitude", "height") if block.geographic else ("X", "Y", "Z")
    for axis, name in enumerate(names):
        section.figure(f"held components that fit, {name}", int(held[:, axis].sum()))
    return section


def _misfit(
    result: Result, name: str, findings: list[Finding], images_too: bool, common: bool, words: Words
) -> Finding:
    """Join the findings on components of a control point, and add remedies."""
    axes = {int(misfit.values["component"]) for misfit in findings}
    kept = np.isfinite(result.block.point_sd[result.block.point_ids.index(name)])
    part = "plan" if 2 not in axes else "height" if axes == {2} else "both"
    remedy = phrase(f"check.remedy.{part if kept.any() else 'point'}", change=words.remedy(kept))
    components = [misfit.phrase for misfit in findings]
    message = phrase(
        "check.control-misfit.point",
        components=components,
        remedy=remedy,
        images=phrase("check.remedy.images") if images_too else "",
    )
    test = max(misfit.values["test_value"] for misfit in findings)
    grave = any(misfit.level == "grave" for misfit in findings) and not common
    level: Level = "grave" if grave else "look"
    points = list(dict.fromkeys(point for misfit in findings for point in misfit.points))
    return finding(level, message, [], points, values={"test_value": test, **words.values(kept)})


VARIANCE = (0.5, 2.0)  # Variance of unit weight of realistic standard deviations


def key_numbers(edited: Edited, words: Words) -> Section:
    section = section_of("key-numbers")
    first, last = edited.first, edited.last
    if first is None or last is None:
        level: Level = "grave" if edited.asked else "look"
        section.note(level, "check.no-adjustment", reason=edited.reason)
        return section
    section.figure("status", f"{last.status} after {len(last.iterations)} iterations")
    if not last.converged:
        section.note("grave", "check.not-converged.last", status=last.status)
    elif not first.converged:
        section.note("look", "check.not-converged.first", status=first.status)
    rows = [("as it is", first)] if first is last else [("as it is", first), ("without what is named", last)]
    for name, result in rows:
        variance = result.variance_of_unit_weight
        shown = f"{variance:.4f}" if variance is not None else "undefined"
        section.figure(
            f"variance of unit weight, {name}",
            f"{shown} ({result.degrees_of_freedom:.6g} degrees of freedom)",
        )
    _variance(last, section)
    _squares(last, words, section)
    _weights(last, words, section)
    return section


def _squares(last: Result, words: Words, section: Section) -> None:
    title = "weighted sum of squares"
    initial = last.initial_weighted_sum_of_squares
    after = [each.weighted_sum_of_squares for each in last.iterations]
    if not words.iterations:
        section.figure(f"{title}, initial and last", f"{initial:.4g}, {[initial, *after][-1]:.4g}")
        return
    section.figure(f"{title}, initial", f"{initial:.4g}")
    for number, value in enumerate(after, 1):
        section.figure(f"{title}, iteration {number}", f"{value:.4g}")


def _variance(result: Result, section: Section) -> None:
    variance = result.variance_of_unit_weight
    if variance is None:
        section.note("grave", "check.no-redundancy")
    elif not VARIANCE[0] < variance < VARIANCE[1] and result.unit_variance != "unity":
        fields = {"variance": variance, "factor": math.sqrt(variance)}
        section.note(
            "look", "check.weights.variance", [], [], {"variance_of_unit_weight": variance}, **fields
        )


def _between(low: str, high: str, unit: str) -> str:
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _weights(result: Result, words: Words, section: Section) -> None:
    unit, factor = small_unit(result.block.image_unit)
    low, high = (
        factor * float(value) for value in (result.block.image_sd.min(), result.block.image_sd.max())
    )
    section.figure("standard deviations of image coordinates", _between(f"{low:g}", f"{high:g}", unit))
    spread = mad_sd(result.standardized)
    section.figure(
        "the same as the residuals have them", _between(f"{low * spread:.3g}", f"{high * spread:.3g}", unit)
    )
    usual = words.usual_um
    if usual is not None and unit == "um" and (low < usual[0] or high > usual[1]):
        fields = {"low": low, "high": high, "least": usual[0], "most": usual[1]}
        section.note("look", "check.weights.usual", [], [], {"least_um": low, "largest_um": high}, **fields)


def points_left_out(result: Result, named: Collection[str]) -> list[Finding]:
    """Return findings on excluded points that affect others, unless already named."""
    block = result.block
    found = []
    for point, reason in result.dropped.items():
        if reason not in HARMFUL or point in named:
            continue
        rows = block.image_points == block.point_ids.index(point)
        photos = [block.photo_ids[photo] for photo in block.image_photos[rows].tolist()]
        message = phrase("check.point-left-out", point=point, reason=HARMFUL[reason], photos=photos)
        found.append(finding("grave", message, photos, [point]))
    return found


def held_values(result: Result) -> list[Finding]:
    """Return the finding on the fixed station or point that best explains residuals."""
    tests = [each for each in result.verdict.tests if each.statistic in "wtTF"]
    if not tests:
        return []
    least = min(tests, key=lambda each: each.log10_p)
    if least.accepted or least.kind != HELD or isinstance(least.subject, str):
        return []
    value, of = least.value, least.subject.fields["named"].fields
    photos, points = ([of[kind]] if kind in of else [] for kind in ("photo", "point"))
    message = phrase("check.held-value", subject=least.subject, value=value)
    return [finding("grave", message, photos, points, values={"statistic": value})]


def disagreeing(found: Findings) -> list[Finding]:
    """Return the finding on disagreeing check points, as in the verdict."""
    evidence = Evidence(found)
    levels: tuple[tuple[Level, float], ...] = (("grave", WITHHELD), ("look", SUSPECT))
    for level, limit in levels:
        if points := evidence.disagreement(limit):
            names = [str(each.fields["name"]) for each in points if "name" in each.fields]
            return [finding(level, phrase("verdict.check-points", points=points), points=names)]
    return []
