"""Heights of two-ray points: errors along the flight line go there and leave no residual (Appendix H)."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.findings import Finding, Section
from photogram.diagnosis.robust import MAD_TO_SD
from photogram.diagnosis.stations import flown
from photogram.network.rays import local_axes
from photogram.results.result import Result

__all__ = ["neighbours", "two_ray_heights"]


NEIGHBOURS = 8
"""Points that a local plane rests on."""
DEPARTURE = 6.0
"""Departures from the plane in robust standard deviations of all."""
PER_CELL = 4
"""Points of a cell of the search grid, on average."""


def two_ray_heights(result: Result) -> Section:
    """Compare the height of every two-ray point with the plane of its nearest neighbours."""
    section = Section(
        "Heights of two-ray points",
        "With two rays an error along the flight line becomes an error of height and leaves no residual.",
    )
    block = result.block
    if not flown(block):
        section.parts.append("the photos do not look down: there is no ground that heights are above")
        return section
    known = np.flatnonzero(result.used_points)
    positions = local_axes(block).positions(result.point_positions[known])
    heights = result.point_positions[known, 2]
    two = np.flatnonzero((result.point_rays[known] == 2) & ~np.isfinite(block.point_sd[known, 2]))
    if len(known) <= NEIGHBOURS + 1 or not two.size:
        section.parts.append(f"{len(two)} two-ray points of {len(known)}: nothing to compare")
        return section
    near = neighbours(positions[:, :2], two, NEIGHBOURS)
    departures, extrapolation = _departures(positions[:, :2], heights, two, near)
    own_sd = np.sqrt(np.maximum(result.point_covariances[known[two], 2, 2], 0))
    spread = MAD_TO_SD * float(np.median(np.abs(departures) / extrapolation))
    unit = block.linear_unit
    section.figure("two-ray points", f"{len(two)} of {len(known)}")
    section.figure("spread about the planes of their neighbours", f"{spread:.3f} {unit}")
    section.figure("median standard deviation of their heights", f"{float(np.median(own_sd)):.3f} {unit}")
    scale = np.maximum(spread * extrapolation, own_sd)
    for row in np.flatnonzero(np.abs(departures) > DEPARTURE * scale).tolist():
        name = block.point_ids[known[two[row]]]
        photos = [block.photo_ids[p] for p in block.image_photos[block.image_points == known[two[row]]]]
        text = (
            f"point {name} stands {departures[row]:.2f} {unit} off the plane of its neighbours (usual"
            f" {scale[row]:.2f} {unit}): look at its coordinates along the flight line on photos"
            f" {' and '.join(photos)}, unless the ground is like that"
        )
        values = {"departure": float(departures[row]), "usual": float(scale[row])}
        section.findings.append(Finding("two-ray-height", "look", text, photos, [name], values))
    return section


def _departures(plan: Floats, heights: Floats, rows: Indices, near: Indices) -> tuple[Floats, Floats]:
    """Heights above the planes of the neighbours, (k,), the neighbour that fits worst left out.

    With them (k,) how uncertain the plane is at the point: the root of 1 + its cofactor there, large outside
    the neighbours.
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
    """Coefficients (n, 3) of the planes, and the cofactor (n,) of their height at the origin."""
    normal = np.einsum("nki,nk,nkj->nij", design, weights, design)
    # Neighbours in a row give no plane: a little weight on level ground gives the mean across the row.
    normal[:, 1:, 1:] += 1e-6 * np.eye(2)
    inverse = np.linalg.inv(normal)
    right = np.einsum("nki,nk,nk->ni", design, weights, z)
    return np.einsum("nij,nj->ni", inverse, right), inverse[:, 0, 0]


def neighbours(plan: Floats, rows: Indices, count: int) -> Indices:
    """(k, count) the points nearest to each of some points in plan, themselves excepted.

    Points are sorted into square cells; the rings of cells around a point are searched until the nearest are
    certain, so that the work is in proportion to the points where they are spread evenly.

    Parameters
    ----------
    plan
        (n, 2) with n > count.
    rows
        (k,) the points whose neighbours are sought.
    count
        How many neighbours.
    """
    low, extent = plan.min(axis=0), np.ptp(plan, axis=0).max()
    cell = max(float(extent) * np.sqrt(PER_CELL / len(plan)), 1e-300)
    cells = np.floor((plan - low) / cell).astype(np.int64)
    width = int(cells.max()) + 1
    key = cells[:, 0] * width + cells[:, 1]
    order = np.argsort(key, kind="stable")
    sorted_key = key[order]

    def within(x: int, y: int, ring: int) -> Indices:
        columns = np.arange(max(x - ring, 0), min(x + ring, width - 1) + 1)
        first = np.searchsorted(sorted_key, columns * width + max(y - ring, 0), "left")
        last = np.searchsorted(sorted_key, columns * width + min(y + ring, width - 1), "right")
        return np.concatenate([order[a:b] for a, b in zip(first, last, strict=True)])

    found = np.empty((len(rows), count), dtype=np.int64)
    for index, row in enumerate(rows.tolist()):
        (x, y), ring = cells[row].tolist(), 1
        while True:
            candidates = within(x, y, ring)
            candidates = candidates[candidates != row]
            distances = np.hypot(*(plan[candidates] - plan[row]).T)
            # Everything within `ring` cells of the point has been seen.
            if len(candidates) >= count and (
                np.partition(distances, count - 1)[count - 1] <= ring * cell or ring >= width
            ):
                break
            ring += 1
        found[index] = candidates[np.argsort(distances, kind="stable")[:count]]
    return found
