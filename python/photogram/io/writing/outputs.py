"""A set of files that are completed, then moved to their paths together."""

from __future__ import annotations

import errno
import io
import os
import signal
import stat
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, BinaryIO, Self

from photogram.io.writing.staging import (
    NEW,
    Staging,
    clear_marks,
    mark,
    remove_leftovers,
    sync_directory,
    unmark,
)
from photogram.io.writing.targets import Guard, Target, naming
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

Content = bytes | Callable[[BinaryIO], None]  # Bytes, or a function that writes them to a file

PERMISSIONS = 0o777
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class _Raw(io.RawIOBase):
    """A file descriptor whose errors contain the path of the user."""

    def __init__(self, descriptor: int, given: Path) -> None:
        self._descriptor = descriptor
        self._given = given

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._descriptor

    def write(self, data: ReadableBuffer) -> int:
        with naming(self._given):
            return os.write(self._descriptor, data)

    def close(self) -> None:
        if not self.closed:
            super().close()
            with naming(self._given):
                os.close(self._descriptor)


@dataclass
class _Staged:
    """A file that is completed in a staging directory."""

    target: Target
    path: str
    file: io.BufferedWriter
    old: str | None = None
    placed: bool = False

    def complete(self) -> None:
        if not self.file.closed:
            with naming(self.target.given):
                self.file.flush()
                os.fsync(self.file.fileno())
            self.file.close()

    def keep(self) -> None:
        """Preserve the existing file for :meth:`restore`, if possible."""
        if self.target.status:
            with suppress(OSError):
                os.link(self.target.place, f"{self.path}.old", follow_symlinks=False)
                self.old = f"{self.path}.old"

    def place(self) -> None:
        with naming(self.target.given):
            os.replace(self.path, self.target.place)
        self.placed = True

    def restore(self) -> bool:
        """Restore the previous file; return False if this is impossible."""
        if not self.placed:
            return True
        try:
            if self.old:
                os.replace(self.old, self.target.place)
            elif not self.target.status:
                os.unlink(self.target.place)
            else:
                return False
        except OSError:
            return False
        return True


class OutputSet:
    """A set of files that are either all written or not at all; a context manager.

    Every file is completed in a hidden directory next to its target. When all are complete, they are moved to
    their paths in one pass, during which signals are deferred. If one cannot be moved, the others are moved
    back. While several files are moved, each directory has a mark file, which reports an interrupted run. An
    exception of the block, a signal or a failure restores the previous state.

    Symbolic links are followed and preserved. Pipes and devices are written directly: immediately by
    :meth:`open`, before the files are moved by :meth:`write`.
    """

    def __init__(self, inputs: Iterable[Path] = ()) -> None:
        self._guard = Guard(inputs)
        self._staged: list[_Staged] = []
        self._streams: list[io.BufferedWriter] = []
        self._late: list[tuple[Target, Content]] = []
        self._stagings: dict[str, Staging] = {}
        self._made: list[str] = []

    def __enter__(self) -> Self:
        _live.append(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._finish()
        finally:
            self.abandon()

    def open(self, path: Path) -> io.BufferedWriter:
        """Open a file for writing in pieces; the set closes it."""
        target = self._target(path)
        if target.regular:
            return self._stage(target)
        file = _stream(target)
        self._streams.append(file)
        return file

    def write(self, path: Path, content: Content) -> None:
        """Write a file."""
        target = self._target(path)
        if target.regular:
            _put(self._stage(target), content)
            self._staged[-1].complete()
        else:
            self._late.append((target, content))

    def _target(self, path: Path) -> Target:
        target = self._guard.add(path)
        if target.regular and target.status and not os.access(target.place, os.W_OK):
            raise PermissionError(errno.EACCES, "is write-protected", str(path))
        return target

    def _stage(self, target: Target) -> io.BufferedWriter:
        with naming(target.given):
            if target.directory not in self._stagings:
                self._make(target.directory)
                remove_leftovers(target.directory)
                # Registered before its creation, so that a signal always removes it.
                self._stagings[target.directory] = Staging(target.directory)
                self._stagings[target.directory].begin()
            path = os.path.join(self._stagings[target.directory].path, str(len(self._staged)))
            mode = stat.S_IMODE(target.status.st_mode) & PERMISSIONS if target.status else 0o666
            descriptor = os.open(path, os.O_WRONLY | NEW, mode)
            file: io.BufferedWriter = io.BufferedWriter(_Raw(descriptor, target.given))
            self._staged.append(_Staged(target, path, file))
            if target.status:
                _keep_owner(descriptor, target.status, mode)
        return file

    def _make(self, directory: str) -> None:
        if os.path.isdir(directory):
            return
        self._make(os.path.dirname(directory))
        # Registered before its creation, so that a signal always removes it.
        self._made.append(directory)
        try:
            os.mkdir(directory)
        except FileExistsError:
            self._made.remove(directory)
            if not os.path.isdir(directory):
                raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR)) from None

    def _finish(self) -> None:
        for staged in self._staged:
            staged.complete()
        for file in self._streams:
            file.close()
        for target, content in self._late:
            with _stream(target) as file:
                _put(file, content)
        with deferred():
            self._place()

    def _place(self) -> None:
        """Move all files to their paths, or none."""
        places = [staged.target.place for staged in self._staged]
        several = len(places) > 1
        try:
            for staged in self._staged:
                staged.keep()
            if several:
                for staging in self._stagings.values():
                    mark(staging, places)
            for staged in self._staged:
                staged.place()
            for directory in {*self._stagings, *(os.path.dirname(made) for made in self._made)}:
                with naming(Path(directory)):
                    sync_directory(directory)
        except BaseException:
            restored = [staged.restore() for staged in self._staged]
            if all(restored):
                self._unmark()
            raise
        self._made.clear()
        self._unmark()
        clear_marks(places)

    def _unmark(self) -> None:
        for staging in self._stagings.values():
            unmark(staging)

    def abandon(self) -> None:
        """Remove everything that the set has created, except files at their paths."""
        with deferred():
            for file in [*(staged.file for staged in self._staged), *self._streams]:
                # Without flushing: incomplete content is not written.
                with suppress(OSError):
                    file.raw.close()
            for staging in self._stagings.values():
                staging.remove()
            for directory in reversed(self._made):
                with suppress(OSError):
                    os.rmdir(directory)
            if self in _live:
                _live.remove(self)


