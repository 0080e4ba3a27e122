"""Runs: a block cut into parts, for a cluster or one part after the other, planned and adjusted."""

from __future__ import annotations

import hashlib
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress
from photogram.adjustment.elsewhere import Division
from photogram.arguments.arrays import shown, whole_number
from photogram.distributed.core import CoreEngine
from photogram.distributed.counts import Counts, counted_work
from photogram.distributed.driver import Driver, Outcome, Stop
from photogram.distributed.executors import Executor, Serial
from photogram.distributed.files import alone
from photogram.distributed.merging import InParts, merged
from photogram.distributed.parts import incidence_of, vertices_of
from photogram.distributed.planned import SHARE, PartsPlan, measured_rates
from photogram.distributed.run import MANIFEST, Manifest, partition, places_of, read_manifest
from photogram.distributed.tasks import Job, predicted, shelf
from photogram.distributed.workers import Workers, check_workers, connected
from photogram.errors import InputError
from photogram.memory import resident_memory
from photogram.network.block import Block
from photogram.network.core import CoreOptions

__all__ = ["Run", "adjusted_in_parts", "bytes_of", "check", "opened", "parts_for", "planned"]

UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12, "ki": 2**10, "mi": 2**20, "gi": 2**30}
PARTS_A_WORKER = 4
"""So that a slow worker does not hold the rest."""
LEAST_PHOTOS = 20
"""Of a part: smaller ones are all border."""
WHOLE = 950.0
"""Bytes of an image point, with its share of its point and of the result, of a block adjusted as a whole."""


def bytes_of(memory: int | str) -> int:
    """Return a number of bytes: of `4GB` (10^9), `1.5GiB` (2^30), or a number.

    Raises
    ------
    InputError
        What is none.
    """
    if isinstance(memory, str):
        match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([kmgt]?i?)b?\s*", memory.lower())
        if match is None or match[2] not in UNITS:
            raise InputError(
                f"memory is a number of bytes, or such as '4GB' or '1.5GiB', not {shown(memory)}"
            )
        memory = int(float(match[1]) * UNITS[match[2]])
    if whole_number("memory", memory) < 1:
        raise InputError(f"memory must be positive, not {memory}")
    return memory


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

    def adjust(self, stop: Stop, progress: Callable[[Progress], None] | None = None) -> Outcome:
        """Adjust, or go on where a run that died has ended.

        Raises
        ------
        RankError, AdjustmentError, OutOfMemoryError, InputError
            As :func:`photogram.adjust`.
        """
        self.plan(measured=False).check()
        return Driver(self.job, self.manifest.tree, self.executor, stop, progress).run(resume=True)


@contextmanager
def opened(
    folder: Path,
    source: str,
    divided: Callable[[int], Manifest],
    chosen: Callable[[int, int | None], int],
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
    divided
        Writes a number of parts into the folder.
    chosen
        Gives this number: that asked for, or one for so many workers with so much memory for nodes.
    division, threads
        As of :func:`photogram.adjust`.

    Raises
    ------
    InputError
        Options that cannot be, workers that cannot work together, a folder of another run.
    """
    memory = None if division.memory is None else bytes_of(division.memory)
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
            manifest = divided(chosen(workers, room))
        most = None if memory is None else int(SHARE * memory) + others
        job = Job(folder, CoreEngine(), _photocore.__version__, threads or 0, most, source)
        yield Run(folder, manifest, executor, job, workers, memory, held)


def adjusted_in_parts(
    block: Block,
    options: CoreOptions,
    division: Division,
    threads: int | None,
    progress: Callable[[Progress], None] | None,
) -> InParts | None:
    """Adjust a block in parts; None where it fits as a whole.

    Raises
    ------
    RankError, AdjustmentError, OutOfMemoryError, InputError
        As :func:`photogram.adjust`.
    """
    check(options)
    if division.cluster is None and division.parts is None and division.memory is not None:
        whole = _counted(block, 1)
        if whole.factor_bytes[0] + WHOLE * len(block.image_xy) <= bytes_of(division.memory):
            return None
    with _run(block, options, division, threads) as run:
        stop = Stop(options.limit, options.max_iterations, options.covariance, options.unit_variance)
        outcome = run.adjust(stop, progress)
        return merged(run.folder, run.manifest, block, outcome)


def planned(block: Block, options: CoreOptions, division: Division) -> PartsPlan:
    """Return the plan of a block in parts, which are written for it.

    Raises
    ------
    InputError, AdjustmentError
        As :func:`adjusted_in_parts`.
    """
    check(options)
    with _run(block, options, division, None) as run:
        return run.plan()


def check(options: CoreOptions) -> None:
    """Refuse what cannot be adjusted in parts.

    Raises
    ------
    InputError
        A unit variance based on redundancy numbers.
    """
    if options.unit_variance == "redundancy":
        raise InputError(
            "in parts the unit variance is not based on redundancy numbers:"
            " --unit-variance constrained (or unity)"
        )


@contextmanager
def _run(block: Block, options: CoreOptions, division: Division, threads: int | None) -> Iterator[Run]:
    """Open the run of a block."""
    with ExitStack() as stack:
        if division.folder is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="photogram-")))
        else:
            folder = Path(division.folder)
        stack.enter_context(alone(folder))
        source = fingerprint(block, options)
        yield stack.enter_context(
            opened(
                folder,
                source,
                lambda parts: partition(block, folder, parts, options, source),
                lambda workers, room: (
                    division.parts_of(len(block.photo_ids))
                    or parts_for(lambda parts: _counted(block, parts), len(block.photo_ids), workers, room)
                ),
                division,
                threads,
            )
        )


def parts_for(counted: Callable[[int], Counts], photos: int, workers: int, room: int | None) -> int:
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


def _counted(block: Block, parts: int) -> Counts:
    incidence, _, _ = incidence_of(block)
    images = np.bincount(vertices_of(block)[block.image_photos], minlength=len(block.photo_ids))
    return counted_work(places_of(block), images.astype(float), lambda: [incidence], parts)[1]


def fingerprint(block: Block, options: CoreOptions) -> str:
    """Return what tells a block and how it is adjusted from others."""
    digest = hashlib.sha256(repr(options).encode())
    for name in (
        *("photo_positions", "photo_attitudes", "photo_position_sd", "photo_attitude_sd", "photo_cameras"),
        *("point_positions", "point_sd", "image_photos", "image_points", "image_xy", "image_sd"),
    ):
        values = getattr(block, name)
        digest.update(b"" if values is None else np.ascontiguousarray(values).tobytes())
    for each in (*block.cameras, *block.observations, *block.unknowns):
        digest.update(repr(each).encode())
    return digest.hexdigest()
