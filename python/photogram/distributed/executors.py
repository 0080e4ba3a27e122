"""Where tasks are done: one after the other in this process, or on the workers of a Dask cluster.

Scheduling, transport and retries on a cluster are those of `distributed`.
"""

from __future__ import annotations

import logging
import os
import pickle
import re
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from photogram import _photocore
from photogram.arguments.arrays import shown
from photogram.distributed.shelf import shelf
from photogram.errors import AdjustmentError, InputError
from photogram.memory import resident_memory
from photogram.words import phrase

Handle = Any  # Stands for what a task will give
Client = Any
Future = Any  # Of `distributed`, an extra that takes long to import
SETTINGS = {
    # A factor stays with its worker; what it takes is planned, and must not make the worker pause.
    "distributed.worker.memory.pause": False,
    # A stolen task would have to form its factor again.
    "distributed.scheduler.work-stealing": False,
    # Arrow's own pool keeps what tables have taken.
    "distributed.nanny.environ.ARROW_DEFAULT_MEMORY_POOL": "system",
}  # Of clusters that are started here
LOOPBACK = "127.0.0.1"
ADDRESS = re.compile(r"(?:[a-z]+://)?[\w.\-\[\]:]+:\d{1,5}", re.ASCII)  # Other texts make Dask look for files


class Serial:
    """Does every task at once, in this process; what tasks give is kept on disk, in the `directory`.

    Handles among the arguments of a task, and in lists among these, are replaced by what they stand for.
    """

    def __init__(self, directory: Path | None = None) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="photogram-", dir=directory))
        self._count = 0
        self._failed: dict[int, Exception] = {}

    def submit(self, function: Callable[..., Any], *arguments: Any, near: str = "", cost: float = 0.0) -> int:
        """Do a task."""
        del near, cost
        self._count += 1
        own = _Handle(self._count)
        try:
            found = function(*(self._resolved(each) for each in arguments))
            try:
                with open(self._path(own), "wb") as file:
                    pickle.dump(found, file, protocol=5)
            except OSError as error:
                reason = error.strerror or str(error)
                raise AdjustmentError(phrase("parts.not-written", file=self._folder, error=reason)) from None
        except Exception as error:
            self._failed[own] = error
        return own

    def places(self) -> list[str]:
        """Return the one place that there is."""
        return [""]

    def first(self, handles: Collection[int]) -> int:
        """Return the task that was done first."""
        return min(handles)

    def value(self, handle: int) -> Any:
        """Return what a task has given."""
        if handle in self._failed:
            raise self._failed[handle]
        # Only this process has written here, into a folder that is its user's alone.
        with open(self._path(handle), "rb") as file:
            return pickle.load(file)

    def forget(self, handles: Collection[int]) -> None:
        """Remove what tasks have given."""
        for each in handles:
            self._path(each).unlink(missing_ok=True)
            self._failed.pop(each, None)

    def stop(self) -> None:
        """Remove everything."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def _path(self, number: int) -> Path:
        return self._folder / f"{int(number)}.pickle"

    def _resolved(self, argument: Any) -> Any:
        if isinstance(argument, _Handle):
            return self.value(argument)
        if isinstance(argument, list):
            return [self._resolved(each) for each in argument]
        return argument


class _Handle(int):
    """The number of a task."""


class Workers:
    """Has tasks done by the workers of a cluster, by a client that is connected to its scheduler.

    Lost results are computed again by Dask itself: tasks are functions of what they are given. Where a task
    asks for a factor that was lost with a worker, the driver has it formed again.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._futures: set[Future] = set()
        self._count = 0

    def submit(
        self, function: Callable[..., Any], *arguments: Any, near: str = "", cost: float = 0.0
    ) -> Future:
        """Have a task done, the earlier the higher its `cost`, by the worker `near` if it has one."""
        self._count += 1
        found = self._client.submit(
            function,
            *arguments,
            key=f"photogram-{function.__name__}-{id(self):x}-{self._count}",
            pure=False,
            priority=cost,
            workers=[near] if near else None,
            allow_other_workers=bool(near),
        )
        self._futures.add(found)
        return found

    def places(self) -> list[str]:
        """Return the addresses of the workers."""
        return sorted(self._client.nthreads())

    def first(self, handles: Collection[Future]) -> Future:
        """Wait until one of some tasks is done."""
        return next(iter(_library().wait(list(handles), return_when="FIRST_COMPLETED").done))

    def value(self, handle: Future) -> Any:
        """Return what a task has given."""
        from distributed.client import FutureCancelledError

        from distributed import KilledWorker

        try:
            return handle.result()
        except KilledWorker as error:
            raise AdjustmentError(phrase("parts.workers-died", error=error)) from None
        except (FutureCancelledError, OSError) as error:
            raise AdjustmentError(phrase("parts.scheduler-lost", error=error)) from None

    def forget(self, handles: Collection[Future]) -> None:
        """Let go of what tasks have given."""
        for each in handles:
            each.release()
            self._futures.discard(each)

    def stop(self) -> None:
        """Give up all tasks."""
        futures, self._futures = list(self._futures), set()
        if futures and self._client.status == "running":
            self._client.cancel(futures, force=True)


