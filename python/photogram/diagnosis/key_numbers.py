"""Key numbers of the adjustment of a check (Appendix H), and its exclusions."""

from __future__ import annotations

import math
from collections.abc import Collection

from photogram.diagnosis.blunders import Edited
from photogram.diagnosis.findings import Finding, Level, Section, Words, finding, section_of, small_unit
from photogram.diagnosis.tested_values import mad_sd
from photogram.results.findings import HARMFUL
from photogram.results.fixed_tests import HELD
from photogram.results.result import Result
from photogram.statistics.evidence import SUSPECT, WITHHELD, Evidence
from photogram.statistics.findings import Findings
from photogram.words import phrase

VARIANCE = (0.5, 2.0)  # Variance of unit weight of realistic standard deviations


def key_numbers(edited: Edited, words: Words) -> Section:
    """Return the section of key numbers."""
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
