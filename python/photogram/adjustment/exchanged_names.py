"""Exchanged names of two points on a photo: each image fits the other point.

For a point with its rays, one of them suspected, T is the minimum of the sum of squared residuals in standard
deviations. Given coordinates are included, and photos are fixed at their adjustment by the other
observations. Images i and j of a photo are exchanged if T of both points with the given names is larger than

    T(exchanged) + 2 ln(k / 0.0001),    T(exchanged) < 3 max(1, s^2) chi2(0.999; m)

(:mod:`photogram.statistics.likelihood`). The factor 3 accounts for the uncertainty of photos.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.network.block import Block
from photogram.network.rays import Rays, counts_of, meet, seen_without_lenses, sums_of
from photogram.results.snooping_log import Exchange
from photogram.statistics.likelihood import are_exchanged

MOST = 40  # Largest number of excluded images of a photo
UNCERTAIN = 3.0  # Factor of T for errors of photos, which are fixed here
STEPS = 4  # Gauss-Newton steps from the intersection of the rays
HELD = 1e-6  # Standard deviation of fixed coordinates, relative to an image at the distance of the object


def exchanged_names(block: Block, used: Bools, variance: float = 1.0) -> list[Exchange]:
    """Find exchanged names among the images that a network with `variance` of unit weight does not use."""
    plain, seen = seen_without_lenses(block)
    mounted = {each.photo for each in block.mounts}
    on_frames = np.array([name in mounted for name in block.photo_ids])
    pairs = _pairs(plain, used[seen], on_frames)
    if not pairs:
        return []
    wanted = sorted({(i, k) for pair in pairs for i in pair for k in pair})
    found = dict(zip(wanted, _fitted(plain, used[seen], wanted), strict=True))
    passing: dict[tuple[int, int], list[tuple[float, float, int, int]]] = {}
    for i, j in pairs:
        as_named = found[i, i][0] + found[j, j][0]
        left = found[i, j][0] + found[j, i][0]
        dimension = found[i, j][1] + found[j, i][1]
        better = all(found[a, b][0] < found[a, a][0] for a, b in ((i, j), (j, i)))
        if better and are_exchanged(
            as_named, left, dimension, pairs=len(pairs), variance=max(variance, 1.0), uncertain=UNCERTAIN
        ):
            one, other = sorted((int(plain.image_points[i]), int(plain.image_points[j])))
            photo = int(plain.image_photos[i])
            passing.setdefault((one, other), []).append((left, as_named, dimension, photo))
    # The most certain pairs first; each point is in one pair only.
    exchanges, taken = list[Exchange](), set[int]()
    for points, ways in sorted(passing.items(), key=lambda each: min(each[1])[0] - min(each[1])[1]):
        if taken.isdisjoint(points):
            taken |= set(points)
            left, as_named, dimension, _ = min(ways)
            photos = [plain.photo_ids[photo] for *_, photo in sorted(ways)]
            names = plain.point_ids[points[0]], plain.point_ids[points[1]]
            exchanges.append(Exchange(tuple(photos), names, as_named, left, dimension))
    return exchanges


def _pairs(block: Block, used: Bools, on_frames: Bools) -> list[tuple[int, int]]:
    """Return pairs of excluded images on the same photo."""
    out = np.flatnonzero(~used & ~on_frames[block.image_photos])
    out = out[np.argsort(block.image_photos[out], kind="stable")]
    bounds = np.flatnonzero(np.diff(block.image_photos[out], prepend=-1, append=-1))
    return [
        pair
        for first, last in pairwise(bounds.tolist())
        if last - first <= MOST
        for pair in combinations(out[first:last].tolist(), 2)
        if block.image_points[pair[0]] != block.image_points[pair[1]]
    ]


def _fitted(block: Block, used: Bools, wanted: Sequence[tuple[int, int]]) -> list[tuple[float, int]]:
    """Return T and its dimension for points of images, each with the ray of another image.

    Points have their other used images, if any, else all their other images.
    """
    order = np.argsort(block.image_points, kind="stable")
    starts = np.searchsorted(block.image_points[order], np.arange(len(block.point_ids) + 1))
    rows, points = list[Indices](), block.image_points[[image for image, _ in wanted]]
    for point, (image, place) in zip(points.tolist(), wanted, strict=True):
        own = order[starts[point] : starts[point + 1]]
        own = own[block.image_photos[own] != block.image_photos[image]]
        good = own[used[own]]
        rows.append(np.append(good if len(good) else own, place))
    sizes = np.array([*map(len, rows)])
    prior_sd = np.full((len(points), 3), np.inf)
    if not block.geographic:  # The axes of priors are those of the block
        known = np.isfinite(block.point_positions[points])
        prior_sd = np.where(known, block.point_sd[points], np.inf)
    squares = _squares(
        block, np.repeat(np.arange(len(wanted)), sizes), np.concatenate(rows), points, prior_sd
    )
    dimensions = 2 * sizes + np.isfinite(prior_sd).sum(axis=1) - 3
    return list(zip(squares.tolist(), dimensions.tolist(), strict=True))


def _squares(block: Block, own: Indices, rows: Indices, points: Indices, prior_sd: Floats) -> Floats:
    """(n,) minimum sums of squares of images `rows` of points `own`; infinite behind cameras."""
    rays, sd, count = Rays.of(block), block.image_sd[rows], len(points)

    def total(values: Floats) -> Floats:
        return sums_of(own, values, count)

    across, right = rays.equations()
    position = meet(total(across[rows]), total(right[rows]), counts_of(own, count))
    # A component may be unknown.
    given, held = block.point_positions[points] - rays.axes.origin, np.isfinite(prior_sd)
    known = held.all(axis=1)
    position[known] = given[known]
    there = np.isfinite(position[own, 0])
    if not there.any():
        return np.full(count, np.inf)
    photos = block.image_photos[rows]
    reach = np.median(np.linalg.norm(position[own] - rays.centres[photos], axis=1)[there])
    distances = np.abs(block.known_distances("exchanged names")[photos])
    least = HELD * float(np.median(sd)) * reach / float(np.median(distances))
    weight = np.where(held, 1 / np.maximum(np.where(held, prior_sd, 1.0), least) ** 2, 0.0)
    squares = np.full(count, np.nan)
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            residuals, in_front = rays.residuals(position[own], rows)
            residuals = residuals / sd
            partials = rays.partials(position[own], rows) / sd[:, :, np.newaxis]
            apart = np.where(held, given - position, 0.0)
            squares = total((residuals**2).sum(axis=1, keepdims=True))[:, 0]
            squares = squares + (weight * apart**2).sum(axis=1)
            normal = total(np.einsum("mki,mkj->mij", partials, partials))
            normal[:, range(3), range(3)] += weight
            vector = total(np.einsum("mki,mk->mi", partials, residuals)) + weight * apart
            sound = np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(vector).all(axis=1)
            sound[sound] &= np.linalg.cond(normal[sound]) < 1e14
            position[sound] += np.linalg.solve(normal[sound], vector[sound, :, np.newaxis])[..., 0]
    behind = np.bincount(own, ~in_front, count) > 0
    return np.where(behind | ~np.isfinite(squares), np.inf, squares)
