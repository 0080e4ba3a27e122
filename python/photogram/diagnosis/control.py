"""Control that does not fit, with its remedies (Appendix H)."""

from __future__ import annotations

import numpy as np

from photogram.diagnosis.editing import Edited
from photogram.diagnosis.findings import Finding, Level, Section, Words, note
from photogram.results.result import Result

MANY = 0.2
"""Of the control: when more does not fit, it is hardly the points."""


def control(edited: Edited, words: Words) -> Section:
    """Say which control does not fit, and what may be done about it."""
    section = Section(
        "Control", "Control fails by misidentification, poor transfer of the point, or bad coordinates."
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
        note(section, "control-system", "grave", text, [], list(edited.control))
    for one, other in edited.exchanged:
        text = (
            f"the control points {one} and {other} are exchanged: each has the coordinates that the images"
            " give the other; what follows holds with them exchanged back"
        )
        note(section, "exchanged-control", "grave", text, [], [one, other])
    spoilt = {point for finding in edited.section.findings for point in finding.points}
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
    """Put the components of one control point together, with the remedies of the guide."""
    axes = sorted({int(finding.values["component"]) for finding in findings})
    kept = np.isfinite(result.block.point_sd[result.block.point_ids.index(name)])
    unhold = words.unhold(kept)
    if not kept.any():
        remedy = (
            "nothing of it fits: misidentified, or wrong coordinates; make it a pass point or re-measure it"
        )
    elif axes == [2]:
        remedy = f"the height only: {unhold}, or raise its standard deviation"
    elif 2 not in axes:
        remedy = f"the planimetry only: {unhold}, or look for poor point transfer"
    else:
        remedy = f"{unhold}, raise the standard deviations, or re-measure it"
    if images_too:
        remedy += "; its images do not fit either: look at the plates first"
    text = "; ".join(finding.text for finding in findings) + ": " + remedy
    test = max(finding.values["test_value"] for finding in findings)
    grave = any(finding.level == "grave" for finding in findings) and not common
    level: Level = "grave" if grave else "look"
    rivals = list(dict.fromkeys(point for finding in findings for point in finding.points))
    return Finding("control-misfit", level, text, [], rivals, {"test_value": test, **words.values(kept)})
