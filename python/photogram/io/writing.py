"""Writer of all results: sets of files that are written together, or not at all.

`docs/command-line.md` describes the behaviour for users.
"""

from __future__ import annotations

import errno
import io
import os
import secrets
import stat
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, BinaryIO, Self

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

Content = bytes | Callable[[BinaryIO], object]  # Bytes, or a function that writes them to a file
Files = Mapping[Path, Content]

NEW = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
MOST_PENDING = 32  # Largest number of files that wait for the disk
_Identity = tuple[int, int]
_Buffer = io.BufferedRandom | io.BufferedWriter


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the path of the user to an :class:`OSError`."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


class _File(io.FileIO):
    """An open descriptor whose errors contain the path of the user."""

    def __init__(self, descriptor: int, given: Path, mode: str = "wb") -> None:
        super().__init__(descriptor, mode)
        self.given = given

    def write(self, data: ReadableBuffer) -> int:
        with naming(self.given):
            return os.write(self.fileno(), data)

    def close(self) -> None:
        with naming(self.given):
            super().close()


@dataclass(eq=False)
class _Target:
    """The target of an output; a file has a temporary name until its set is complete."""

    given: Path  # The path of the user, for errors
    place: str  # The path after all symbolic links
    status: os.stat_result | None  # Status of the existing file; None without
    descriptor: int | None = None  # Of standard output or error, if it is the target
    path: str = ""  # The temporary name
    file: io.BufferedRandom | None = None
    is_moved: bool = False  # Or is being moved

    @property
    def regular(self) -> bool:
        """Whether the target is a (new) regular file, not a pipe or device."""
        return self.descriptor is None and (self.status is None or stat.S_ISREG(self.status.st_mode))

    @property
    def old(self) -> str:
        """Second name of the file that is replaced."""
        return f"{self.path}.old"

    def open(self) -> io.BufferedRandom:
        """Create the temporary file, with permissions and owner of the existing one."""
        mode = stat.S_IMODE(self.status.st_mode) & 0o777 if self.status else 0o666
        descriptor = os.open(self.path, NEW, mode)
        self.file = io.BufferedRandom(_File(descriptor, self.given, "w+b"))
        if self.status and sys.platform != "win32":
            with suppress(OSError):  # Only a privileged process may set another owner.
                os.fchown(descriptor, self.status.st_uid, self.status.st_gid)
            os.fchmod(descriptor, mode)
        return self.file

    def stream(self) -> io.BufferedWriter:
        """Open a pipe or device for direct writing."""
        with naming(self.given):
            if self.descriptor is None:
                descriptor = os.open(self.given, os.O_WRONLY | getattr(os, "O_NOCTTY", 0))
            else:
                # Previous output to the same target must precede.
                for stream in filter(None, (sys.stdout, sys.stderr)):
                    stream.flush()
                descriptor = os.dup(self.descriptor)
        return io.BufferedWriter(_File(descriptor, self.given))

    def complete(self) -> None:
        """Write a file to disk."""
        if self.file is not None and not self.file.closed:
            with naming(self.given):
                self.file.flush()
                os.fsync(self.file.fileno())
            self.file.close()

    def move(self) -> None:
        if self.status:
            with suppress(OSError):
                os.link(self.place, self.old, follow_symlinks=False)
        with naming(self.given):
            self.is_moved = True
            os.replace(self.path, self.place)

    def remove(self, *, restore: bool) -> None:
        """Remove the temporary names; restore the previous file if this one was moved."""
        with suppress(OSError):
            if restore and self.is_moved and not os.path.lexists(self.path):
                if self.status:
                    os.replace(self.old, self.place)
                else:
                    os.unlink(self.place)
        for path in (self.path, self.old):
            with suppress(OSError):
                os.unlink(path)


def follow(path: Path) -> _Target:
    if "\0" in str(path):
        raise InputError(phrase("file.nul"), file=path)
    with naming(path):
        try:
            status = os.stat(path)
        except FileNotFoundError:
            status = None
    target = _Target(path, os.path.realpath(path), status)
    if path.name in ("", os.pardir) or (status and stat.S_ISDIR(status.st_mode)):
        raise InputError(phrase("file.directory"), file=path)
    for descriptor in (2, 1):
        with suppress(OSError):
            if status and os.path.samestat(os.fstat(descriptor), status):
                target.descriptor = descriptor
    return target


