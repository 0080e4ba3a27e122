"""Patterns of residuals: by rays, photos, across the frame (Appendix H)."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.findings import Section, section_of, small_unit
from photogram.network.block import Block
from photogram.network.directions import without_lenses
from photogram.network.rays import frame_radius
from photogram.results.result import Result
from photogram.show.quantity import Axis, Table, column
from photogram.statistics.limits import normal_limit
from photogram.statistics.patterns import group_patterns

CHANCE = 0.01  # Probability that any photo of a correct network is named
WORTH = 0.3  # Notable amplitude of a common pattern (sd of an image coordinate)
ROUNDING = 0.01  # Least used sd of residuals (sd of an image coordinate)


def residuals(result: Result, spread: float) -> Section:
    """Describe residuals and test patterns; `spread` is the robust sd of test values."""
    section = section_of("patterns")
    _by_rays(result, section)
    plain = without_lenses(result.block)
    if len(plain.image_xy) < len(result.block.image_xy):
        section.remark("check.remark.outside-lens")
        return section
    spread = max(spread, ROUNDING)
    _frame_pattern(result, plain, spread, section)
    _photo_patterns(result, spread, section)
    return section


def _by_rays(result: Result, section: Section) -> None:
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


def _terms(xy: Floats, size: float) -> tuple[list[str], Floats]:
    """Patterns over the frame that no pose absorbs: names, and (k, terms, 2) values."""
    x, y = (xy / size).T
    r2, zero = x**2 + y**2, np.zeros_like(x)
    patterns = {
        "scale of x against y": (x, -y),
        "shear": (y, x),
        "radial distortion": (x * r2, y * r2),
        "tangential distortion, x": (r2 + 2 * x**2, 2 * x * y),
        "tangential distortion, y": (2 * x * y, r2 + 2 * y**2),
        "bend of y over x": (zero, x**2),
        "bend of x over y": (y**2, zero),
    }
    return list(patterns), np.stack([np.column_stack(each) for each in patterns.values()], axis=1)


def _frame_pattern(result: Result, plain: Block, spread: float, section: Section) -> None:
    """Find a common pattern of all photos: lens, film, or plate reduction."""
    block, used = result.block, result.used_images
    size = frame_radius(plain)
    unit, factor = small_unit(block.image_unit)
    names, terms = _terms(plain.image_xy[used], size)
    sd = block.image_sd[used]
    usual = float(np.median(sd))
    limit = normal_limit(len(names), CHANCE)
    for index, name in enumerate(names):
        design = terms[:, index] / sd
        norm = float((design**2).sum())
        if norm == 0:
            continue
        amplitude = float((design * (result.residuals[used] / sd)).sum()) / norm
        significance = abs(amplitude) * math.sqrt(norm) / spread
        section.figure(
            f"pattern of all photos, {name}",
            f"{factor * amplitude:.2f} {unit} at {size:.0f} {block.image_unit} from the centre"
            f" ({significance:.1f} standard deviations)",
        )
        if significance > limit and abs(amplitude) > WORTH * usual:
            fields = {"pattern": name, "amplitude": factor * amplitude, "unit": unit}
            fields |= {"radius": size, "image_unit": block.image_unit}
            values = {f"amplitude_{unit}": factor * amplitude, "significance_sd": significance}
            section.note("look", "check.systematic-pattern", [], [], values, **fields)


def _photo_patterns(result: Result, spread: float, section: Section) -> None:
    """Find photos whose residuals have a shift or a linear form of their own."""
    block, used = result.block, result.used_images
    count = len(block.photo_ids)
    unit, factor = small_unit(block.image_unit)
    photos, residuals = block.image_photos[used], result.residuals[used]
    given = block.image_xy[used], residuals / block.image_sd[used] / spread, result.redundancy[used]
    statistics, probabilities = group_patterns(photos, count, *given)
    tested = np.isfinite(statistics)
    for photo in np.flatnonzero(probabilities < CHANCE / max(int(tested.sum()), 1)).tolist():
        x, y = (factor * residuals[photos == photo].mean(axis=0)).tolist()
        fields = {"x": x, "y": y, "unit": unit, "statistic": float(statistics[photo])}
        values = {f"mean_x_{unit}": x, f"mean_y_{unit}": y, "statistic": fields["statistic"]}
        name = block.photo_ids[photo]
        section.note("look", "check.photo-pattern", [name], [], values, photo=name, **fields)
    section.figure("photos tested for a pattern of their own", f"{int(tested.sum())} of {count}")
