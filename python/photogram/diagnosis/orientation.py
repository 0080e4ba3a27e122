"""Mistakes in units, axes, angles and sides of cameras: reports, and corrections for the later steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.diagnosis.conventions import KAPPA, TURNS, distances_in_millimetres, verdicts
from photogram.diagnosis.findings import Finding, Section, Words, finding, section_of
from photogram.diagnosis.mistakes import View
from photogram.diagnosis.predictions import Predicted
from photogram.network.block import Block
from photogram.network.rays import Rays, frame_radius
from photogram.words import phrase

SUSPICIOUS = 0.25  # Cost of a doubtful orientation (0: rays meet, 1: rays miss)
UPRIGHT = 0.8  # Least vertical component of the z axis of a near-vertical photo
MOST = 20  # Maximum number of explanations
HALF_TURN, SENSE, SIGN = "c or kappa", "sense", "sign-of-principal-distance"


def orientation(view: View, words: Words) -> tuple[Section, Callable[[Bools], Section], View, bool]:
    """Report mistakes in units, axes, angles and sides of cameras that explain the misfit, and correct them.

    Returns the section on conventions, a function that returns the section on sides without (P,) bad photos,
    the corrected view, and whether the correction is exact.
    """
    section = section_of("conventions")
    exact = True
    explanations: list[Finding] = []
    blocks: list[Block] = []  # Before the first mistake in sides, and after the last one of several photos
    for _ in range(MOST):
        found = next(iter(verdicts(view.seen)), None)
        if found is None:
            break
        if side := _side_of(found):
            names = [name for name in view.seen.photo_ids if not found.photos or name in found.photos]
            values = {"misfit_before": found.before, "misfit_after": found.after}
            explanations.append(
                finding("grave", found.message, names, values=values, kind=_kind(side, found))
            )
            blocks = blocks or [view.seen, view.seen]
        else:
            section.findings.append(finding("grave", found.message, kind="convention"))
        view, exact = view.changed(found.best[0].change), exact and found.best[0].exact
        if side and len(found.photos) != 1:
            blocks[1] = view.seen
    bars = distances_in_millimetres(view.seen)
    if bars is not None:
        section.findings.append(finding("grave", bars.message, kind="convention"))
        view = view.changed(bars.change)
    if section.findings:
        section.remark("check.remark.corrected")
    if not exact:
        section.remark("check.remark.approximate")
    return section, partial(_sides, blocks or [view.seen, view.seen], view, explanations, words), view, exact


def _sides(blocks: list[Block], view: View, explanations: list[Finding], words: Words, bad: Bools) -> Section:
    """Return the section on sides of cameras, with points above cameras and rays that do not meet."""
    section = section_of("sides")
    good = ~bad[view.seen.image_photos]
    rays, whole, after = (Rays.of(each, good) for each in (*blocks, view.seen))
    met, met_after = rays.intersect(), after.intersect()
    # A wrong sign or kappa of many photos explains nearly all points above cameras, which the guide requires.
    several = any(each.kind == "mirrored" and len(each.photos) > 1 for each in explanations)
    gone = _above(rays if several else whole).keys() - _above(after).keys()
    section.findings += [each for name, each in _above(rays).items() if name not in gone] + explanations
    sizes, radius = met_after.sizes[good], frame_radius(view.seen) / 2
    # Residual over half the frame, 1 behind the camera
    costs = np.where(met_after.in_front[good], np.minimum(sizes / radius, 1), 1.0)[np.isfinite(sizes)]
    cost = float(costs.mean()) if costs.size else 0.0
    if cost > SUSPICIOUS:
        section.note("grave", "check.rays-do-not-meet", [], [], {"cost": cost}, sense=words.sense)
    known = np.isfinite(met.sizes)
    behind = int((known & ~met.in_front).sum())
    section.figure("rays that meet behind their camera", f"{behind} of {int(known.sum())}")
    section.figure("median residual of intersection", f"{_median(met.sizes):.3f} {view.block.image_unit}")
    if view.seen is not blocks[0]:
        section.figure(
            "median residual with these explanations",
            f"{_median(met_after.sizes):.3f} {view.block.image_unit}; the sections below hold with them",
        )
    return section


def _side_of(found: Predicted) -> str:
    """Return the mistake of a verdict that concerns the sides of cameras; empty if it does not."""
    concerns = {*found.names} & {*TURNS}
    return next((name for name in found.names if name in TURNS or name == SENSE), "") if concerns else ""


def _kind(side: str, found: Predicted) -> str:
    if side == SENSE:
        return "sense-of-rotation"
    of_single = found.photos and found.distance is None
    return "mirrored" if side not in KAPPA else "kappa" if of_single or side != HALF_TURN else SIGN


def _median(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else math.nan


def _above(rays: Rays) -> dict[str, Finding]:
    """Return findings on control points above a camera that looks down, by their names."""
    block, met = rays.block, rays.intersect()
    given = np.isfinite(block.point_sd).any(axis=1).take(block.image_points)
    looks_down = (rays.cameras[:, 2, 2] > UPRIGHT).take(block.image_photos)
    above = met.positions[block.image_points, 2] - rays.centres[block.image_photos, 2]
    rows = np.flatnonzero(given & looks_down & (above > 0))
    findings = {}
    for row in rows[np.unique(block.image_points[rows], return_index=True)[1]].tolist():
        name, photo = block.point_ids[block.image_points[row]], block.photo_ids[block.image_photos[row]]
        values = {"above": float(above[row])}
        message = phrase(
            "check.control-above-camera", point=name, photo=photo, unit=block.linear_unit, **values
        )
        findings[name] = finding("grave", message, [photo], [name], values)
    return findings