class Guard:
    """Rejects outputs that are inputs, directories, or one another, under any name.

    Pipes and devices are written directly and are not checked.
    """

    def __init__(self, inputs: Iterable[Path], directories: Iterable[Path] = ()) -> None:
        self._read: set[_Identity] = set()
        for path in inputs:
            with suppress(OSError, ValueError):
                self._read.add(_identity(os.stat(path)))
        self._files: dict[object, Path] = {}
        self._above: set[str] = set()
        for path in directories:
            place = os.path.realpath(path)
            self._above |= {_spelling(place), *_above(place)}

    def add(self, path: Path) -> _Target:
        """Check an output and return its target."""
        target = follow(path)
        if not target.regular:
            return target
        if target.status and _identity(target.status) in self._read:
            raise InputError(phrase("file.over-input"), file=path)
        above = set(_above(target.place))
        # Keys by which two targets are identical
        keys: list[object] = [_spelling(target.place)]
        keys += [_identity(target.status)] if target.status else []
        if any(key in self._files for key in keys):
            raise InputError(phrase("file.same-output"), file=path)
        under = next((self._files[each] for each in above if each in self._files), None)
        if under or keys[0] in self._above:
            raise InputError(phrase("file.output-folder"), file=under or path)
        self._files |= dict.fromkeys(keys, path)
        self._above |= above
        return target


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path], directories: Iterable[Path] = ()) -> None:
    """Check outputs with a :class:`Guard` before anything is computed."""
    guard = Guard(inputs, directories)
    for path in outputs:
        guard.add(path)


def _spelling(place: str) -> str:
    """Fold the letter case of the last part, which some file systems ignore."""
    directory, name = os.path.split(place)
    return os.path.join(directory, name.casefold())


def _above(place: str) -> Iterable[str]:
    return (_spelling(str(each)) for each in Path(place).parents)


def _identity(status: os.stat_result) -> _Identity:
    return status.st_dev, status.st_ino


class OutputSet:
    """A set of files that are either all written or not at all; a context manager.

    Every file is completed under a temporary name next to its target. When all are complete, they are renamed
    in one pass. An exception of the block, a signal or a failure restores the previous state.

    Symbolic links are followed and preserved. Pipes and devices are written directly: immediately by
    :meth:`open`, before the files are renamed by :meth:`write`.
    """

    def __init__(self, inputs: Iterable[Path] = ()) -> None:
        self._guard = Guard(inputs)
        self._staged: list[_Target] = []
        self._streams: list[io.BufferedWriter] = []
        self._late: list[tuple[_Target, Content]] = []
        self._made: list[str] = []
        self._pending: list[Future[None]] = []
        self._disk = ThreadPoolExecutor(MOST_PENDING)
        self._is_complete = False

    def __enter__(self) -> Self:
        _live.append(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                for future in self._pending:
                    future.result()
                for staged in self._staged:
                    staged.complete()
                for file in self._streams:
                    file.close()
                for target, content in self._late:
                    with target.stream() as file:
                        _put(file, content)
                for staged in self._staged:
                    staged.move()
                self._is_complete = True
        finally:
            self._disk.shutdown()
            self.abandon()

    def open(self, path: Path) -> _Buffer:
        """Open a file for writing in pieces; the set closes it."""
        target = self._target(path)
        if target.regular:
            return self._stage(target)
        file = target.stream()
        self._streams.append(file)
        return file

    def write(self, path: Path, content: Content) -> None:
        """Write a file."""
        target = self._target(path)
        if target.regular:
            _put(self._stage(target), content)
            # Meanwhile other results are computed and written.
            self._pending.append(self._disk.submit(target.complete))
            if len(self._pending) > MOST_PENDING:
                self._pending[-MOST_PENDING].result()
        else:
            self._late.append((target, content))

    def _target(self, path: Path) -> _Target:
        target = self._guard.add(path)
        if target.regular and target.status and not os.access(target.place, os.W_OK):
            raise PermissionError(errno.EACCES, "is write-protected", str(path))
        return target

    def _stage(self, target: _Target) -> io.BufferedRandom:
        with naming(target.given):
            directory = os.path.dirname(target.place)
            self._make(directory)
            # Registered before its creation, so that a signal always removes it.
            target.path = os.path.join(directory, f".photogram-{secrets.token_hex(8)}")
            self._staged.append(target)
            return target.open()

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

    def abandon(self) -> None:
        """Remove everything that the set has created, except files of a complete set."""
        for file in [*(staged.file for staged in self._staged), *self._streams]:
            # Without flushing: incomplete content is not written.
            with suppress(OSError):
                if file is not None:
                    file.raw.close()
        for staged in self._staged:
            staged.remove(restore=not self._is_complete)
        for directory in [] if self._is_complete else reversed(self._made):
            with suppress(OSError):
                os.rmdir(directory)
        if self in _live:
            _live.remove(self)


_live: list[OutputSet] = []  # Active sets, for a signal that ends the process


def abandon_all() -> None:
    """Abandon all sets of this process, which is about to end."""
    while _live:
        _live[-1].abandon()


def write_whole(files: Files) -> None:
    """Write contents by path: all, or none."""
    with OutputSet() as outputs:
        for path, content in files.items():
            outputs.write(path, content)


def _put(file: _Buffer, content: Content) -> None:
    if callable(content):
        content(file)
    else:
        file.write(content)
