"""Stations off the path of their strip, and outlying two-ray heights (Appendix H)."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.findings import Level, Section, section_of
from photogram.diagnosis.tested_values import MAD_TO_SD, grouped
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.point_sets import strips_of
from photogram.network.rays import local_axes
from photogram.results.result import Result

LOOK, GRAVE = 8.0, 20.0
"""Departures from the path, in robust standard deviations of all departures of their type."""
FEW = 4  # Number of free departures for which limits are doubled
MOVED, WRONG = 10.0, 25.0  # Changes from the initial to the adjusted station, in the same unit
TINY = 1e-9  # A spread below this is rounding: radians, or the linear unit
UPRIGHT = 0.8  # Least vertical component of the z axis of a photo that looks down
FEWEST = 5  # Photos of a strip needed to fit a path
SMOOTH_POSITION, SMOOTH_ANGLE = 1e-3, 1e-3  # Ignored departures: relative to the base, and radians
QUANTITIES = ("across the strip", "height", "omega", "phi", "kappa")
"""Angles are between the photo and its strip, ground-to-photo."""
DEGREES = float(np.degrees(1.0))


def stations(block: Block, result: Result | None) -> Section:
    """Compare stations with the straight path of their strip and initial values."""
    section = section_of("stations")
    which = "initial"
    if result is not None:
        _moved(block, result, section)
        poses = {"photo_positions": result.photo_positions, "photo_attitudes": result.photo_attitudes}
        block, which = result.block.replace(**poses), "adjusted"
    if not flown(block):
        section.remark("check.remark.no-paths")
        return section
    axes = local_axes(block)
    positions, heights, cameras = (
        axes.positions(block.photo_positions),
        block.photo_positions[:, 2],
        axes.cameras(),
    )
    strips = strips_of(positions)
    long = [strip for strip in strips if len(strip) >= FEWEST]
    section.remark(f"check.remark.{which}-paths", n=len(strips), judged=len(long), fewest=FEWEST)
    if long:
        departures = [_departures(positions[own], heights[own], cameras[own]) for own in long]
        _compare(block, long, departures, which, section)
    return section


def flown(block: Block) -> bool:
    """Whether most photos look down; otherwise path and ground are undefined."""
    return float(np.median(local_axes(block).cameras()[:, 2, 2])) > UPRIGHT


def _departures(positions: Floats, heights: Floats, cameras: Floats) -> Floats:
    """(k, 5) departures of strip photos from their path: a line by medians of slopes (Theil and Sen)."""
    half = len(positions) // 2
    along = np.median(positions[-half:], axis=0) - np.median(positions[:half], axis=0)
    along[2] = 0.0
    along /= np.linalg.norm(along)
    frame = np.array([along, np.cross([0.0, 0.0, 1.0], along), [0.0, 0.0, 1.0]])
    angles = geometry.rotation_angles(np.ascontiguousarray(cameras.transpose(0, 2, 1) @ frame.T))
    middle = np.angle(np.median(np.cos(angles), axis=0) + 1j * np.median(np.sin(angles), axis=0))
    place = positions @ frame.T
    values = np.column_stack([place[:, 1], heights, np.angle(np.exp(1j * (angles - middle)))])
    one, other = np.triu_indices(len(values), 1)
    steps = place[one, 0] - place[other, 0]
    slopes = np.median((values[one] - values[other])[steps != 0] / steps[steps != 0, np.newaxis], axis=0)
    values -= place[:, :1] * slopes
    values -= np.median(values, axis=0)
    values[:, 2:] = np.angle(np.exp(1j * values[:, 2:]))
    return values


def _spread(departures: list[Floats]) -> Floats:
    """Return the robust spread of departures; a line passes through two photos of each strip."""
    free = np.vstack([np.sort(np.abs(own), axis=0)[2:] for own in departures])
    return np.asarray(MAD_TO_SD * np.median(free, axis=0))


def _compare(
    block: Block, strips: list[Indices], departures: list[Floats], which: str, section: Section
) -> None:
    """Report the photos that depart from the path far more than photos usually do."""
    # The spread of few departures is uncertain.
    usual, doubt = _spread(departures), 1 + FEW / sum(len(own) - 2 for own in departures)
    floor = np.array([SMOOTH_POSITION * _base(block)] * 2 + [SMOOTH_ANGLE] * 3)
    units, factors = [block.linear_unit] * 2 + ["deg"] * 3, np.array([1.0] * 2 + [DEGREES] * 3)
    for name, spread, unit in zip(QUANTITIES, usual * factors, units, strict=True):
        section.figure(f"spread about the path, {name}", f"{spread:.4f} {unit}")
    for strip, own in zip(strips, departures, strict=True):
        sizes = np.abs(own) / np.maximum(np.maximum(usual, _spread([own])), floor)
        for row, k in np.argwhere(sizes > LOOK * doubt).tolist():
            departure, times = float(own[row, k] * factors[k]), float(sizes[row, k] / doubt)
            photo = block.photo_ids[strip[row]]
            fields = {"photo": photo, "quantity": QUANTITIES[k], "unit": units[k], "times": times}
            level: Level = "grave" if times > GRAVE else "look"
            code, values = f"check.outlying-station.{which}", {"departure": departure, "times_usual": times}
            section.note(level, code, [photo], [], values, departure=departure, **fields)


def _moved(given: Block, result: Result, section: Section) -> None:
    """Report the stations that the adjustment moved far more than the others."""
    block = result.block
    if len(block.photo_ids) - len(block.mounts) < FEWEST:
        return
    rows = {name: row for row, name in enumerate(given.photo_ids)}
    own = [rows[name] for name in block.photo_ids]
    axes = local_axes(given)
    shifts = axes.positions(result.photo_positions) - axes.positions(given.photo_positions)[own]
    # Rotation vectors, because angles also differ for equal attitudes near phi = 90 degrees.
    before, after = (
        geometry.photo_axes(attitudes, block.photo_to_ground)
        for attitudes in (given.photo_attitudes[own], result.photo_attitudes)
    )
    turns = _photocore.rotation_vectors(np.ascontiguousarray(before.transpose(0, 2, 1) @ after))
    # Photos on frames do not have poses of their own.
    free = ~np.isin(block.photo_ids, [each.photo for each in block.mounts])
    for what, changes, unit, factor, small in (
        ("position", shifts, block.linear_unit, 1.0, SMOOTH_POSITION * _base(given)),
        ("attitude", turns, "deg", DEGREES, SMOOTH_ANGLE),
    ):
        spread = MAD_TO_SD * np.median(np.abs(changes[free]), axis=0)
        listed = ", ".join(f"{each * factor:.4f}" for each in spread)
        section.figure(f"usual change of {what} by the adjustment", f"{listed} {unit}")
        sizes = np.abs(changes) / np.maximum(spread, TINY)
        large = free & (sizes.max(axis=1) > MOVED) & (np.abs(changes).max(axis=1) >= small)
        for photo in np.flatnonzero(large).tolist():
            k, name = int(sizes[photo].argmax()), block.photo_ids[photo]
            change, times = float(changes[photo, k] * factor), float(sizes[photo, k])
            wrong = times > WRONG
            fields = {"photo": name, "change": change, "unit": unit, "times": times}
            level: Level = "grave" if wrong else "look"
            code, values = (
                f"check.moved-station.{'wrong' if wrong else what}",
                {"change": change, "times_usual": times},
            )
            section.note(level, code, [name], [], values, **fields)


def _base(block: Block) -> float:
    """Return the median distance between consecutive photos; 0 for a single photo."""
    positions = local_axes(block).positions(block.photo_positions)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return float(np.median(steps)) if steps.size else 0.0


NEIGHBOURS = 8  # Points of a local plane
DEPARTURE = 6.0  # Departures from the plane in robust standard deviations of all


def two_ray_heights(result: Result) -> Section:
    """Compare two-ray point heights with the plane of their nearest neighbours on the same photos."""
    section = section_of("two-ray-heights")
    block, used = result.block, result.used_points
    if not flown(block):
        section.remark("check.remark.no-ground")
        return section
    plan = local_axes(block).positions(result.point_positions)[:, :2]
    heights = result.point_positions[:, 2]
    two = np.flatnonzero(used & (result.point_rays == 2) & ~np.isfinite(block.point_sd[:, 2]))
    on_photos = grouped(block.image_points, block.image_photos, len(block.photo_ids))
    of_points = grouped(block.image_photos, block.image_points, len(block.point_ids))
    judged, departures, cofactors = list[int](), list[float](), list[float]()
    for point in two.tolist():
        others = np.unique(np.concatenate([on_photos[photo] for photo in of_points[point].tolist()]))
        others = others[used[others] & (others != point)]
        if len(others) >= NEIGHBOURS:
            distances = np.linalg.norm(plan[others] - plan[point], axis=1)
            near = others[np.argsort(distances, kind="stable")[:NEIGHBOURS]]
            height, cofactor = _plane(plan[near] - plan[point], heights[near] - heights[point])
            judged.append(point)
            departures.append(-height)
            cofactors.append(cofactor)
    count, whole, unit = len(two), int(used.sum()), block.linear_unit
    if not judged:
        section.remark("check.remark.no-neighbours", n=count, count=whole)
        return section
    # Outside the neighbours the plane is uncertain.
    extrapolation = np.sqrt(1 + np.array(cofactors))
    own_sd = np.sqrt(np.maximum(result.point_covariances[judged, 2, 2], 0))
    spread = MAD_TO_SD * float(np.median(np.abs(departures) / extrapolation))
    section.figure("two-ray points", f"{count} of {whole}")
    section.figure("spread about the planes of their neighbours", f"{spread:.3f} {unit}")
    section.figure("median standard deviation of their heights", f"{float(np.median(own_sd)):.3f} {unit}")
    scale = np.maximum(spread * extrapolation, own_sd)
    for row in np.flatnonzero(np.abs(departures) > DEPARTURE * scale).tolist():
        name, photos = block.point_ids[judged[row]], [block.photo_ids[p] for p in of_points[judged[row]]]
        values = {"departure": departures[row], "usual": float(scale[row])}
        fields = {"point": name, "unit": unit, "photos": photos, **values}
        section.note("look", "check.two-ray-height", photos, [name], values, **fields)
    return section


def _plane(offset: Floats, heights: Floats) -> tuple[float, float]:
    """Return the height of a plane at the origin without the worst of (k, 2) points, and its cofactor."""
    design = np.column_stack([np.ones(len(offset)), offset / max(float(np.abs(offset).max()), 1e-300)])
    kept = np.ones(len(offset), dtype=bool)
    for last in (False, True):
        # Neighbours in a row do not define a plane: a small weight on a level plane gives the mean.
        normal = design[kept].T @ design[kept] + np.diag([0.0, 1e-6, 1e-6])
        plane = np.linalg.solve(normal, design[kept].T @ heights[kept])
        kept[np.abs(heights - design @ plane).argmax()] = last
    return float(plane[0]), float(np.linalg.inv(normal)[0, 0])
