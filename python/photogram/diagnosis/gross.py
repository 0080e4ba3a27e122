"""Suspects at initial stations, by intersection: photos and control (Appendix H)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.diagnosis.findings import Level, Section, section_of
from photogram.diagnosis.tested_values import grouped, mad_sd
from photogram.network.block import Block
from photogram.network.motion import kept_images, of_photos
from photogram.network.rays import Rays

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
        photos, points = (np.zeros(len(ids), dtype=bool) for ids in (block.photo_ids, block.point_ids))
        return cls(photos, points, points)

    def excluded_from(self, block: Block) -> Block:
        return of_photos(kept_images(block, ~self.points[block.image_points]), ~self.photos)


def gross(block: Block, unit: str = "mm") -> tuple[Section, Suspects]:
    """Find bad photos, points whose rays miss each other, and control far from its rays.

    `unit` is the printed unit of image coordinates.
    """
    section = section_of("gross")
    rays, bad = _bad_photos(Rays.of(block, unit=unit), section)
    sizes = rays.intersect().sizes
    usual = _medians(rays)[block.image_photos]
    points = np.zeros(len(block.point_ids), dtype=bool)
    points[block.image_points[rays.used & (sizes > MISSING * np.maximum(usual, block.image_sd.max()))]] = True
    # Data snooping cannot reinstate two rays that are both excluded.
    points &= np.bincount(block.image_points, minlength=len(points)) > 2
    return section, Suspects(bad, points, _control(rays.without(points[block.image_points]), section))


def _bad_photos(rays: Rays, section: Section) -> tuple[Rays, Bools]:
    """Exclude the photo without which the others fit best, until none is conspicuous.

    A bad photo affects the medians of its neighbours, in a small block of all photos. So a photo is compared
    with the others after its removal.
    """
    block, unit, medians = rays.block, rays.unit, _medians(rays)
    bad = np.zeros(len(block.photo_ids), dtype=bool)
    if (medians > 0).any():
        usual = float(np.median(medians[medians > 0]))
        section.figure("median residual of a photo", f"{usual:.4f} {unit}")
    for _ in range(MOST_PHOTOS):
        known = np.flatnonzero(medians > 0)
        if len(known) < 4:
            break
        doubtful = known[medians[known] > BAD_PHOTO * np.quantile(medians[known], 0.25)]
        tried = []
        for photo in doubtful[np.argsort(-medians[doubtful], kind="stable")][:CANDIDATES].tolist():
            without = rays.without(block.image_photos == photo)
            others = _medians(without)
            logs = np.log(others[others > 0])
            if len(logs) >= 3:
                tried.append((float(logs.mean()), photo, logs, others, without))
        if not tried:
            break
        _, photo, logs, others, without = min(tried, key=lambda each: each[:2])
        middle, size, name = float(np.median(logs)), float(medians[photo]), block.photo_ids[photo]
        if np.log(size) - middle < max(np.log(BAD_PHOTO), BAD_PHOTO_SD * mad_sd(logs - middle)):
            break
        bad[photo], rays, medians, usual = True, without, others, float(np.exp(middle))
        fields = {"photo": name, "residual": size, "others": usual, "unit": unit}
        values = {f"median_residual_{unit}": size, "times_usual": size / usual}
        section.note("grave", "check.bad-photo.residuals", [name], [], values, **fields)
    return rays, bad


def _medians(rays: Rays) -> Floats:
    """(P,) median size of each photo's residuals; NaN with fewer than three."""
    block, sizes = rays.block, rays.intersect().sizes
    rows = np.flatnonzero(rays.used & np.isfinite(sizes))
    each_photo = grouped(sizes[rows], block.image_photos[rows], len(block.photo_ids))
    return np.array([np.sort(own)[len(own) // 2] if len(own) >= 3 else np.nan for own in each_photo])


def _control(rays: Rays, section: Section) -> Bools:
    """Compare control with intersected positions; report and return (n,) conspicuous differences."""
    block, unit = rays.block, rays.block.linear_unit
    held, met = np.isfinite(block.point_sd), rays.intersect().positions
    wrong = np.zeros(len(block.point_ids), dtype=bool)
    if not (held.any(axis=1) & np.isfinite(met).all(axis=1)).any():
        section.remark("check.remark.no-control")
        return wrong
    given = np.where(held, block.point_positions, rays.axes.from_local(met))
    differences = np.where(held, met - rays.axes.positions(given), np.nan)
    for axis, name in enumerate(("east", "north", "up") if block.geographic else ("X", "Y", "Z")):
        known = np.flatnonzero(np.isfinite(differences[:, axis]))
        if not known.size:
            continue
        own = differences[known, axis]
        middle = float(np.median(own))
        spread = mad_sd(own - middle)
        section.figure(
            f"control, intersected minus given, {name}",
            f"median {middle:.3f} {unit}, spread {spread:.3f} {unit} ({len(known)} points)",
        )
        if len(known) < FEWEST_CONTROL or spread == 0:
            continue
        # The spread of few points is uncertain.
        sizes = np.abs(own - middle) / spread / (1 + FEWEST_CONTROL / len(known))
        wrong[known[sizes > CONTROL_GRAVE]] = True
        for row in np.flatnonzero(sizes > CONTROL_LOOK).tolist():
            point, difference = block.point_ids[known[row]], float(own[row])
            fields = {"point": point, "axis": name, "difference": difference, "unit": unit}
            level: Level = "grave" if sizes[row] > CONTROL_GRAVE else "look"
            values = {f"difference_{name}": difference}
            section.note(level, "check.control-difference", [], [point], values, **fields)
    return wrong
