"""Points on the wrong side of their cameras: the sign of the principal distance, or kappa (Appendix H)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photogram.block import Block
from photogram.giant.checks.findings import Finding, Section
from photogram.giant.checks.rays import Intersection, Rays, frame_radius, meet

__all__ = ["orientation"]

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

SUSPICIOUS = 0.25
"""Cost above which an orientation is doubted: 0 for rays that meet in front, 1 for rays that miss."""
BETTER = 0.5
"""An explanation must lower the cost to this part of what it was."""
UPRIGHT = 0.8
"""Vertical component of the z axis of a near-vertical photo, at least; it looks along its negative z axis."""
AS_GOOD = 1.5
"""Another explanation is as good when its cost is below so many times the least."""
MOST = 20
"""Photos that are turned one by one, at most."""
TURNS = {"by 180 degrees": math.pi, "by 90 degrees": math.pi / 2, "by -90 degrees": -math.pi / 2}


def orientation(block: Block) -> tuple[Section, Block]:
    """Test whether photos fit when the sign of their principal distance is changed or kappa is turned.

    Returns the section, and the block with the explanations that hold, so that other errors show.
    """
    section = Section(
        "Sides of the cameras (intersection from the initial stations)",
        "A point computed above its camera means a wrong sign of the principal distance, or a wrong kappa.",
    )
    rays = Rays.of(block)
    met = rays.intersect()
    section.findings += _above(rays, met)
    costs = _costs(rays, met)
    if _mean(costs) > SUSPICIOUS:
        block = _whole_block(block, section)
    for _ in range(MOST):
        turned = _one_photo(block, section)
        if turned is None:
            break
        block = turned
    known = np.isfinite(met.sizes)
    behind = int((known & ~met.in_front).sum())
    section.lines.append(f"{'rays that meet behind their camera':<50}{behind} of {int(known.sum())}")
    section.lines.append(f"{'median residual of intersection':<50}{_median(met.sizes):.3f} mm")
    if block is not rays.block:
        after = Rays.of(block).intersect()
        section.lines.append(
            f"{'median residual with these explanations':<50}{_median(after.sizes):.3f} mm;"
            " the sections below hold with them"
        )
    return section, block


def _median(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else math.nan


def _mean(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else 0.0


def _above(rays: Rays, met: Intersection) -> list[Finding]:
    """Name control points computed above a camera that looks down."""
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
        text = (
            f"control point {name} is computed {above:.0f} {block.linear_unit} above the camera of photo"
            f" {photo}: sign of the principal distance? (positive plane: negative; negative plane: positive)"
            " else kappa?"
        )
        findings.append(Finding("control-above-camera", "grave", text, [photo], [name], {"above": above}))
    return findings


def _costs(rays: Rays, met: Intersection) -> Floats:
    """(m,) how badly each image fits: its residual as a part of half the frame, 1 behind the camera."""
    radius = frame_radius(rays.block) / 2
    costs = np.minimum(met.sizes / radius, 1)
    return np.where(np.isfinite(met.sizes) & ~met.in_front, 1.0, costs)


def _photo_costs(block: Block, costs: Floats) -> Floats:
    """(P,) mean cost of the images of each photo; NaN without any."""
    known = np.isfinite(costs)
    photos, count = block.image_photos[known], len(block.photo_ids)
    sums = np.bincount(photos, weights=costs[known], minlength=count)
    images = np.bincount(photos, minlength=count)
    return np.where(images > 0, sums / np.maximum(images, 1), np.nan)


def _turned(block: Block, photos: Mask, angle: float) -> Block:
    attitudes = block.photo_attitudes.copy()
    attitudes[photos, 2] += angle
    return block.replace(photo_attitudes=attitudes)


def _sign_changed(block: Block, photos: Mask) -> Block:
    distances = np.where(photos, -block.principal_distances, block.principal_distances)
    return block.replace(principal_distances=distances)


def _whole_block(block: Block, section: Section) -> Block:
    """Look for one explanation for all photos, or for all of one principal distance."""
    before = _mean(_cost_of(block))
    trials = _trials(block)
    costs = [_mean(_cost_of(trial.block)) for trial in trials]
    best = trials[int(np.argmin(costs))]
    if min(costs) > BETTER * before:
        text = (
            "the rays miss each other, and neither the sign of the principal distance, nor kappa, nor the"
            " sense of the angles (COMMON column 2) explains it: look at positions, angles, names of frames"
            " and points"
        )
        section.findings.append(Finding("rays-do-not-meet", "grave", text, values={"cost": before}))
        return block
    values = {"cost_before": before, "cost_after": min(costs)}
    others = [
        other.kind.replace("-", " ")
        for other, cost in zip(trials, costs, strict=True)
        if other is not best and cost < AS_GOOD * min(costs)
    ]
    text = best.text + (f" Nearly as good: {', '.join(others)}" if others else "")
    section.findings.append(Finding(best.kind, "grave", text, best.photos, [], values))
    return best.block


@dataclass(frozen=True)
class _Trial:
    """One explanation for many photos."""

    kind: str
    text: str
    photos: list[str]
    block: Block


def _trials(block: Block) -> list[_Trial]:
    """Explanations to try; of equally good ones the first counts, and the sign is the most probable."""
    groups = {"all photos": np.ones(len(block.photo_ids), dtype=bool)}
    distances = np.unique(block.principal_distances).tolist()
    for value in distances if len(distances) > 1 else []:
        groups[f"the photos of principal distance {value:g} mm"] = block.principal_distances == value
    trials = []
    for name, photos in groups.items():
        names = [photo for photo, of in zip(block.photo_ids, photos.tolist(), strict=True) if of]
        text = (
            f"the sign of the principal distance of {name} is wrong: with the other sign the rays meet in"
            " front of the cameras. (Kappa turned by 180 degrees on every one of them would do the same.)"
        )
        trials.append(_Trial("sign-of-principal-distance", text, names, _sign_changed(block, photos)))
        for turn in ("by 90 degrees", "by -90 degrees"):
            text = f"the kappa of {name} is wrong: turned {turn}, the rays meet."
            trials.append(_Trial("kappa", text, names, _turned(block, photos, TURNS[turn])))
    text = "the angles are of the other sense (COMMON column 2): taken so, the rays meet."
    other = block.replace(photo_to_ground=not block.photo_to_ground)
    return [*trials, _Trial("sense-of-rotation", text, list(block.photo_ids), other)]


def _cost_of(block: Block) -> Floats:
    rays = Rays.of(block)
    return _costs(rays, rays.intersect())


def _one_photo(block: Block, section: Section) -> Block | None:
    """Turn the one photo whose kappa most clearly is wrong, if there is one."""
    rays = Rays.of(block)
    met = rays.intersect()
    before = _photo_costs(block, _costs(rays, met))
    suspicious = np.nan_to_num(before) > SUSPICIOUS
    if not suspicious.any():
        return None
    images = suspicious[block.image_photos]
    after = np.array([_turned_alone(rays, images, angle) for angle in TURNS.values()])
    gain = np.where(suspicious & np.isfinite(after), after / np.where(suspicious, before, 1), np.inf)
    which, photo = np.unravel_index(int(np.argmin(gain)), gain.shape)
    if gain[which, photo] > BETTER:
        return None
    turn, name = list(TURNS)[which], block.photo_ids[photo]
    sign = "; another sign of its principal distance would do the same" if which == 0 else ""
    text = f"the kappa of photo {name} is wrong: turned {turn}, its rays meet those of the other photos{sign}"
    values = {"cost_before": float(before[photo]), "cost_after": float(after[which, photo])}
    section.findings.append(Finding("kappa", "grave", text, [name], [], values))
    only = np.zeros(len(block.photo_ids), dtype=bool)
    only[photo] = True
    return _turned(block, only, list(TURNS.values())[which])


def _turned_alone(rays: Rays, images: Mask, angle: float) -> Floats:
    """(P,) cost of each photo when it alone is turned, over the given images."""
    block = rays.block
    every = np.ones(len(block.photo_ids), dtype=bool)
    turned = Rays.of(_turned(block, every, angle))
    own, own_right = rays.equations()
    new, new_right = turned.equations()
    normal, constant, count = rays.totals()
    at = block.image_points[images]
    positions = np.full((len(images), 3), np.nan)
    positions[images] = meet(
        normal[at] - own[images] + new[images],
        constant[at] - own_right[images] + new_right[images],
        count[at],
    )
    residuals, in_front = turned.residuals(positions)
    return _photo_costs(block, _costs(turned, Intersection(positions, residuals, in_front)))
