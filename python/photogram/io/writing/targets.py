"""Targets of results: new files, existing files, pipes and devices."""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

MOST_LINKS = 40  # Largest number of symbolic links that are followed, as in Linux
_Identity = tuple[int, int]


@dataclass(frozen=True)
class Target:
    """The target of an output."""

    given: Path  # The path of the user, for errors
    place: str  # The path after all symbolic links
    status: os.stat_result | None  # Status of the existing file; None without
    descriptor: int | None = None  # File descriptor of this process, for paths such as `/dev/stdout`

    @property
    def regular(self) -> bool:
        """Whether the target is a (new) regular file, not a pipe or device."""
        return self.descriptor is None and (self.status is None or stat.S_ISREG(self.status.st_mode))

    @property
    def directory(self) -> str:
        """The directory of the target."""
        return os.path.dirname(self.place)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the path of the user to an :class:`OSError`."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def follow(path: Path) -> Target:
    """Return the target of an output path."""
    if "\0" in str(path):
        raise InputError(phrase("file.nul"), file=path)
    with naming(path):
        place = os.fspath(path)
        for _ in range(MOST_LINKS):
            descriptor = _own_descriptor(place)
            if descriptor is not None:
                return Target(path, place, os.fstat(descriptor), descriptor)
            try:
                place = os.path.join(os.path.dirname(place), os.readlink(place))
            except OSError as error:
                if error.errno not in (errno.EINVAL, errno.ENOENT, errno.ENOTDIR):
                    raise
                break
        else:
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        try:
            status = os.stat(place)
        except FileNotFoundError:
            status = None
    directory, name = os.path.split(place)
    if name in ("", os.curdir, os.pardir) or (status and stat.S_ISDIR(status.st_mode)):
        raise InputError(phrase("file.directory"), file=path)
    return Target(path, os.path.join(os.path.realpath(directory), name), status)


def _own_descriptor(place: str) -> int | None:
    """Return the file descriptor of this process for a path like `/proc/self/fd/1`."""
    directory, name = os.path.split(place)
    if not (name.isascii() and name.isdigit()):
        return None
    descriptors = rf"/proc/{os.getpid()}(/task/\d+)?/fd"
    return int(name) if re.fullmatch(descriptors, os.path.realpath(directory)) else None


class Guard:
    """Rejects outputs that are inputs, directories, or one another, under any name.

    Pipes and devices are written directly and are not checked.
    """

    def __init__(self, inputs: Iterable[Path], directories: Iterable[Path] = ()) -> None:
        self._read = {_identity(status) for path in inputs if (status := _status(path))}
        self._files: dict[object, Path] = {}
        self._above: set[str] = set()
        for path in directories:
            place = os.path.realpath(path)
            self._above |= {_spelling(place), *_above(place)}

    def add(self, path: Path) -> Target:
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
    while (upper := os.path.dirname(place)) != place:
        yield _spelling(upper)
        place = upper


def _identity(status: os.stat_result) -> _Identity:
    return status.st_dev, status.st_ino


def _status(path: Path) -> os.stat_result | None:
    try:
        return os.stat(path)
    except (OSError, ValueError):
        return None
