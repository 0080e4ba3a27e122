"""The datum that a block in parts is taken to: found of the whole, by what its nodes have come to."""

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

LANES = 8  # Right-hand sides that the core reduces at a time, of points


@dataclass(frozen=True)
class InDatum:
    """What nodes are told that are inverted where the block was moved to its datum.

    `common` is (d, d) the sum B^T Q B of the whole; `last` the states before and after the last step, which
    was taken before the block was moved.
    """

    common: Floats
    last: tuple[str, str]


@dataclass(frozen=True)
class Mover:
    """Takes a block, as its nodes have adjusted it, to the inner constraints of a row.

    `held` are photos with the numbers of their unknowns that are held; `middle` is what all nodes are given.
    """

    block: Block
    options: CoreOptions
    row: DatumRow
    held: list[tuple[int, int]]
    middle: tuple[float, float, float]

    def __call__(self, nodes: Sequence[tuple[Indices, Floats]]) -> list[dict[str, np.ndarray]]:
        """Move it, from (N, 3) names of the unknowns of each node in the whole block, and (N,) their values.

        Returns of each node its `values` there, (N,), the columns `b` and `t`, (d, N), the `condition`, which
        tells of rounding, and the unknowns `staying` in the datum. InputError: its points and photos do not
        carry it; else as of :func:`photogram.adjust`.
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
    """Return a datum as a node knows it, with its photos and points alone."""
    name, of_points, of_photos, scale, attitudes, radius = row

    def own(rows: Indices, chosen: list[int]) -> list[int]:
        found: list[int] = np.flatnonzero(np.isin(rows, chosen)).tolist()
        return found

    return name, own(points, of_points), own(photos, of_photos), scale, own(photos, attitudes), radius
