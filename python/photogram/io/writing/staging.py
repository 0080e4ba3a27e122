"""Hidden directories in which files are completed, and marks of sets that were not all put in place."""

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
    """A directory with a random name that only its user may enter, locked as long as its process lives.

    The lock, not the number of a process, tells whether the process lives: numbers are used again, and mean
    nothing in other containers or on other machines that share a disk. Where the file system knows no locks,
    every such directory counts as alive.
    """

    def __init__(self, directory: str) -> None:
        self.directory = directory
        self.token = secrets.token_hex(8)
        self._lock: int | None = None

    def begin(self) -> None:
        """Make the directory; :meth:`remove` is called whatever happens."""
        for _ in range(TRIALS):
            if self._begin():
                return
            self.remove()
            self.token = secrets.token_hex(8)
        raise OSError(errno.EEXIST, os.strerror(errno.EEXIST))

    @property
    def path(self) -> str:
        """Where it is."""
        return os.path.join(self.directory, f".photogram-{self.token}")

    def _begin(self) -> bool:
        """Make and lock the directory; False if another run took it for a leftover meanwhile."""
        os.mkdir(self.path, 0o700)
        lock = os.path.join(self.path, LOCK)
        try:
            self._lock = os.open(lock, os.O_RDWR | NEW, 0o600)
        except FileNotFoundError:
            return False
        locked = try_lock(self._lock)
        return locked is None or (locked and os.fstat(self._lock).st_nlink > 0)

    def remove(self) -> None:
        """Remove the directory with what is in it, as far as possible."""
        with suppress(OSError):
            _empty(self.path)
        if self._lock is not None:
            with suppress(OSError):
                os.close(self._lock)
            self._lock = None


def alive(directory: str, token: str) -> bool:
    """Tell whether the run with this token still works in a directory."""
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
    """Remove the staging directories that dead runs of the same user have left in a directory."""
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
                # Just begun, or its removal was cut short: it goes only if it is empty.
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
    """Remove the files of a staging directory, the lock last, and itself; no link is followed."""
    opened = os.open(path, DIRECTORY)
    try:
        for name in sorted(os.listdir(opened), key=lambda name: name == LOCK):
            os.unlink(name, dir_fd=opened)
    finally:
        os.close(opened)
    os.rmdir(path)


def try_lock(descriptor: int) -> bool | None:
    """Lock a file; False where another process holds it, None where the file system knows no locks."""
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
    """Put the names in a directory on the disk, where the file system can."""
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
    """Put a mark into the directory of a set: from now on it may be incomplete."""
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
    """Take the mark of a set away: it is complete."""
    with naming(Path(_path(staging))), suppress(FileNotFoundError):
        os.unlink(_path(staging))
        sync_directory(staging.directory)


def clear_marks(places: Iterable[str]) -> None:
    """Remove the marks of dead runs whose files have all been written again."""
    written = set(places)
    for directory in {os.path.dirname(place) for place in written}:
        for path, named in _dead_marks(directory):
            here = {place for place in named if os.path.dirname(place) == directory}
            if here <= written:
                with suppress(OSError):
                    os.unlink(path)


def doubtful(paths: Iterable[Path]) -> dict[Path, str]:
    """Return those files that belong to a set which may be incomplete, with the mark that says so."""
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
    """Return the marks of dead runs in a directory, with the places that they name, other lines left out."""
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
