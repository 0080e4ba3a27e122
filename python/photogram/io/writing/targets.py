"""What stands where a result is to go: nothing, a file, or something that is written through."""

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

MOST_LINKS = 40  # Symbolic links that are followed, as by Linux
_Identity = tuple[int, int]


@dataclass(frozen=True)
class Target:
    """Where the bytes of an output go."""

    given: Path  # The path as the user wrote it; errors name it
    place: str  # The path after all symbolic links
    status: os.stat_result | None  # Of what stands there; None where nothing does
    descriptor: int | None = None  # A descriptor of this process that the path means, as `/dev/stdout` does

    @property
    def regular(self) -> bool:
        """Whether it is a file, or will be one; what is none (a FIFO, a device) is written through."""
        return self.descriptor is None and (self.status is None or stat.S_ISREG(self.status.st_mode))

    @property
    def directory(self) -> str:
        """The directory of the place."""
        return os.path.dirname(self.place)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let an :class:`OSError` name the file as the user did."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def follow(path: Path) -> Target:
    """Find out where an output goes."""
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
    """Return the descriptor of this process that a path like `/proc/self/fd/1` means."""
    directory, name = os.path.split(place)
    if not (name.isascii() and name.isdigit()):
        return None
    descriptors = rf"/proc/{os.getpid()}(/task/\d+)?/fd"
    return int(name) if re.fullmatch(descriptors, os.path.realpath(directory)) else None


class Guard:
    """Refuses outputs that are inputs, directories, or one another, by whatever name.

    What is no regular file (a FIFO, a device) is written through and may be anything.
    """

    def __init__(self, inputs: Iterable[Path], directories: Iterable[Path] = ()) -> None:
        self._read = {_identity(status) for path in inputs if (status := _status(path))}
        self._files: dict[object, Path] = {}
        self._above: set[str] = set()
        for path in directories:
            place = os.path.realpath(path)
            self._above |= {_spelling(place), *_above(place)}

    def add(self, path: Path) -> Target:
        """Return where an output goes."""
        target = follow(path)
        if not target.regular:
            return target
        if target.status and _identity(target.status) in self._read:
            raise InputError(phrase("file.over-input"), file=path)
        above = set(_above(target.place))
        # What two targets that are one have in common
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
    """Let a :class:`Guard` look at outputs before anything is computed."""
    guard = Guard(inputs, directories)
    for path in outputs:
        guard.add(path)


def _spelling(place: str) -> str:
    """Fold the letter case of the last part: file systems may not know it apart."""
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
