"""Transformation of a partitioned block to its datum, from the adjusted nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.core_arrays import CoreOptions, block_network
from photogram.network.datum import DatumRow
from photogram.results.datum import refused

LANES = 8  # Right-hand sides of points that the core reduces at a time


@dataclass(frozen=True)
class InDatum:
    """Data for the inversion of nodes after the transformation to a datum.

    `common` (d, d) is the sum B^T Q B of the whole block. `last` names the states before and after the last
    step, which precedes the transformation.
    """

    common: Floats
    last: tuple[str, str]


@dataclass(frozen=True)
class Mover:
    """Transformation of an adjusted partitioned block to inner constraints.

    `held` are photos with indices of their fixed unknowns, `middle` is the origin shared by all nodes.
    """

    block: Block
    options: CoreOptions
    row: DatumRow
    held: list[tuple[int, int]]
    middle: tuple[float, float, float]

    def __call__(self, nodes: Sequence[tuple[Indices, Floats]]) -> list[dict[str, np.ndarray]]:
        """Transform values (N,) with names (N, 3) of the unknowns of each node in the whole block.

        Return for each node the new `values` (N,) and the columns `b` and `t` (d, N). Also return the
        `condition`, a measure of rounding errors, and the unknowns `staying` in the datum. InputError if
        points and photos do not define the datum; others as in :func:`photogram.adjust`.
        """
        names, values = (np.concatenate(each) for each in zip(*nodes, strict=True))
        network = block_network(self.block, self.options)
        try:
            moved, *columns, condition, exact = network.parts_in_datum(
                self.row, self.held, middle=self.middle, names=names.ravel(), values=values, threads=0
            )
        except _photocore.BlockError as error:
            raise refused(self.block, network, None, error) from None
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
