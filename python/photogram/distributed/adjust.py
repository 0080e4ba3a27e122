"""Blocks that are in memory, adjusted in parts: on a cluster, or one part after the other."""

from __future__ import annotations

import hashlib
import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import orjson

from photogram.adjustment.adjustment import (
    AsPublished,
    Progress,
    UnitVariance,
    adjust,
    core_options,
    core_threads,
    with_datum,
)
from photogram.adjustment.first_features import started
from photogram.adjustment.robust import Loss
from photogram.arguments.annotations import check_arguments
from photogram.distributed.counts import UNKNOWNS, Counts, counted_work
from photogram.distributed.division import Division
from photogram.distributed.files import alone
from photogram.distributed.graph import alone_of, incidence_of, vertices_of
from photogram.distributed.merging import merged
from photogram.distributed.parts import IN_TABLES
from photogram.distributed.plan import PartsPlan
from photogram.distributed.run import partition, places_of
from photogram.distributed.running import Run, opened
from photogram.errors import InputError
from photogram.io.structure import Encoder
from photogram.network.block import Block, checked, refuse_passages
from photogram.network.core_arrays import CoreOptions
from photogram.network.datum import (
    DatumRow,
    InnerConstraints,
    MinimumConstraints,
    check_datum,
)
from photogram.network.films import Scan
from photogram.network.refracted import check_cameras
from photogram.results.block_files import STANDS
from photogram.results.result import Result

__all__ = ["adjust_in_parts", "fingerprint", "plan_in_parts"]

WHOLE = 950.0
"""Bytes of an image point, with its share of its point and of the result, of a block adjusted as a whole."""


def adjust_in_parts(
    block: Block,
    division: Division,
    *,
    datum: InnerConstraints | MinimumConstraints | None = None,
    unit_variance: UnitVariance = "constrained",
    max_iterations: int | None = None,
    tolerance: float | AsPublished = 1e-5,
    covariance: bool = True,
    loss: Loss | None = None,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Result:
    """Adjust a block in parts, on a cluster or one part after the other (docs/distributed.md).

    The result is that of :func:`photogram.adjust`, to rounding. What asks for the normal equations of the
    whole block again is not had of it: covariances between photos or points, further datums.

    Parameters
    ----------
    block
        The block.
    division
        Into how many parts, on which cluster, within which memory, in which folder. A block that fits into
        the memory as a whole is adjusted as a whole, where neither parts nor a cluster are given.
    datum, unit_variance, max_iterations, tolerance, covariance, loss, progress
        As of :func:`photogram.adjust`.
    threads
        As of :func:`photogram.adjust`; on a cluster those of a worker, one when None.

    Returns
    -------
    The result; its `status` says whether the adjustment converged.

    Raises
    ------
    RankError, AdjustmentError, KeyboardInterrupt
        As of :func:`photogram.adjust`.
    OutOfMemoryError
        A part, or what parts have in common, takes more than the memory; says what would do.
    InputError
        As of :func:`photogram.adjust`; more parts than photos, photos or observations on trajectories, a
        cluster that does not answer or whose workers cannot work together, the folder of another run.
    ModuleNotFoundError
        A cluster is asked for, and dask.distributed is not installed (extra `distributed`).
    """
    options = core_options(unit_variance, loss, covariance, tolerance, max_iterations)
    core_threads(threads)  # refused here, not by a worker
    block, options, row = _ready(block, options, datum)
    if division.parts is None and division.cluster is None and _fits(block, division.memory_bytes):
        return adjust(
            block,
            datum=datum,
            unit_variance=unit_variance,
            max_iterations=max_iterations,
            tolerance=tolerance,
            covariance=covariance,
            loss=loss,
            threads=threads,
            progress=progress,
        )
    with _run(block, options, row, division, threads) as run:
        return merged(run.folder, run.manifest, block, run.adjust(progress, block))


def plan_in_parts(
    block: Block,
    division: Division,
    *,
    datum: InnerConstraints | MinimumConstraints | None = None,
    unit_variance: UnitVariance = "constrained",
    tolerance: float | AsPublished = 1e-5,
) -> PartsPlan:
    """Plan the adjustment of a block in parts: what it takes, before anything is adjusted.

    The parts are written; in the folder of the run, where the division has one, they wait for the adjustment.

    Parameters
    ----------
    block, division, datum, unit_variance, tolerance
        As of :func:`adjust_in_parts`.

    Returns
    -------
    The plan; its `check` refuses what does not fit.

    Raises
    ------
    InputError, AdjustmentError
        As of :func:`adjust_in_parts`.
    """
    options = core_options(unit_variance, None, tolerance=tolerance)
    block, options, row = _ready(block, options, datum)
    with _run(block, options, row, division, None) as run:
        return run.plan()


def _ready(
    block: Block, options: CoreOptions, datum: InnerConstraints | MinimumConstraints | None
) -> tuple[Block, CoreOptions, DatumRow | None]:
    """Return a block whose common unknowns have values to start from; refuse what cannot be adjusted.

    With what is to be held of it in the options, and inner constraints as the core knows them.
    """
    check_cameras(checked(block))
    check_datum(datum)
    refuse_passages(block, "blocks in parts", but=Scan)
    block = started(block)
    return block, *with_datum(block, options, datum)


def _fits(block: Block, room: int | None) -> bool:
    """Whether a block fits as a whole into so many bytes, where they are given."""
    return room is not None and _counted(block, 1).factor_bytes[0] + WHOLE * len(block.image_xy) <= room


@contextmanager
def _run(
    block: Block, options: CoreOptions, row: DatumRow | None, division: Division, threads: int | None
) -> Iterator[Run]:
    """Open the run of a block."""
    if not math.isfinite(options.limit):  # which documents of a run have no way to write
        raise InputError("in parts the tolerance must be finite")
    with ExitStack() as stack:
        if division.folder is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="photogram-")))
        else:
            folder = Path(division.folder)
        stack.enter_context(alone(folder))
        source = fingerprint(block, options, row)
        yield stack.enter_context(
            opened(
                folder,
                source,
                len(block.photo_ids),
                lambda parts: _counted(block, parts),
                lambda parts: partition(block, folder, parts, options, source, row),
                division,
                threads,
            )
        )


def _counted(block: Block, parts: int) -> Counts:
    incidence, _, _ = incidence_of(block)
    images = np.bincount(vertices_of(block)[block.image_photos], minlength=len(block.photo_ids))
    alone = alone_of(block)
    own = [each for each in block.unknowns if id(each) in alone and not each.is_held]
    poses = UNKNOWNS * (len(block.photo_ids) - len(block.timed))
    unknowns = (poses + sum(len(each.deviations) for each in own)) / len(block.photo_ids)
    return counted_work(places_of(block), images.astype(float), lambda: [incidence], parts, unknowns)[1]


def fingerprint(block: Block, options: CoreOptions, row: DatumRow | None = None) -> str:
    """Return what tells a block and how it is adjusted from others."""
    digest = hashlib.sha256(repr((options, row)).encode())
    for name in IN_TABLES:
        values = getattr(block, name)
        if isinstance(values, np.ndarray):
            digest.update(np.ascontiguousarray(values).tobytes())
    settings = Encoder(STANDS).fields(block, ["title", *IN_TABLES])
    digest.update(orjson.dumps(settings))
    return digest.hexdigest()


check_arguments(globals(), ["adjust_in_parts", "plan_in_parts"])