_live: list[OutputSet] = []  # Active sets, for a signal that ends the process


def abandon_all() -> None:
    """Abandon all sets of this process, which is about to end."""
    while _live:
        _live[-1].abandon()


def write_whole(files: Mapping[Path, Content]) -> None:
    """Write contents by path: all, or none."""
    with OutputSet() as outputs:
        for path, content in files.items():
            outputs.write(path, content)


def _put(file: io.BufferedWriter, content: Content) -> None:
    if callable(content):
        content(file)
    else:
        file.write(content)


def _stream(target: Target) -> io.BufferedWriter:
    """Open a pipe or device for direct writing."""
    with naming(target.given):
        if target.descriptor is None:
            descriptor = os.open(target.place, os.O_WRONLY | getattr(os, "O_NOCTTY", 0))
        else:
            # Previous output to the same target must precede.
            for stream in (sys.stdout, sys.stderr):
                if stream is not None:
                    stream.flush()
            descriptor = os.dup(target.descriptor)
    return io.BufferedWriter(_Raw(descriptor, target.given))


def _keep_owner(descriptor: int, status: os.stat_result, mode: int) -> None:
    """Set owner (if permitted) and permissions of a new file as of the replaced one."""
    if sys.platform == "win32":
        return
    made = os.fstat(descriptor)
    if (made.st_uid, made.st_gid) != (status.st_uid, status.st_gid):
        with suppress(OSError):
            os.fchown(descriptor, status.st_uid, status.st_gid)
    os.fchmod(descriptor, mode)


@contextmanager
def deferred() -> Iterator[None]:
    """Defer termination signals until the end of the block.

    Only the main thread runs handlers of signals; other threads defer nothing.
    """
    caught: list[int] = []
    former: dict[int, Any] = {}

    def wait(number: int, _frame: FrameType | None) -> None:
        caught.append(number)

    try:
        if threading.current_thread() is threading.main_thread():
            for number in ENDING:
                handler = signal.getsignal(number)
                if handler is not None and handler != signal.SIG_IGN:
                    former[number] = handler
                    signal.signal(number, wait)
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
        for number in dict.fromkeys(caught):
            signal.raise_signal(number)
