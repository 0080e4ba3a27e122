"""Where tasks are done: one after the other in this process, or by whatever follows the same protocol."""

from __future__ import annotations

import pickle
import shutil
import tempfile
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Protocol

from photogram.errors import AdjustmentError

__all__ = ["Executor", "Handle", "Serial"]

Handle = Any
"""Stands for what a task will give."""


class Executor(Protocol):
    """Does tasks; those that are given handles get what these stand for."""

    def submit(
        self, function: Callable[..., Any], *arguments: Any, near: str = "", cost: float = 0.0
    ) -> Handle:
        """Have a task done, where possible on a certain worker.

        Parameters
        ----------
        function, arguments
            The task; handles among the arguments, and in lists among these, are replaced.
        near
            Where another one was done; empty for anywhere.
        cost
            The higher, the earlier it is done of those that wait.
        """

    def places(self) -> list[str]:
        """Return where tasks can be done, as :meth:`submit` takes it."""

    def first(self, handles: Collection[Handle]) -> Handle:
        """Wait until one of some tasks is done or has failed, and return it."""

    def value(self, handle: Handle) -> Any:
        """Return what a task has given; raise what it has raised."""

    def forget(self, handles: Collection[Handle]) -> None:
        """Let go of what tasks have given."""

    def stop(self) -> None:
        """Give up all tasks."""


class Serial:
    """Does every task at once, in this process; what tasks give is kept on disk.

    Parameters
    ----------
    directory
        Where temporary files go; None for the one of the system.
    """

    def __init__(self, directory: Path | None = None) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="photogram-", dir=directory))
        self._count = 0
        self._failed: dict[int, Exception] = {}

    def submit(self, function: Callable[..., Any], *arguments: Any, near: str = "", cost: float = 0.0) -> int:
        """Do a task."""
        del near, cost
        self._count += 1
        own = self._count
        try:
            found = function(*(self._resolved(each) for each in arguments))
            self._keep(own, found)
        except Exception as error:
            self._failed[own] = error
        return _Handle(own)

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

    def _keep(self, number: int, found: object) -> None:
        try:
            with open(self._path(number), "wb") as file:
                pickle.dump(found, file, protocol=5)
        except OSError as error:
            raise AdjustmentError(
                f"{self._folder}: what the parts leave cannot be kept there ({error.strerror or error}); the"
                " run can be taken up again"
            ) from None

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