Executor = Serial | Workers


@contextmanager
def connected(cluster: Any, workers: int | None, memory: int | None) -> Iterator[Client]:
    """Connect to a scheduler, or start a cluster on this machine of so many workers and bytes of each.

    `cluster` is a client, which is left as it is, `local`, or an address. InputError: nobody answers there.
    ModuleNotFoundError: dask.distributed is not installed.
    """
    import dask

    library = _library()
    if isinstance(cluster, library.Client):
        yield cluster
    elif isinstance(cluster, str) and cluster == "local":
        with (
            dask.config.set(SETTINGS),
            library.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=memory or "auto",
                # Whoever reaches a scheduler or worker has it run what he likes: this machine alone.
                host=LOOPBACK,
                dashboard_address=None,
                # Any free port: the usual one may be another cluster's.
                scheduler_kwargs={"dashboard_address": f"{LOOPBACK}:0"},
                # Nodes and factors are memory that Dask does not manage: it warns of them.
                silence_logs=logging.ERROR,
            ) as own,
            library.Client(own) as client,
        ):
            yield client
    elif isinstance(cluster, str) and ADDRESS.fullmatch(cluster):
        try:
            client = library.Client(cluster, timeout="10s")
        except (OSError, ValueError) as error:
            raise InputError(phrase("parts.no-scheduler", address=cluster, error=error)) from None
        with client:
            yield client
    else:
        raise InputError(phrase("parts.cluster", value=shown(cluster)))


def check_workers(client: Client, folder: Path) -> tuple[int, int | None, int]:
    """Count the workers, and refuse what cannot work together: versions that differ, a folder not seen.

    Returns how many there are; the least memory of one, None where nothing bounds it; the most that one holds
    before it begins, all that it needs being loaded.
    """
    versions: dict[str, str] = client.run(_version)
    if not versions:
        raise InputError(phrase("parts.no-workers"))
    own = _photocore.__version__
    others = sorted(address for address, version in versions.items() if version != own)
    if others:
        raise InputError(phrase("parts.versions", version=own, workers=others))
    blind = [address for address, seen in client.run(os.path.isdir, str(folder)).items() if not seen]
    if blind:
        raise InputError(phrase("parts.no-shared-disk", workers=sorted(blind), folder=folder))
    limits = [each for each in client.run(_limit).values() if each]
    held = max(client.run(_held).values())
    return len(versions), min(limits, default=None), held


def _library() -> Any:
    import distributed

    return distributed


def _version() -> str:
    try:
        from photogram import _photocore
    except ImportError:
        return ""
    return _photocore.__version__


def _limit(dask_worker: Any = None) -> int | None:
    """Return the bytes that Dask lets a worker take; Dask hands it over by this name."""
    limit: int | None = dask_worker.memory_manager.memory_limit
    return limit


def _held() -> int:
    """Return the bytes that a worker holds which has loaded what tasks use, and has no earlier run."""
    # What is imported here is what takes memory; nothing is called.
    import pyarrow.parquet  # noqa: F401

    import photogram.distributed.nodes  # noqa: F401

    shelf.clear_unless_used()
    return resident_memory() or 0
