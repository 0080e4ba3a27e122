"""Duplicate photos and points: their image observations are identical."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Indices
from photogram.network.block import Block
from photogram.words import Phrase, phrase

FEWEST = 4  # Equal image observations of two photos
SHARE = 0.5  # Share of equal observations of a photo
FEWEST_OF_POINT = 2  # Equal image observations of two points


def duplicates(block: Block) -> list[Phrase]:
    """Return messages on photos, and on points, that have the same image observations."""
    # Different observations have different sums and are not compared.
    sums = np.sort(block.image_xy[:, 0] * np.pi + block.image_xy[:, 1])
    if not (np.diff(sums) == 0).any():
        return []
    messages = []
    for name, owners, others, ids, fewest in (
        ("photos", block.image_photos, block.image_points, block.photo_ids, FEWEST),
        ("points", block.image_points, block.image_photos, block.point_ids, FEWEST_OF_POINT),
    ):
        pairs = _equal_pairs(owners, others, block, fewest)
        if pairs:
            names = [phrase("part.pair", first=str(ids[i]), second=str(ids[j])) for i, j in pairs]
            messages.append(phrase(f"duplicates.{name}", n=len(names), names=names))
    return messages


def _equal_pairs(owners: Indices, others: Indices, block: Block, fewest: int) -> list[tuple[int, int]]:
    """Return pairs of owners with mostly equal image observations."""
    xy = block.image_xy
    order = np.lexsort((xy[:, 1], xy[:, 0], others))
    first, second = order[:-1], order[1:]
    equal = (others[first] == others[second]) & (xy[first] == xy[second]).all(axis=1)
    if not equal.any():
        return []
    pairs = np.sort(np.column_stack([owners[first[equal]], owners[second[equal]]]), axis=1)
    found, counts = np.unique(pairs, axis=0, return_counts=True)
    sizes = np.bincount(owners, minlength=int(owners.max()) + 1)
    most = counts >= np.maximum(fewest, SHARE * sizes[found].min(axis=1))
    return [(int(i), int(j)) for i, j in found[most] if i != j]
