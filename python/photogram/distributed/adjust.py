"""Partitioned adjustment of blocks in memory and runs on disk, on a cluster or sequentially."""

from __future__ import annotations

import hashlib
import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import numpy as np
import orjson

from photogram import _photocore
from photogram.adjustment.adjustment import Progress, adjust, core_threads, options_in_datum
from photogram.adjustment.first_features import started
from photogram.adjustment.options import AdjustOptions
from photogram.adjustment.remarks import check_cameras
from photogram.arguments.fields import options_of
from photogram.distributed.cut import UNKNOWNS, Counts, alone_of, counted_work, incidence_of, vertices_of
from photogram.distributed.division import Division
from photogram.distributed.driver import Driver, Outcome
from photogram.distributed.executors import Executor, Serial, Workers, check_workers, connected
from photogram.distributed.files import alone
from photogram.distributed.merging import merged
from photogram.distributed.nodes import CoreEngine, nodes_in_datum
from photogram.distributed.parts import IN_TABLES
from photogram.distributed.plan import SHARE, PartsPlan, measured_rates
from photogram.distributed.run import MANIFEST, Manifest, partition, places_of, read_manifest
from photogram.distributed.shelf import shelf
from photogram.distributed.tasks import Job, predicted
from photogram.errors import InputError
from photogram.io.structure import Encoder
from photogram.lazy_dataclasses import dataclass
from photogram.memory import resident_memory
from photogram.network.block import Block, checked, refuse_passages
from photogram.network.core_arrays import CoreOptions
from photogram.network.datum import DatumRow
from photogram.network.films import Scan
from photogram.results.result import Result
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.adjustment.keywords import AdjustKeywords


WHOLE = 950.0  # Bytes per image point and its share of the object point, for a block adjusted as a whole
PARTS_A_WORKER = 4  # So that a slow worker does not delay the rest
LEAST_PHOTOS = 20  # Minimum number of photos per part; smaller parts consist of borders only


def adjust_in_parts(
    block: Block,
    division: Division,
    options: AdjustOptions | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    **changes: Unpack[AdjustKeywords],
) -> Result:
    """Adjust a block in parts, on a cluster or sequentially (docs/distributed.md).

    The result equals the result of :func:`photogram.adjust`, except for rounding. Functions that need the
    normal equations of the whole block are not supported: covariances between photos or points, and other
    datums.

    Parameters
    ----------
    block
        Block to adjust.
    division
        Number of parts, cluster, memory and folder. A block that fits into the memory is adjusted as a whole,
        if neither parts nor a cluster are specified.
    options, progress, changes
        As in :func:`photogram.adjust`; the order of elimination does not apply.
    threads
        As in :func:`photogram.adjust`; on a cluster, threads per worker (None: one).

    Returns
    -------
    The result; its `status` is `converged` if the adjustment converged.

    Raises
    ------
    RankError, AdjustmentError, KeyboardInterrupt
        As in :func:`photogram.adjust`.
    OutOfMemoryError
        If a part, or the data shared by parts, exceed the memory; the message proposes a remedy.
    InputError
        As in :func:`photogram.adjust`. If there are more parts than photos, or photos or observations are on
        trajectories. If a cluster does not respond, workers are incompatible, or the folder contains another
        run.
    ModuleNotFoundError
        If a cluster is requested and dask.distributed is not installed (extra `distributed`).
    """
    chosen = options_of(AdjustOptions, options, changes)
    core_threads(threads)  # rejected here, not by a worker
    block, core, row = _ready(block, chosen)
    room = None if division.parts is not None or division.cluster is not None else division.memory_bytes
    # A block that fits into the memory is adjusted as a whole.
    if room is not None and _counted(block, 1).factor_bytes[0] + WHOLE * len(block.image_xy) <= room:
        return adjust(block, chosen, threads=threads, progress=progress)
    with _run(block, core, row, division, threads) as run:
        result = merged(run.folder, run.manifest, block, run.adjust(progress, block))
        return result.with_max_bias_ratio(chosen.max_bias_ratio)


def plan_in_parts(
    block: Block,
    division: Division,
    options: AdjustOptions | None = None,
    **changes: Unpack[AdjustKeywords],
) -> PartsPlan:
    """Plan the adjustment of a block in parts: work, memory, traffic and time.

    The parts are written to disk. If the division has a folder, the adjustment uses these parts.

    Parameters
    ----------
    block, division, options, changes
        As in :func:`adjust_in_parts`.

    Returns
    -------
    The plan; its `check` rejects a plan that exceeds the memory.

    Raises
    ------
    InputError, AdjustmentError
        As in :func:`adjust_in_parts`.
    """
    block, core, row = _ready(block, options_of(AdjustOptions, options, changes))
    with _run(block, core, row, division, None) as run:
        plan: PartsPlan = run.plan()
        return plan


