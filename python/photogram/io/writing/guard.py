"""No result goes over what is read, and no two to one place."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from photogram.errors import InputError
from photogram.io.writing.targets import Target, follow

__all__ = ["Guard", "check_outputs"]

_Identity = tuple[int, int]


class Guard:
    """Refuses outputs that are inputs, directories, or one another, by whatever name.

    What is no regular file (a FIFO, a device) is written through and may be anything.

    Parameters
    ----------
    inputs
        The files that are read; those that are not there do not matter.
    directories
        Directories that are made for results if need be.
    """

    def __init__(self, inputs: Iterable[Path], directories: Iterable[Path] = ()) -> None:
        self._read = {_identity(status) for path in inputs if (status := _status(path))}
        self._files: dict[object, Path] = {}
        self._above: set[str] = set()
        for path in directories:
            place = os.path.realpath(path)
            self._above |= {_spelling(place), *_above(place)}

    def add(self, path: Path) -> Target:
        """Return where an output goes.

        Raises
        ------
        InputError
            It cannot be what it is to be.
        OSError
            Its name is too long, or a loop of symbolic links.
        """
        target = follow(path)
        if not target.regular:
            return target
        if target.status and _identity(target.status) in self._read:
            raise InputError("would be written over the input", file=path)
        above = set(_above(target.place))
        keys = _keys(target)
        if any(key in self._files for key in keys):
            raise InputError("another result has this name", file=path)
        under = next((self._files[each] for each in above if each in self._files), None)
        if under or keys[0] in self._above:
            raise InputError("a directory for other results has this name", file=under or path)
        self._files |= dict.fromkeys(keys, path)
        self._above |= above
        return target


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path], directories: Iterable[Path] = ()) -> None:
    """Let a :class:`Guard` look at outputs before anything is computed."""
    guard = Guard(inputs, directories)
    for path in outputs:
        guard.add(path)


def _keys(target: Target) -> list[object]:
    """Return what two targets that are one have in common."""
    spelling = _spelling(target.place)
    return [spelling, _identity(target.status)] if target.status else [spelling]


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
