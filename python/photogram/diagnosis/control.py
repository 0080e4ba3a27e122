"""Control points that do not fit, with remedies (Appendix H)."""

from __future__ import annotations

import numpy as np

from photogram.diagnosis.blunders import Edited
from photogram.diagnosis.findings import Finding, Level, Section, Words, finding, section_of
from photogram.results.result import Result
from photogram.words import phrase

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
