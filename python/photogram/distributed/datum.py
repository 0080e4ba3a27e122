"""Transformation of a partitioned block to its datum, from the adjusted nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.core_arrays import block_network
from photogram.network.datum import DatumRow
from photogram.results.datum import refused

if TYPE_CHECKING:
    from photogram.distributed.run import Manifest

LANES = 8  # Right-hand sides of points that the core reduces at a time


@dataclass(frozen=True)
class InDatum:
    """Data for the inversion of nodes after the transformation to a datum.

    `common` (d, d) is the sum B^T Q B of the whole block. `last` names the states before and after the last
    step, which precedes the transformation.
    """

    common: Floats
    last: tuple[str, str]


def nodes_in_datum(
    block: Block, manifest: Manifest, nodes: Sequence[tuple[Indices, Floats]]
) -> list[dict[str, np.ndarray]]:
    """Transform an adjusted block to inner constraints: values (N,) and names (N, 3) of its nodes.

    Names are of the unknowns in the whole block. Return for each node the new `values` (N,) and the columns
    `b` and `t` (d, N). Also return the `condition`, a measure of rounding errors, and the unknowns `staying`
    in the datum. InputError if points and photos do not define the datum; others as in
    :func:`photogram.adjust`.
    """
    assert manifest.datum is not None
    names, values = (np.concatenate(each) for each in zip(*nodes, strict=True))
    network, middle = block_network(block, manifest.options), manifest.middle
    try:
        moved, *columns, condition, exact = network.parts_in_datum(
            manifest.datum, manifest.held, middle=middle, names=names.ravel(), values=values, threads=0
        )
    except _photocore.BlockError as error:
        raise refused(block, network, None, error) from None
    b, t = (each.reshape(-1, len(values)) for each in columns)
    found, start = [], 0
    for _, own in nodes:
        rows = slice(start, start + len(own))
        start += len(own)
        staying = np.flatnonzero(b[:, rows].any(axis=0)) if exact else np.zeros(0, dtype=np.int64)
        arrays = {"values": moved[rows], "b": b[:, rows], "t": t[:, rows]}
        found.append({**arrays, "condition": np.array(condition), "staying": staying})
    return found


def local_row(row: DatumRow, photos: Indices, points: Indices) -> DatumRow:
    """Restrict a datum to the photos and points of a node."""
    name, of_points, of_photos, scale, attitudes, radius = row

    def own(rows: Indices, chosen: list[int]) -> list[int]:
        found: list[int] = np.flatnonzero(np.isin(rows, chosen)).tolist()
        return found

    return name, own(points, of_points), own(photos, of_photos), scale, own(photos, attitudes), radius
