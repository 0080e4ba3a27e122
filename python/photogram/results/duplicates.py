"""Photos, points and observations that were entered twice: standard deviations are too small."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.network.block import Block
from photogram.network.observations.columns import Columns
from photogram.words import Phrase, phrase

FEWEST = 4  # Equal image observations of two photos
SHARE = 0.5  # Share of equal observations of a photo
FEWEST_OF_POINT = 2  # Equal image observations of two points
EQUAL = 0.25  # Largest differences of copies, in standard deviations of image observations
ROUNDED = 0.1  # Last digit of equal values, in standard deviations, below which they are no chance


def duplicates(block: Block, factor: float = 1.0) -> list[Phrase]:
    """Return messages on copies: photos and points with equal images, equal additional observations.

    Images are equal within their noise, additional observations in all digits. `factor` is the factor of the
    given standard deviations that the residuals indicate.
    """
    messages, repeated = [], _repeated(block)
    if repeated:
        messages.append(phrase("duplicates.observations", n=len(repeated), names=repeated))
    if not len(block.image_xy):
        return messages
    # A factor that is not a number does not count.
    limit = EQUAL * (factor if factor < 1.0 else 1.0) * float(np.median(block.image_sd))
    for name, owners, others, ids, fewest in (
        ("photos", block.image_photos, block.image_points, block.photo_ids, FEWEST),
        ("points", block.image_points, block.image_photos, block.point_ids, FEWEST_OF_POINT),
    ):
        pairs = _equal_pairs(owners, others, block.image_xy, limit, fewest)
        if pairs:
            names = [phrase("part.pair", first=str(ids[i]), second=str(ids[j])) for i, j in pairs]
            messages.append(phrase(f"duplicates.{name}", n=len(names), names=names))
    return messages


def _equal_pairs(
    owners: Indices, others: Indices, xy: Floats, limit: float, fewest: int
) -> list[tuple[int, int]]:
    """Return pairs of owners whose observations are mostly equal within a limit."""
    # Sums of different coordinates on one photo, or of one point, are rarely near each other.
    keys = xy[:, 0] + xy[:, 1] / np.pi
    keys += others * (2.0 * float(np.ptp(keys)) + 1.0)
    order = np.argsort(keys)
    near = np.flatnonzero(np.diff(keys[order]) <= 2 * limit)
    first, second = order[near], order[near + 1]
    equal = (np.abs(xy[first] - xy[second]) <= limit).all(axis=1) & (others[first] == others[second])
    pairs = np.sort(np.column_stack([owners[first[equal]], owners[second[equal]]]), axis=1)
    if not len(pairs):
        return []
    found, counts = np.unique(pairs, axis=0, return_counts=True)
    sizes = np.bincount(owners, minlength=int(owners.max()) + 1)
    most = counts >= np.maximum(fewest, SHARE * sizes[found].min(axis=1))
    return [(int(i), int(j)) for i, j in found[most] if i != j]


def _repeated(block: Block) -> list[str]:
    """Return names of additional observations with the same objects and values as one before."""
    found = []
    for columns in block.observations.columns:
        names = list(zip(columns.table["points"], columns.table["photos"], strict=True))
        # Observations of unknowns alone may be repeated constraints.
        if len(set(names)) < len(names) and any(names[0]):
            found += list(_copies(columns, names))
    return found


def _copies(columns: Columns, names: list[tuple[tuple[str, ...], tuple[str, ...]]]) -> Iterator[str]:
    seen = set()
    times = columns.table.get("time", [None] * len(names))
    unknowns = [tuple(map(id, row)) for row in columns.table["unknowns"]]
    keys = zip(
        names, unknowns, times, map(tuple, np.asarray(columns.table["observed"]).tolist()), strict=True
    )
    for row, key in enumerate(keys):
        if key not in seen:
            seen.add(key)
            continue
        sd = math.sqrt(float(np.asarray(columns.table["precision"][row]).diagonal().max()))
        if _resolution(key[3]) < ROUNDED * sd:
            yield f"{columns.label} {' - '.join(key[0][0] + key[0][1])}"


def _resolution(values: tuple[float, ...]) -> float:
    """Return the unit of the last decimal of the value with the most decimals."""
    decimals = (repr(value).partition("e")[0].partition(".")[2].rstrip("0") for value in values)
    return float(10.0 ** -max(map(len, decimals)))