def _ready(block: Block, options: AdjustOptions) -> tuple[Block, CoreOptions, DatumRow | None]:
    """Return a valid block with initial values of shared unknowns, options and inner constraints.

    The options contain the minimum constraints; inner constraints are a row for the core.
    """
    check_cameras(checked(block))
    refuse_passages(block, "blocks in parts", but=Scan)
    return started(block), *options_in_datum(options, block)


@contextmanager
def _run(
    block: Block, options: CoreOptions, row: DatumRow | None, division: Division, threads: int | None
) -> Iterator[Run]:
    if not math.isfinite(options.limit):  # the JSON files of a run cannot contain it
        raise InputError(phrase("parts.tolerance", value=options.limit))
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
    digest = hashlib.sha256(repr((options, row)).encode())
    for name in IN_TABLES:
        values = getattr(block, name)
        if isinstance(values, np.ndarray):
            digest.update(np.ascontiguousarray(values).tobytes())
    settings = Encoder().fields(block, ["title", *IN_TABLES])
    digest.update(orjson.dumps(settings))
    return digest.hexdigest()


@dataclass(frozen=True)
class Run:
    """A run whose parts are in its folder: planned or adjusted."""

    folder: Path  # Folder of the run
    manifest: Manifest  # Data shared by all nodes
    executor: Executor  # Runs the tasks
    job: Job  # Common arguments of the tasks
    workers: int  # Number of workers
    memory: int | None  # Bytes of each worker; None is unlimited
    held: int  # Bytes that a worker uses before the run

    def plan(self, *, measured: bool = True) -> PartsPlan:
        """Return the plan; with `measured`, one part is formed here to estimate the time."""
        nodes = range(len(self.manifest.tree))
        handles = [self.executor.submit(predicted, self.job, node) for node in nodes]
        predictions = [self.executor.value(each) for each in handles]
        self.executor.forget(handles)
        rates = None
        if measured:
            leaves = [node for node in nodes if not self.manifest.tree.children[node]]
            largest = max(leaves, key=lambda node: predictions[node]["images"])
            rates = measured_rates(self.job.engine.node(self.folder, largest))
        photos, tree = self.manifest.photos, self.manifest.tree
        return PartsPlan(tree, predictions, photos, self.workers, self.memory, rates, self.held)

    def adjust(
        self, progress: Callable[[Progress], None] | None = None, block: Block | None = None
    ) -> Outcome:
        """Adjust, or resume an interrupted run; raises as :func:`photogram.adjust`.

        `block` is the whole block, which is required for a transformation to a datum.
        """
        self.plan(measured=False).check()
        found = self.manifest
        mover = None if block is None or found.datum is None else partial(nodes_in_datum, block, found)
        return Driver(self.job, found.tree, self.executor, found.options, progress, mover).run(resume=True)


@contextmanager
def opened(
    folder: Path,
    source: str,
    photos: int,
    counted: Callable[[int], Counts],
    divided: Callable[[int], Manifest],
    division: Division,
    threads: int | None,
) -> Iterator[Run]:
    """Open a run: connect to workers, and divide the block unless its parts already exist.

    `counted` counts the work for a number of parts, `divided` writes the parts to the folder. The folder of
    the division is ignored. InputError if options are invalid, workers are incompatible, or the folder
    contains another run.
    """
    memory = division.memory_bytes
    with ExitStack() as stack:
        executor: Executor
        if division.cluster is None:
            # The memory limit applies to the adjustment, not to other data of this process.
            workers, executor, held, others = 1, Serial(folder), 0, resident_memory() or 0
        else:
            client = stack.enter_context(connected(division.cluster, division.workers, memory))
            workers, limit, held = check_workers(client, folder)
            executor, memory, others = Workers(client), memory or limit, 0
            threads = threads or 1
        stack.callback(executor.stop)
        stack.callback(shelf.clear)
        if (folder / MANIFEST).exists():
            manifest = read_manifest(folder)
            if manifest.source != source:
                raise InputError(phrase("parts.other-run"), file=folder)
        else:
            room = None if memory is None else int(SHARE * memory) - held
            parts = division.parts_of(photos)
            if parts is None:
                # Some parts for each worker; more if nodes would exceed the memory.
                largest = max(photos // LEAST_PHOTOS, 1)
                parts = min(PARTS_A_WORKER * workers if workers > 1 else 2, largest)
                while room is not None and 2 * parts <= largest and counted(parts).memory_bytes.max() > room:
                    parts *= 2
            manifest = divided(parts)
        most = None if memory is None else int(SHARE * memory) + others
        columns = 0 if manifest.datum is None else len(manifest.held)
        job = Job(folder, CoreEngine(), _photocore.__version__, threads or 0, most, source, columns)
        yield Run(folder, manifest, executor, job, workers, memory, held)
