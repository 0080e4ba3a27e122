"""Stations off the path of their strip, and outlying two-ray heights (Appendix H)."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.findings import Level, Section, note, section_of
from photogram.diagnosis.robust import MAD_TO_SD, fit
from photogram.lazy_dataclasses import dataclass
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.rays import local_axes
from photogram.network.strips import strips_of
from photogram.results.result import Result
from photogram.words import phrase

LOOK, GRAVE = 8.0, 20.0
"""Departures from the path, in robust standard deviations of all departures of their type."""
FEW = 4  # Number of free departures for which limits are doubled
MOVED, WRONG = 10.0, 25.0  # Changes from the initial to the adjusted station, in the same unit
TINY = 1e-9  # A spread below this is rounding: radians, or the linear unit
UPRIGHT = 0.8  # Least vertical component of the z axis of a photo that looks down
FEWEST = 5  # Photos of a strip needed to fit a path
CURVED = 15  # Photos of a strip needed to fit a curved path
SMOOTH_POSITION, SMOOTH_ANGLE = 1e-3, 1e-3  # Ignored departures: relative to the base, and radians
QUANTITIES = ("across the strip", "height", "omega", "phi", "kappa")
"""Angles are between the photo and its strip, ground-to-photo."""


def stations(block: Block, result: Result | None) -> Section:
    """Compare stations with the smooth path of their strip and initial values."""
    section = section_of("stations")
    which = "initial"
    if result is not None:
        _moved(block, result, section)
        block = result.block.replace(
            photo_positions=result.photo_positions, photo_attitudes=result.photo_attitudes
        )
        which = "adjusted"
    axes = local_axes(block)
    positions, cameras = axes.positions(block.photo_positions), axes.cameras()
    if not flown(block):
        section.remark("check.remark.no-paths")
        return section
    strips = strips_of(positions)
    heights = block.photo_positions[:, 2]
    paths = [
        _path(positions[strip], heights[strip], cameras[strip]) for strip in strips if len(strip) >= FEWEST
    ]
    section.remark(f"check.remark.{which}-paths", n=len(strips), judged=len(paths), fewest=FEWEST)
    if paths:
        _compare(block, [strip for strip in strips if len(strip) >= FEWEST], paths, which, section)
    return section


def flown(block: Block) -> bool:
    """Whether most photos look down; otherwise path and ground are undefined."""
    return float(np.median(local_axes(block).cameras()[:, 2, 2])) > UPRIGHT


@dataclass(frozen=True)
class _Path:
    """Departures (k, 5) of strip photos from their path, and sizes of its fit.

    A robust fit passes through as many photos as it has coefficients. `free` are the other sizes (k - 2, 5),
    or (k - 3, 5) of a curved path.
    """

    departures: Floats
    free: Floats


def _path(positions: Floats, heights: Floats, cameras: Floats) -> _Path:
    half = len(positions) // 2
    along = np.median(positions[-half:], axis=0) - np.median(positions[:half], axis=0)
    along[2] = 0.0
    along /= np.linalg.norm(along)
    frame = np.array([along, np.cross([0.0, 0.0, 1.0], along), [0.0, 0.0, 1.0]])
    angles = geometry.rotation_angles(np.ascontiguousarray(cameras.transpose(0, 2, 1) @ frame.T))
    middle = np.angle(np.median(np.cos(angles), axis=0) + 1j * np.median(np.sin(angles), axis=0))
    angles = np.angle(np.exp(1j * (angles - middle)))
    place = positions @ frame.T
    values = np.column_stack([place[:, 1], heights, angles])
    t = (place[:, 0] - place[:, 0].mean()) / max(float(np.ptp(place[:, 0])), 1e-300)
    degree = 2 if len(t) >= CURVED else 1
    design = np.vander(t, degree + 1)
    # Each quantity is fitted separately: a wrong height does not affect kappa.
    columns = [values[:, [k]] - design @ fit(design, values[:, [k]]) for k in range(values.shape[1])]
    departures = np.hstack(columns)
    departures[:, 2:] = np.angle(np.exp(1j * departures[:, 2:]))
    return _Path(departures, np.sort(np.abs(departures), axis=0)[degree + 1 :])


def _spread(sizes: Floats) -> Floats:
    spread: Floats = MAD_TO_SD * np.median(sizes, axis=0)
    return spread


def _compare(block: Block, strips: list[Indices], paths: list[_Path], which: str, section: Section) -> None:
    """Report the photos that depart from the path far more than photos usually do."""
    free = np.vstack([path.free for path in paths])
    # The spread of few departures is uncertain.
    usual, doubt = _spread(free), 1 + FEW / len(free)
    base = _base(block)
    floor = np.array([SMOOTH_POSITION * base] * 2 + [SMOOTH_ANGLE] * 3)
    units = [block.linear_unit] * 2 + ["deg"] * 3
    factors = np.array([1.0, 1.0, *[np.degrees(1.0)] * 3])
    for name, spread, unit in zip(QUANTITIES, usual * factors, units, strict=True):
        section.figure(f"spread about the path, {name}", f"{spread:.4f} {unit}")
    for strip, path in zip(strips, paths, strict=True):
        scale = np.maximum(np.maximum(usual, _spread(path.free)), floor)
        for row, k in np.argwhere(np.abs(path.departures) > LOOK * doubt * scale).tolist():
            size = abs(path.departures[row, k]) / scale[k] / doubt
            departure, photo = float(path.departures[row, k] * factors[k]), block.photo_ids[strip[row]]
            message = phrase(
                f"check.outlying-station.{which}",
                photo=photo,
                quantity=QUANTITIES[k],
                departure=departure,
                unit=units[k],
                times=float(size),
            )
            level: Level = "grave" if size > GRAVE else "look"
            note(
                section, level, message, [photo], values={"departure": departure, "times_usual": float(size)}
            )


def _moved(given: Block, result: Result, section: Section) -> None:
    """Report the stations that the adjustment moved far more than the others."""
    block = result.block
    if len(block.photo_ids) - len(block.mounts) < FEWEST:
        return
    rows = {name: row for row, name in enumerate(given.photo_ids)}
    own = [rows[name] for name in block.photo_ids]
    axes, base = local_axes(given), _base(given)
    shifts = axes.positions(result.photo_positions) - axes.positions(given.photo_positions)[own]
    # Rotation vectors, because angles also differ for equal attitudes near phi = 90 degrees.
    before, after = (
        geometry.photo_axes(attitudes, block.photo_to_ground)
        for attitudes in (given.photo_attitudes[own], result.photo_attitudes)
    )
    turns = _photocore.rotation_vectors(np.ascontiguousarray(before.transpose(0, 2, 1) @ after))
    unit = block.linear_unit
    # Photos on frames do not have poses of their own.
    mounted = np.isin(block.photo_ids, [each.photo for each in block.mounts])
    for what, changes, shown, factor in (
        ("position", shifts, unit, 1.0),
        ("attitude", turns, "deg", float(np.degrees(1.0))),
    ):
        spread = MAD_TO_SD * np.median(np.abs(changes[~mounted]), axis=0)
        sizes = np.abs(changes) / np.maximum(spread, TINY)
        listed = ", ".join(f"{each * factor:.4f}" for each in spread)
        section.figure(f"usual change of {what} by the adjustment", f"{listed} {shown}")
        small = np.abs(changes).max(axis=1) < (SMOOTH_ANGLE if what == "attitude" else SMOOTH_POSITION * base)
        for photo in np.flatnonzero((sizes.max(axis=1) > MOVED) & ~small & ~mounted).tolist():
            k = int(sizes[photo].argmax())
            name = block.photo_ids[photo]
            change, times = float(changes[photo, k] * factor), float(sizes[photo, k])
            wrong = times > WRONG
            message = phrase(
                f"check.moved-station.{'wrong' if wrong else what}",
                photo=name,
                change=change,
                unit=shown,
                times=times,
            )
            note(
                section,
                "grave" if wrong else "look",
                message,
                [name],
                values={"change": change, "times_usual": times},
            )


def _base(block: Block) -> float:
    """Return the median distance between consecutive photos; 0 for a single photo."""
    positions = local_axes(block).positions(block.photo_positions)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return float(np.median(steps)) if steps.size else 0.0


NEIGHBOURS = 8  # Points of a local plane
DEPARTURE = 6.0  # Departures from the plane in robust standard deviations of all


def two_ray_heights(result: Result) -> Section:
    """Compare two-ray point heights with the plane of their nearest neighbours."""
    section = section_of("two-ray-heights")
    block = result.block
    if not flown(block):
        section.remark("check.remark.no-ground")
        return section
    known = np.flatnonzero(result.used_points)
    positions = local_axes(block).positions(result.point_positions[known])
    heights = result.point_positions[known, 2]
    two = np.flatnonzero((result.point_rays[known] == 2) & ~np.isfinite(block.point_sd[known, 2]))
    count = len(two)
    two, near = _neighbours(block, positions[:, :2], known, two)
    if not two.size:
        section.remark("check.remark.no-neighbours", n=count, count=len(known))
        return section
    departures, extrapolation = _above_planes(positions[:, :2], heights, two, near)
    own_sd = np.sqrt(np.maximum(result.point_covariances[known[two], 2, 2], 0))
    spread = MAD_TO_SD * float(np.median(np.abs(departures) / extrapolation))
    unit = block.linear_unit
    section.figure("two-ray points", f"{count} of {len(known)}")
    section.figure("spread about the planes of their neighbours", f"{spread:.3f} {unit}")
    section.figure("median standard deviation of their heights", f"{float(np.median(own_sd)):.3f} {unit}")
    scale = np.maximum(spread * extrapolation, own_sd)
    for row in np.flatnonzero(np.abs(departures) > DEPARTURE * scale).tolist():
        name = block.point_ids[known[two[row]]]
        photos = [block.photo_ids[p] for p in block.image_photos[block.image_points == known[two[row]]]]
        values = {"departure": float(departures[row]), "usual": float(scale[row])}
        message = phrase("check.two-ray-height", point=name, unit=unit, photos=photos, **values)
        note(section, "look", message, photos, [name], values=values)
    return section


def _above_planes(plan: Floats, heights: Floats, rows: Indices, near: Indices) -> tuple[Floats, Floats]:
    """Return (k,) heights above planes of neighbours, without the worst neighbour.

    Also returns (k,) the uncertainty of the plane at the point: the root of 1 + its cofactor, which is large
    outside the neighbours.
    """
    offset = plan[near] - plan[rows][:, np.newaxis]
    scale = np.maximum(np.abs(offset).max(axis=(1, 2)), 1e-300)
    design = np.concatenate([np.ones((*near.shape, 1)), offset / scale[:, np.newaxis, np.newaxis]], axis=2)
    # Relative to the point itself, so that large heights lose no digits.
    z = heights[near] - heights[rows][:, np.newaxis]
    weights = np.ones(near.shape)
    plane, cofactors = _planes(design, z, weights)
    left = np.abs(z - np.einsum("nkj,nj->nk", design, plane))
    weights[np.arange(len(rows)), left.argmax(axis=1)] = 0
    plane, cofactors = _planes(design, z, weights)
    return -plane[:, 0], np.sqrt(1 + cofactors)


def _planes(design: Floats, z: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return (n, 3) plane coefficients, and (n,) cofactors of height at the origin."""
    normal = np.einsum("nki,nk,nkj->nij", design, weights, design)
    # Neighbours in a row do not define a plane: a small weight on a level plane gives the mean.
    normal[:, 1:, 1:] += 1e-6 * np.eye(2)
    inverse = np.linalg.inv(normal)
    right = np.einsum("nki,nk,nk->ni", design, weights, z)
    return np.einsum("nij,nj->ni", inverse, right), inverse[:, 0, 0]


