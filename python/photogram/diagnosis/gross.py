"""Suspects at initial stations, by intersection: photos and control (Appendix H)."""

from __future__ import annotations

from itertools import chain
from typing import NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.findings import Level, Section, section_of
from photogram.diagnosis.robust import mad_sd
from photogram.network.block import Block
from photogram.network.rays import Rays
from photogram.network.subset import kept_images, of_photos

BAD_PHOTO = 4.0  # A bad photo exceeds the median residual of the median photo by this factor,
BAD_PHOTO_SD = 4.3
"""... and exceeds all photos by this number of robust standard deviations (of the logarithm)."""
MISSING = 10.0  # Residual of a ray that misses its point, relative to the median of its photo
CONTROL_GRAVE, CONTROL_LOOK = 12.0, 6.0
"""Control differences in robust standard deviations that are reported."""
FEWEST_CONTROL = 4  # Control points that a comparison needs
CANDIDATES = 5  # Number of photos with the largest residuals that are omitted by trial
MOST_PHOTOS = 20


class Suspects(NamedTuple):
    """Observations that the adjustment may have to exclude."""

    photos: Bools  # (P,) bad photos
    points: Bools  # (n,) points whose rays miss each other
    control: Bools  # (n,) control points far from the intersections of their rays

    @classmethod
    def none(cls, block: Block) -> Suspects:
        """Return no suspects."""
        photos, points = (np.zeros(len(ids), dtype=bool) for ids in (block.photo_ids, block.point_ids))
        return cls(photos, points, points)

    def excluded_from(self, block: Block) -> Block:
        """Return a block without suspects."""
        return of_photos(kept_images(block, ~self.points[block.image_points]), ~self.photos)


def gross(block: Block, unit: str = "mm") -> tuple[Section, Suspects]:
    """Find bad photos, points whose rays miss each other, and control far from its rays.

    `unit` is the printed unit of image coordinates.
    """
    section = section_of("gross")
    rays, bad = _bad_photos(Rays.of(block, unit=unit), section)
    sizes = rays.intersect().sizes
    usual = _medians(block, sizes, rays.used)[block.image_photos]
    points = np.zeros(len(block.point_ids), dtype=bool)
    points[block.image_points[rays.used & (sizes > MISSING * np.maximum(usual, block.image_sd.max()))]] = True
    return section, Suspects(bad, points, _control(rays.without(points[block.image_points]), section))


def _bad_photos(rays: Rays, section: Section) -> tuple[Rays, Bools]:
    """Exclude the photo without which the others fit best, until none is conspicuous."""
    block = rays.block
    bad = np.zeros(len(block.photo_ids), dtype=bool)
    for step in range(MOST_PHOTOS + 1):
        medians = _medians(block, rays.intersect().sizes, rays.used)
        known = np.flatnonzero(medians > 0)
        if step == 0 and known.size:
            usual = float(np.median(medians[known]))
            section.figure("median residual of a photo", f"{usual:.4f} {rays.unit}")
        if len(known) < 4 or step == MOST_PHOTOS:
            break
        worst = _worst(rays, medians, known)
        if worst is None:
            break
        photo, usual, rays = worst
        bad[photo] = True
        name, size, unit = block.photo_ids[photo], float(medians[photo]), rays.unit
        fields = {"photo": name, "residual": size, "others": usual, "unit": unit}
        values = {f"median_residual_{unit}": size, "times_usual": size / usual}
        section.note("grave", "check.bad-photo.residuals", [name], [], values, **fields)
    return rays, bad


def _worst(rays: Rays, medians: Floats, known: Indices) -> tuple[int, float, Rays] | None:
    """Return the worst photo, and the median of the others and rays without it.

    A bad photo affects the medians of its neighbours, in a small block of all photos. So the photo is
    compared with the others after its removal.
    """
    block = rays.block
    doubtful = known[medians[known] > BAD_PHOTO * np.quantile(medians[known], 0.25)]
    tried = []
    for photo in doubtful[np.argsort(-medians[doubtful], kind="stable")][:CANDIDATES].tolist():
        without = rays.without(block.image_photos == photo)
        others = _medians(block, without.intersect().sizes, without.used)
        logs = np.log(others[others > 0])
        if len(logs) >= 3:
            tried.append((float(logs.mean()), photo, logs, without))
    if not tried:
        return None
    _, photo, logs, without = min(tried, key=lambda each: each[:2])
    middle = float(np.median(logs))
    if np.log(medians[photo]) - middle < max(np.log(BAD_PHOTO), BAD_PHOTO_SD * mad_sd(logs - middle)):
        return None
    return photo, float(np.exp(middle)), without


def _medians(block: Block, sizes: Floats, used: Bools) -> Floats:
    """(P,) median size of each photo's residuals; NaN with fewer than three."""
    rows = np.flatnonzero(used & np.isfinite(sizes))
    order = rows[np.lexsort((sizes[rows], block.image_photos[rows]))]
    photos, starts, counts = np.unique(block.image_photos[order], return_index=True, return_counts=True)
    medians = np.full(len(block.photo_ids), np.nan)
    enough = counts >= 3
    medians[photos[enough]] = sizes[order][(starts + counts // 2)[enough]]
    return medians


def _control(rays: Rays, section: Section) -> Bools:
    """Compare control with intersected positions; report and return (n,) conspicuous differences."""
    block = rays.block
    held = np.isfinite(block.point_sd)
    met = rays.intersect().positions
    control = np.flatnonzero(held.any(axis=1) & np.isfinite(met).all(axis=1))
    if not control.size:
        section.remark("check.remark.no-control")
        return np.zeros(len(block.point_ids), dtype=bool)
    given = np.where(held[control], block.point_positions[control], rays.axes.from_local(met[control]))
    differences = np.where(held[control], met[control] - rays.axes.positions(given), np.nan)
    for axis, name in enumerate(("east", "north", "up") if block.geographic else ("X", "Y", "Z")):
        _control_component(block, control, differences[:, axis], name, section)
    return np.isin(
        block.point_ids, [*chain(*(each.points for each in section.findings if each.level == "grave"))]
    )


def _control_component(
    block: Block, control: Indices, differences: Floats, name: str, section: Section
) -> None:
    """Report the control points whose difference in one component is conspicuous."""
    known = np.flatnonzero(np.isfinite(differences))
    if not known.size:
        return
    unit, middle = block.linear_unit, float(np.median(differences[known]))
    spread = mad_sd(differences - middle)
    section.figure(
        f"control, intersected minus given, {name}",
        f"median {middle:.3f} {unit}, spread {spread:.3f} {unit} ({len(known)} points)",
    )
    if len(known) < FEWEST_CONTROL or spread == 0:
        return
    # The spread of few points is uncertain.
    sizes = np.abs(differences[known] - middle) / spread / (1 + FEWEST_CONTROL / len(known))
    for row, size in zip(known.tolist(), sizes.tolist(), strict=True):
        if size > CONTROL_LOOK:
            point, difference = block.point_ids[control[row]], float(differences[row])
            fields = {"point": point, "axis": name, "difference": difference, "unit": unit}
            level: Level = "grave" if size > CONTROL_GRAVE else "look"
            values = {f"difference_{name}": difference}
            section.note(level, "check.control-difference", [], [point], values, **fields)
