"""Hidden directories for incomplete files, and marks of incomplete sets."""

from __future__ import annotations

import errno
import json
import os
import re
import secrets
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from photogram.io.writing.targets import naming

if sys.platform != "win32":
    import fcntl

NAME = re.compile(r"\.photogram-([0-9a-f]{16})")
LOCK = "lock"
NEW = os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
DIRECTORY = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_NOFOLLOW", 0)
TRIALS = 16
UNSUPPORTED = (errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.EACCES, errno.EBADF)
MARK_NAME = re.compile(r"photogram-incomplete-([0-9a-f]{16})\.txt")
MARK_TEXT = """\
The files named below belong together, and photogram was ended while it put them in place:
some may be those of an earlier run. Run the command again; this file goes when all of those
that stand in this directory have been written again, or remove it yourself.
"""


class Staging:
    """A private directory with a random name, locked during the life of its process.

    The lock shows whether the process lives. Process ids are reused, and are meaningless in other containers
    or on other machines that share a disk. On file systems without locks, every such directory counts as
    active.
    """

    def __init__(self, directory: str) -> None:
        self.directory = directory
        self.token = secrets.token_hex(8)
        self._lock: int | None = None

    def begin(self) -> None:
        """Create the directory; :meth:`remove` is always called."""
        for _ in range(TRIALS):
            if self._begin():
                return
            self.remove()
            self.token = secrets.token_hex(8)
        raise OSError(errno.EEXIST, os.strerror(errno.EEXIST))

    @property
    def path(self) -> str:
        """Path of the directory."""
        return os.path.join(self.directory, f".photogram-{self.token}")

    def _begin(self) -> bool:
        """Create and lock the directory; False if another run removed it."""
        os.mkdir(self.path, 0o700)
        lock = os.path.join(self.path, LOCK)
        try:
            self._lock = os.open(lock, os.O_RDWR | NEW, 0o600)
        except FileNotFoundError:
            return False
        locked = try_lock(self._lock)
        return locked is None or (locked and os.fstat(self._lock).st_nlink > 0)

    def remove(self) -> None:
        """Remove the directory and its contents, as far as possible."""
        with suppress(OSError):
            _empty(self.path)
        if self._lock is not None:
            with suppress(OSError):
                os.close(self._lock)
            self._lock = None


def alive(directory: str, token: str) -> bool:
    """Return whether the run with this token still works in a directory."""
    path = os.path.join(directory, f".photogram-{token}", LOCK)
    try:
        lock = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return False
    try:
        return not try_lock(lock)
    finally:
        os.close(lock)


def remove_leftovers(directory: str) -> None:
    """Remove staging directories of terminated runs of the same user."""
    with suppress(OSError), os.scandir(directory) as entries:
        for entry in entries:
            if NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                _remove_dead(entry.path)


def _remove_dead(path: str) -> None:
    with suppress(OSError):
        opened = os.open(path, DIRECTORY)
        try:
            if os.fstat(opened).st_uid != os.geteuid():
                return
            try:
                lock = os.open(LOCK, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0), dir_fd=opened)
            except FileNotFoundError:
                # New, or incompletely removed: it is removed only if it is empty.
                os.rmdir(path)
                return
            try:
                if try_lock(lock):
                    _empty(path)
            finally:
                os.close(lock)
        finally:
            os.close(opened)


def _empty(path: str) -> None:
    """Remove a staging directory, the lock last, without following links."""
    opened = os.open(path, DIRECTORY)
    try:
        for name in sorted(os.listdir(opened), key=lambda name: name == LOCK):
            os.unlink(name, dir_fd=opened)
    finally:
        os.close(opened)
    os.rmdir(path)


def try_lock(descriptor: int) -> bool | None:
    """Lock a file; False if it is locked, None without support of locks."""
    if sys.platform == "win32":
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def sync_directory(directory: str) -> None:
    """Flush the names in a directory to the disk, if the file system can."""
    try:
        opened = os.open(directory, os.O_RDONLY | getattr(os, "O_DIRECTORY", 0))
        try:
            os.fsync(opened)
        finally:
            os.close(opened)
    except OSError as error:
        if error.errno not in UNSUPPORTED:
            raise


def mark(staging: Staging, places: Iterable[str]) -> None:
    """Create the mark file of a set that may be incomplete."""
    lines = [json.dumps(os.path.relpath(place, staging.directory)) for place in places]
    content = (MARK_TEXT + "\n".join(lines) + "\n").encode()
    made = os.path.join(staging.path, "mark")
    with naming(Path(_path(staging))):
        opened = os.open(made, os.O_WRONLY | NEW, 0o666)
        try:
            while content:
                content = content[os.write(opened, content) :]
            os.fsync(opened)
        finally:
            os.close(opened)
        os.replace(made, _path(staging))
        sync_directory(staging.directory)


def unmark(staging: Staging) -> None:
    """Remove the mark file of a complete set."""
    with naming(Path(_path(staging))), suppress(FileNotFoundError):
        os.unlink(_path(staging))
        sync_directory(staging.directory)


def clear_marks(places: Iterable[str]) -> None:
    """Remove the marks of terminated runs whose files have all been written again."""
    written = set(places)
    for directory in {os.path.dirname(place) for place in written}:
        for path, named in _dead_marks(directory):
            here = {place for place in named if os.path.dirname(place) == directory}
            if here <= written:
                with suppress(OSError):
                    os.unlink(path)


def doubtful(paths: Iterable[Path]) -> dict[Path, str]:
    """Return the files of sets that may be incomplete, with the marks."""
    found: dict[Path, str] = {}
    marks: dict[str, list[tuple[str, set[str]]]] = {}
    for path in paths:
        place = os.path.realpath(path)
        directory = os.path.dirname(place)
        if directory not in marks:
            marks[directory] = _dead_marks(directory)
        found.update((path, mark) for mark, named in marks[directory] if place in named)
    return found


def _path(staging: Staging) -> str:
    return os.path.join(staging.directory, f"photogram-incomplete-{staging.token}.txt")


def _dead_marks(directory: str) -> list[tuple[str, set[str]]]:
    """Return marks of terminated runs in a directory, with their paths."""
    found = []
    with suppress(OSError):
        for name in sorted(os.listdir(directory)):
            match = MARK_NAME.fullmatch(name)
            if match and not alive(directory, match[1]):
                path, places = os.path.join(directory, name), set[str]()
                found.append((path, places))
                with suppress(OSError), open(path, encoding="utf-8", errors="replace") as lines:
                    for line in lines:
                        with suppress(ValueError):
                            place = json.loads(line)
                            if isinstance(place, str):
                                places.add(os.path.normpath(os.path.join(directory, place)))
    return found
