"""What stands where a result is to go: nothing, a file, or something that is written through."""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass

__all__ = ["Target", "follow", "naming"]

MOST_LINKS = 40
"""Symbolic links that are followed, as by Linux."""


@dataclass(frozen=True)
class Target:
    """Where the bytes of an output go.

    Attributes
    ----------
    given
        The path as the user wrote it; errors name it.
    place
        The path after all symbolic links.
    status
        Of what stands there; None where nothing does.
    descriptor
        A descriptor of this process that the path means, as `/dev/stdout` does.
    """

    given: Path
    place: str
    status: os.stat_result | None
    descriptor: int | None = None

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
    """Find out where an output goes.

    Raises
    ------
    InputError
        The path is a directory, or no path at all.
    OSError
        Its symbolic links form a loop, or its name is too long.
    """
    if "\0" in str(path):
        raise InputError("a path cannot hold a NUL character", file=path)
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
        raise InputError("is a directory", file=path)
    return Target(path, os.path.join(os.path.realpath(directory), name), status)


def _own_descriptor(place: str) -> int | None:
    """Return the descriptor of this process that a path like `/proc/self/fd/1` means."""
    directory, name = os.path.split(place)
    if not (name.isascii() and name.isdigit()):
        return None
    descriptors = rf"/proc/{os.getpid()}(/task/\d+)?/fd"
    return int(name) if re.fullmatch(descriptors, os.path.realpath(directory)) else None
