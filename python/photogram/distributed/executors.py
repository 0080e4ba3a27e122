"""Execution of tasks: sequentially in this process, or on the workers of a Dask cluster.

Scheduling, transport and retries on a cluster are done by `distributed`.
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
from photogram.arguments.arrays import value_field
from photogram.distributed.shelf import shelf
from photogram.errors import AdjustmentError, InputError
from photogram.memory import resident_memory
from photogram.words import phrase

Handle = Any  # Represents the future result of a task
Client = Any
Future = Any  # Class of `distributed`, an optional package with a slow import
SETTINGS = {
    # A factor remains with its worker; its size is planned and must not pause the worker.
    "distributed.worker.memory.pause": False,
    # A stolen task would need to form its factor again.
    "distributed.scheduler.work-stealing": False,
    # The own pool of Arrow would retain the memory of tables.
    "distributed.nanny.environ.ARROW_DEFAULT_MEMORY_POOL": "system",
}  # Settings of local clusters
LOOPBACK = "127.0.0.1"
ADDRESS = re.compile(r"(?:[a-z]+://)?[\w.\-\[\]:]+:\d{1,5}", re.ASCII)  # Dask reads other texts as file names


class Serial:
    """Sequential execution in this process; results are stored on disk, in `directory`.

    Handles in the arguments of a task, also in lists, are replaced by their results.
    """

    def __init__(self, directory: Path | None = None) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="photogram-", dir=directory))
        self._count = 0
        self._failed: dict[int, Exception] = {}

    def submit(self, function: Callable[..., Any], *arguments: Any, near: str = "", cost: float = 0.0) -> int:
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
        return [""]

    def first(self, handles: Collection[int]) -> int:
        return min(handles)

    def value(self, handle: int) -> Any:
        if handle in self._failed:
            raise self._failed[handle]
        # Only this process writes here, in a private folder of the user.
        with open(self._path(handle), "rb") as file:
            return pickle.load(file)

    def forget(self, handles: Collection[int]) -> None:
        for each in handles:
            self._path(each).unlink(missing_ok=True)
            self._failed.pop(each, None)

    def stop(self) -> None:
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
    """Number of a task."""


class Workers:
    """Execution by the workers of a cluster, through a client of its scheduler.

    Dask recomputes lost results, because tasks depend on their arguments only. If a task needs a factor that
    was lost with a worker, the driver has the factor formed again.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._futures: set[Future] = set()
        self._count = 0

    def submit(
        self, function: Callable[..., Any], *arguments: Any, near: str = "", cost: float = 0.0
    ) -> Future:
        """Submit a task; `cost` is its priority, `near` its preferred worker."""
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
        return sorted(self._client.nthreads())

    def first(self, handles: Collection[Future]) -> Future:
        return next(iter(_library().wait(list(handles), return_when="FIRST_COMPLETED").done))

    def value(self, handle: Future) -> Any:
        from distributed.client import FutureCancelledError

        from distributed import KilledWorker

        try:
            return handle.result()
        except KilledWorker as error:
            raise AdjustmentError(phrase("parts.workers-died", error=error)) from None
        except (FutureCancelledError, OSError) as error:
            raise AdjustmentError(phrase("parts.scheduler-lost", error=error)) from None

    def forget(self, handles: Collection[Future]) -> None:
        for each in handles:
            each.release()
            self._futures.discard(each)

    def stop(self) -> None:
        futures, self._futures = list(self._futures), set()
        if futures and self._client.status == "running":
            self._client.cancel(futures, force=True)


Executor = Serial | Workers


@contextmanager
def connected(cluster: Any, workers: int | None, memory: int | None) -> Iterator[Client]:
    """Connect to a scheduler, or start a local cluster with `workers` of `memory` bytes each.

    `cluster` is a client (not closed here), `local`, or an address. InputError without a response.
    ModuleNotFoundError if dask.distributed is not installed.
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
                # Anyone with access to a scheduler or worker can run code there: restrict it to this machine.
                host=LOOPBACK,
                dashboard_address=None,
                # Use any free port, because another cluster may use the default one.
                scheduler_kwargs={"dashboard_address": f"{LOOPBACK}:0"},
                # Dask does not manage the memory of nodes and factors and would warn.
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
        raise InputError(phrase("parts.cluster", value=value_field(cluster)))


def check_workers(client: Client, folder: Path) -> tuple[int, int | None, int]:
    """Count the workers; reject different versions and a folder that they cannot access.

    Return the number of workers, the minimum memory of a worker (None: unlimited), and the maximum memory in
    use after all modules are loaded.
    """
    versions: dict[str, str] = client.run(_version)
    if not versions:
        raise InputError(phrase("parts.no-workers"))
    own = _photocore.__version__
    others = sorted(address for address, version in versions.items() if version != own)
    if others:
        raise InputError(phrase("parts.versions", version=own, workers=others))
    facts: dict[str, tuple[bool, int | None, int]] = client.run(_facts, str(folder))
    if blind := sorted(address for address, (seen, *_) in facts.items() if not seen):
        raise InputError(phrase("parts.no-shared-disk", workers=blind, folder=folder))
    limits = [limit for _, limit, _ in facts.values() if limit]
    return len(versions), min(limits, default=None), max(held for *_, held in facts.values())


def _library() -> Any:
    import distributed

    return distributed


def _version() -> str:
    try:
        from photogram import _photocore
    except ImportError:
        return ""
    return _photocore.__version__


def _facts(folder: str, dask_worker: Any = None) -> tuple[bool, int | None, int]:
    """Return whether a worker has a folder, its memory limit, and its memory in use, bytes.

    Memory is used by all modules, without earlier runs. Dask supplies the worker by name.
    """
    # These imports only allocate their memory in advance.
    import pyarrow.parquet  # noqa: F401

    import photogram.distributed.nodes  # noqa: F401

    shelf.clear_unless_used()
    return os.path.isdir(folder), dask_worker.memory_manager.memory_limit, resident_memory() or 0