def _neighbours(block: Block, plan: Floats, known: Indices, rows: Indices) -> tuple[Indices, Indices]:
    """Return the rows of points with enough others on their photos, and (k, 8) the nearest of these in plan.

    Rows and nearest points are indices of the `known` points with (n, 2) positions `plan`.
    """
    place = np.full(len(block.point_ids), -1)
    place[known] = np.arange(len(known))
    points, photos = place[block.image_points], block.image_photos
    on_photos, of_points = _grouped(points, photos), _grouped(photos, block.image_points)
    enough, near = [], []
    for row in rows.tolist():
        others = np.unique(np.concatenate([on_photos[photo] for photo in of_points[known[row]].tolist()]))
        others = others[(others >= 0) & (others != row)]
        if len(others) >= NEIGHBOURS:
            distances = np.linalg.norm(plan[others] - plan[row], axis=1)
            enough.append(row)
            near.append(others[np.argsort(distances, kind="stable")[:NEIGHBOURS]])
    return np.array(enough, dtype=np.int64), np.array(near, dtype=np.int64).reshape(-1, NEIGHBOURS)


def _grouped(values: Indices, rows: Indices) -> list[Indices]:
    """Return the values with each row number."""
    order = np.argsort(rows, kind="stable")
    return np.split(values[order], np.cumsum(np.bincount(rows))[:-1])
