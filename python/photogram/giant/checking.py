"""The check of a project: Appendix H of the guide (editing and run strategy) as a report."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.adjustment.hints import hints
from photogram.checks.editing import HOPELESS, Edited, blunder_section, edit
from photogram.checks.findings import Check, Finding, Section
from photogram.checks.gross import Suspects, disproved, gross, without
from photogram.checks.heights import two_ray_heights
from photogram.checks.orientation import orientation, spare_explained
from photogram.checks.residuals import residuals
from photogram.checks.stations import stations
from photogram.checks.structure import structure_section
from photogram.giant.control import control, key_numbers
from photogram.giant.diagnostics import error_warnings
from photogram.giant.limits import Limits
from photogram.network.block import Block
from photogram.network.rays import Rays

if TYPE_CHECKING:
    from photogram.giant.project import Project

__all__ = ["check"]

FINAL_STATIONS = 5.0
"""Stations count as adjusted when half the residuals are below so many standard deviations."""
NAMES_ON_A_LINE = 4
"""As the 1987 program printed them."""


def check(project: Project, *, limits: Limits | None = None, threads: int | None = None) -> Check:
    """Check a project as Appendix H of the guide teaches: first by intersection, then by adjustment.

    Nothing is changed or written. What an earlier step explains (a wrong sign, a turned photo) is put right
    for the later ones, and what it finds wrong is left out of them, so that every error shows by itself.

    Parameters
    ----------
    project
        The project.
    limits
        Limits of the 1987 program; by default none.
    threads
        Threads of the adjustment; the findings do not depend on it. Default: all processors.

    Returns
    -------
    The findings, section by section.

    Raises
    ------
    InputError
        The project makes no block.
    """
    block = project.to_block(limits)
    # Absurd values overflow to what no comparison holds for; what they spoil is reported, not the overflow.
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _checked(project, block, limits, threads)


def _checked(project: Project, block: Block, limits: Limits | None, threads: int | None) -> Check:
    upright, oriented = orientation(block)
    if oriented is block:
        upright.findings += [Finding("convention", "grave", str(hint)) for hint in hints(block)]
    errors, suspects = gross(oriented)
    if suspects.photos.any():
        spare_explained(upright, oriented, suspects.photos)
    edited = _edited(project, oriented, suspects, threads)
    misleading: set[str] = set()
    if edited.last is not None and edited.last.converged and edited.spread < HOPELESS:
        cleared = disproved(oriented, suspects, edited.last)
        if cleared.any():
            suspects = replace(suspects, images=suspects.images & ~cleared)
            points = oriented.image_points[cleared]
            on = oriented.image_photos[np.isin(oriented.image_points, points)]
            misleading = {oriented.photo_ids[photo] for photo in on.tolist()}
            errors.findings = without(oriented, errors.findings, cleared)
            edited = _edited(project, oriented, suspects, threads)
    # What the adjustment has explained or disproved.
    settled = {name for pair in edited.exchanged for name in pair} | set(edited.cleared)
    errors.findings = [
        each for each in errors.findings if each.kind != "control-difference" or not settled & {*each.points}
    ]
    sections = [_input(project, block, limits), structure_section(block, edited.first), upright, errors]
    sections += [edited.section, *_after_adjustment(oriented, edited, misleading)]
    return Check(project.title, sections, edited.last)


def _edited(project: Project, block: Block, suspects: Suspects, threads: int | None) -> Edited:
    """Adjust the block, or intersect it when that is the job and its stations are good enough."""
    common = project.common
    options: dict[str, Any] = {"unit_variance": common.unit_variance, "threads": threads}
    if not common.intersection_only:
        return edit(block, suspects, **options)
    met = Rays.of(block).intersect()
    ratio = met.sizes / block.image_sd.mean(axis=1)
    if np.isfinite(ratio).any() and np.nanmedian(ratio) < FINAL_STATIONS:
        return edit(block, suspects, **options, fix_photos=True)
    reason = "COMMON column 10 asks for intersection only, and the stations are not adjusted ones"
    return Edited(None, None, reason, math.nan, blunder_section(), asked=False)


def _input(project: Project, block: Block, limits: Limits | None) -> Section:
    section = Section("Input", "Remarks on the files, and the warnings of the 1987 program.")
    section.lines.append(
        f"{len(block.photo_ids)} photos, {len(block.point_ids)} points, {len(block.image_xy)} images"
    )
    section.findings += [Finding("remark", "look", str(message)) for message in project.messages]
    for warning in error_warnings(project, block, limits):
        if warning.general:
            section.lines.append("ERROR WARNINGS")
        section.lines.append(warning.heading)
        names = [f"{name:<10}" for name in warning.names]
        section.lines += [
            "  " + "".join(names[first : first + NAMES_ON_A_LINE]).rstrip()
            for first in range(0, len(names), NAMES_ON_A_LINE)
        ]
        text = f"{warning.heading.lower()}: {len(warning.names)}"
        section.findings.append(Finding("warning", "look", text, [], warning.names))
    return section


def _after_adjustment(block: Block, edited: Edited, misleading: set[str]) -> list[Section]:
    """Return the sections that rest on the adjustment, as far as there is one."""
    result = edited.last
    if result is None or not result.converged:
        return [stations(block, None), key_numbers(edited)]
    return [
        control(edited),
        stations(block, result, misleading),
        residuals(result, edited.spread),
        two_ray_heights(result),
        key_numbers(edited),
    ]
