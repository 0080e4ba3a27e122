"""Photos with wrong sign of the principal distance or kappa, or mirrored plates."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.diagnosis.findings import Finding, Section, Words, finding
from photogram.diagnosis.hypotheses import images_turned, turn_of
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.rays import Intersection, Rays, frame_radius, meet
from photogram.words import Phrase, phrase

SUSPICIOUS = 0.25  # Cost of a doubtful orientation (0: rays meet, 1: rays miss)
BETTER = 0.5  # Largest ratio of the costs after and before an accepted explanation
UPRIGHT = 0.8  # Least vertical component of the z axis of a near-vertical photo
AS_GOOD = 1.5  # Another explanation is as good if its cost is below this multiple of the least
MOST = 20  # Maximum number of photos that are corrected one by one
TURNS = (180, 90, -90)  # Degrees of kappa
MIRRORS = {name: turn_of(name) for name in ("mirrored", "y down", "exchanged", "exchanged and turned")}
"""Reflections that map a frame onto itself, by cause."""


def orientation(block: Block, words: Words, unit: str = "mm") -> tuple[Section, Block]:
    """Test photos with opposite principal distance, rotated, or mirrored.

    Returns the section, and the block with the accepted explanations, so that other errors become visible.
    """
    section = Section(
        "Sides of the cameras (intersection from the initial stations)",
        "A point computed above its camera means a wrong sign of the principal distance, or a wrong kappa.",
    )
    rays = Rays.of(block)
    met = rays.intersect()
    above = _above(rays, met)
    explanations: list[Finding] = []
    doubt = _doubt(rays, met)
    if max(doubt) > SUSPICIOUS:
        block = _whole_block(block, sum(doubt), words, explanations)
    whole = block
    for _ in range(MOST):
        turned = _one_photo(block, explanations)
        if turned is None:
            break
        block = turned
    after = rays if block is rays.block else Rays.of(block)
    met_after = met if block is rays.block else after.intersect()
    cost = _mean(_costs(after, met_after))
    if cost > SUSPICIOUS:
        explanations.append(
            finding("grave", phrase("check.rays-do-not-meet", sense=words.sense), values={"cost": cost})
        )
    section.findings += _unexplained(above, explanations, whole, block) + explanations
    known = np.isfinite(met.sizes)
    behind = int((known & ~met.in_front).sum())
    section.figure("rays that meet behind their camera", f"{behind} of {int(known.sum())}")
    section.figure("median residual of intersection", f"{_median(met.sizes):.3f} {unit}")
    if block is not rays.block:
        section.figure(
            "median residual with these explanations",
            f"{_median(met_after.sizes):.3f} {unit}; the sections below hold with them",
        )
    return section, block


def _median(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else math.nan


def _mean(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else 0.0


def _above(rays: Rays, met: Intersection) -> list[Finding]:
    block = rays.block
    given = np.isfinite(block.point_sd).any(axis=1).take(block.image_points)
    looks_down = (rays.cameras[:, 2, 2] > UPRIGHT).take(block.image_photos)
    heights, stations = met.positions[block.image_points, 2], rays.centres[block.image_photos, 2]
    rows = np.flatnonzero(given & looks_down & (heights > stations))
    points, first = np.unique(block.image_points[rows], return_index=True)
    findings = []
    for point, row in zip(points.tolist(), rows[first].tolist(), strict=True):
        name, photo = block.point_ids[point], block.photo_ids[block.image_photos[row]]
        above = float(heights[row] - stations[row])
        fields = {"point": name, "photo": photo, "above": above, "unit": block.linear_unit}
        message = phrase("check.control-above-camera", **fields)
        findings.append(finding("grave", message, [photo], [name], values={"above": above}))
    return findings


def _unexplained(
    above: list[Finding], explanations: list[Finding], whole: Block, last: Block
) -> list[Finding]:
    """Remove points above cameras explained by mirrored plates or a photo's kappa.

    A wrong sign or kappa of many photos explains nearly all. The guide requires the points in this case as
    well.
    """
    if last is whole and not any(finding.kind == "mirrored" for finding in explanations):
        return above
    before, after = (
        {name for finding in _above(rays, rays.intersect()) for name in finding.points}
        for rays in (Rays.of(whole), Rays.of(last))
    )
    if any(finding.kind == "mirrored" and len(finding.photos) > 1 for finding in explanations):
        return [finding for finding in above if after.issuperset(finding.points)]
    return [finding for finding in above if not (before - after).issuperset(finding.points)]


def spare_explained(section: Section, block: Block, photos: Bools) -> None:
    """Remove findings explained by bad photos: points above a camera, divergent rays."""
    rays = Rays.of(block).without(photos[block.image_photos])
    met = rays.intersect()
    above = {name for finding in _above(rays, met) for name in finding.points}
    gone = (
        {"rays-do-not-meet"} if _mean(np.where(rays.used, _costs(rays, met), np.nan)) <= SUSPICIOUS else set()
    )
    section.findings = [
        finding
        for finding in section.findings
        if finding.kind not in gone
        and (finding.kind != "control-above-camera" or above.issuperset(finding.points))
    ]


def _doubt(rays: Rays, met: Intersection) -> tuple[float, float]:
    """Return the misfit of rays of a block, and of observations to control: 0 to 1.

    Within a strip the rays intersect even if all photos are mirrored across the flight. Only control reveals
    it.
    """
    block = rays.block
    given = np.isfinite(block.point_sd[:, 0] + block.point_sd[:, 1])
    positions = np.where(
        np.isfinite(block.point_sd), block.point_positions, rays.axes.from_local(met.positions)
    )
    rows = np.flatnonzero(given[block.image_points])
    residuals, in_front = rays.residuals(rays.axes.positions(positions)[block.image_points[rows]], rows)
    sizes = np.hypot(residuals[:, 0], residuals[:, 1])
    control = np.where(in_front, np.minimum(sizes / (frame_radius(block) / 2), 1), 1.0)
    return _mean(_costs(rays, met)), _mean(np.where(np.isfinite(sizes), control, np.nan))


def _costs(rays: Rays, met: Intersection) -> Floats:
    """(m,) costs of observations: residual over half the frame, 1 behind the camera."""
    radius = frame_radius(rays.block) / 2
    costs = np.minimum(met.sizes / radius, 1)
    return np.where(np.isfinite(met.sizes) & ~met.in_front, 1.0, costs)


def _photo_costs(block: Block, costs: Floats) -> Floats:
    """(P,) mean cost of the observations of each photo; NaN without any."""
    known = np.isfinite(costs)
    photos, count = block.image_photos[known], len(block.photo_ids)
    sums = np.bincount(photos, weights=costs[known], minlength=count)
    images = np.bincount(photos, minlength=count)
    return np.where(images > 0, sums / np.maximum(images, 1), np.nan)


def _turned(block: Block, photos: Bools, turn: int) -> Block:
    attitudes = block.photo_attitudes.copy()
    attitudes[photos, 2] += math.radians(turn)
    return block.replace(photo_attitudes=attitudes)


def _whole_block(block: Block, before: float, words: Words, explanations: list[Finding]) -> Block:
    """Find an explanation for all photos, or all with the same principal distance."""
    trials = _trials(block, words)
    tried = [Rays.of(trial.block) for trial in trials]
    costs = [sum(_doubt(rays, rays.intersect())) for rays in tried]
    best = trials[int(np.argmin(costs))]
    if min(costs) > BETTER * before:
        return block
    good = (other.kind for other, cost in zip(trials, costs, strict=True) if cost < AS_GOOD * min(costs))
    rivals = [phrase(f"mistake.kind.{kind}") for kind in dict.fromkeys(good) if kind != best.kind]
    also = phrase("check.rivals", rivals=rivals) if rivals else ""
    message = Phrase(best.message.code, {**best.message.fields, "rivals": also})
    explanations.append(
        finding("grave", message, best.photos, values={"cost_before": before, "cost_after": min(costs)}),
    )
    return best.block


@dataclass(frozen=True)
class _Trial:
    message: Phrase
    photos: list[str]
    block: Block

    @property
    def kind(self) -> str:
        return self.message.code.split(".")[1]


def _trials(block: Block, words: Words) -> list[_Trial]:
    """Return the explanations to try; among equally good ones the first counts."""
    groups = {phrase("group.all-photos"): np.ones(len(block.photo_ids), dtype=bool)}
    of_photos = block.known_distances("checks")
    distances = np.unique(of_photos).tolist()
    for value in distances if len(distances) > 1 else []:
        groups[phrase("group.distance", distance=value)] = of_photos == value
    trials = []
    for group, photos in groups.items():
        names = [photo for photo, of in zip(block.photo_ids, photos.tolist(), strict=True) if of]
        sign = phrase("check.sign-of-principal-distance", group=group)
        changed = np.where(photos, -of_photos, of_photos)
        other_sign = block.replace(principal_distances=changed, cameras=(), photo_cameras=None)
        trials.append(_Trial(sign, names, other_sign))
        for turn in TURNS[1:]:
            message = phrase("check.kappa.group", group=group, turn=turn)
            trials.append(_Trial(message, names, _turned(block, photos, turn)))
        for name, mirror in MIRRORS.items():
            message = phrase("check.mirrored.group", group=group, cause=phrase(f"mirror.{name}"))
            trials.append(_Trial(message, names, images_turned(block, photos, mirror)))
    other = block.replace(photo_to_ground=not block.photo_to_ground)
    sense = phrase("check.sense-of-rotation", sense=words.sense)
    return [*trials, _Trial(sense, list(block.photo_ids), other)]


def _one_photo(block: Block, explanations: list[Finding]) -> Block | None:
    """Rotate or mirror the photo with the clearest improvement, if any."""
    rays = Rays.of(block)
    met = rays.intersect()
    before = _photo_costs(block, _costs(rays, met))
    suspicious = np.nan_to_num(before) > SUSPICIOUS
    if not suspicious.any():
        return None
    images = suspicious[block.image_photos]
    trials = _photo_trials(block)
    every = np.ones(len(block.photo_ids), dtype=bool)
    after = np.array([_alone(rays, images, Rays.of(trial.change(every))) for trial in trials])
    gain = np.where(suspicious & np.isfinite(after), after / np.where(suspicious, before, 1), np.inf)
    which, photo = (int(index) for index in np.unravel_index(int(np.argmin(gain)), gain.shape))
    if gain[which, photo] > BETTER:
        return None
    trial, name = trials[which], block.photo_ids[photo]
    message = phrase(trial.code, **trial.fields, photo=name)
    values = {"cost_before": float(before[photo]), "cost_after": float(after[which, photo])}
    explanations.append(finding("grave", message, [name], values=values))
    only = np.zeros(len(block.photo_ids), dtype=bool)
    only[photo] = True
    return trial.change(only)


@dataclass(frozen=True)
class _PhotoTrial:
    """An explanation for a photo: message code and fields, and the changed block."""

    code: str
    fields: dict[str, Any]
    change: Callable[[Bools], Block]


def _photo_trials(block: Block) -> list[_PhotoTrial]:
    trials = []
    for turn in TURNS:
        code = "check.kappa.half-turn" if turn == TURNS[0] else "check.kappa.photo"
        trials.append(_PhotoTrial(code, {"turn": turn}, partial(_turned, block, turn=turn)))
    for name, mirror in MIRRORS.items():
        fields = {"cause": phrase(f"mirror.{name}")}
        trials.append(_PhotoTrial("check.mirrored.photo", fields, partial(images_turned, block, turn=mirror)))
    return trials


def _alone(rays: Rays, images: Bools, changed: Rays) -> Floats:
    """(P,) cost of each photo if it alone is changed, over the given observations."""
    own, own_right = rays.equations()
    new, new_right = changed.equations()
    normal, constant, count = rays.totals()
    at = rays.block.image_points[images]
    positions = np.full((len(images), 3), np.nan)
    positions[images] = meet(
        normal[at] - own[images] + new[images],
        constant[at] - own_right[images] + new_right[images],
        count[at],
    )
    residuals, in_front = changed.residuals(positions)
    return _photo_costs(rays.block, _costs(changed, Intersection(positions, residuals, in_front)))
