"""Runs: a block cut into parts, for a cluster or one part after the other, planned and adjusted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from photogram import _photocore
from photogram.adjustment.adjustment import Progress
from photogram.distributed.counts import Counts
from photogram.distributed.datum import Mover
from photogram.distributed.division import Division
from photogram.distributed.driver import Driver, Outcome, Stop
from photogram.distributed.executors import Executor, Serial
from photogram.distributed.nodes import CoreEngine
from photogram.distributed.plan import SHARE, PartsPlan, measured_rates
from photogram.distributed.run import MANIFEST, Manifest, read_manifest
from photogram.distributed.shelf import shelf
from photogram.distributed.tasks import Job, predicted
from photogram.distributed.workers import Workers, check_workers, connected
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.memory import resident_memory
from photogram.network.block import Block

__all__ = ["Run", "opened"]

PARTS_A_WORKER = 4
"""So that a slow worker does not hold the rest."""
LEAST_PHOTOS = 20
"""Of a part: smaller ones are all border."""


@dataclass(frozen=True)
class Run:
    """A run whose parts lie in its folder: planned, or carried out.

    Attributes
    ----------
    folder
        Of the run.
    manifest
        What all nodes have in common.
    executor
        Does the tasks.
    job
        What tasks are told.
    workers
        How many do them.
    memory
        Bytes of each; None for any number.
    held
        Bytes that a worker holds before it begins.
    """

    folder: Path
    manifest: Manifest
    executor: Executor
    job: Job
    workers: int
    memory: int | None
    held: int

    def plan(self, *, measured: bool = True) -> PartsPlan:
        """Return the plan; `measured` has one part formed here, for the time that all will take."""
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
        """Adjust, or go on where a run that died has ended.

        Parameters
        ----------
        progress
            Told of what is going on.
        block
            What was divided: it is needed where it is to be taken to a datum.

        Raises
        ------
        RankError, AdjustmentError, OutOfMemoryError, InputError
            As :func:`photogram.adjust`.
        """
        self.plan(measured=False).check()
        options = self.manifest.options
        stop = Stop(
            options.limit,
            options.max_iterations,
            options.covariance,
            options.unit_variance,
            options.loss is not None,
            options.criterion == "percent",
        )
        found, mover = self.manifest, None
        if block is not None and found.datum is not None:
            mover = Mover(block, options, found.datum, found.held, found.middle)
        return Driver(self.job, found.tree, self.executor, stop, progress, mover).run(resume=True)


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
    """Open a run: connect to workers, and divide the block unless its parts lie there already.

    Parameters
    ----------
    folder
        Of the run.
    source
        What tells the block and the options from others.
    photos
        How many the block has.
    counted
        Counts the work of a number of parts.
    divided
        Writes a number of parts into the folder.
    division, threads
        As of :func:`photogram.adjust_in_parts`; the folder of the division is not looked at.

    Raises
    ------
    InputError
        Options that cannot be, workers that cannot work together, a folder of another run.
    """
    memory = division.memory_bytes
    with ExitStack() as stack:
        executor: Executor
        if division.cluster is None:
            # The memory is for the adjustment: what else this process holds is its own affair.
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
                raise InputError(
                    "is the folder of a run of another block, or with other options: give another one",
                    file=folder,
                )
        else:
            room = None if memory is None else int(SHARE * memory) - held
            manifest = divided(division.parts_of(photos) or _parts_for(counted, photos, workers, room))
        most = None if memory is None else int(SHARE * memory) + others
        columns = 0 if manifest.datum is None else len(manifest.held)
        job = Job(folder, CoreEngine(), _photocore.__version__, threads or 0, most, source, columns)
        yield Run(folder, manifest, executor, job, workers, memory, held)


def _parts_for(counted: Callable[[int], Counts], photos: int, workers: int, room: int | None) -> int:
    """Return how many parts a block is cut into: some for each worker, and small enough for its memory.

    Parameters
    ----------
    counted
        Counts the work of a number of parts.
    photos
        How many the block has.
    workers, room
        How many workers, and the bytes that each has for nodes.
    """
    most = max(photos // LEAST_PHOTOS, 1)
    parts = min(PARTS_A_WORKER * workers if workers > 1 else 2, most)
    while room is not None and 2 * parts <= most:
        if counted(parts).memory_bytes.max() <= room:
            break
        parts *= 2
    return parts
