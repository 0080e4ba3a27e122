"""Marks of sets of files that were not all put in place: a run was killed, or could not undo what it did."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from photogram.io.writing.staging import NEW, Staging, alive, sync_directory
from photogram.io.writing.targets import naming

__all__ = ["clear_marks", "doubtful", "mark", "unmark"]

NAME = re.compile(r"photogram-incomplete-([0-9a-f]{16})\.txt")
TEXT = """\
The files named below belong together, and photogram was ended while it put them in place:
some may be those of an earlier run. Run the command again; this file goes when all of those
that stand in this directory have been written again, or remove it yourself.
"""


def mark(staging: Staging, places: Iterable[str]) -> None:
    """Put a mark into the directory of a set: from now on it may be incomplete."""
    lines = [json.dumps(os.path.relpath(place, staging.directory)) for place in places]
    content = (TEXT + "\n".join(lines) + "\n").encode()
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
    """Return the marks of dead runs in a directory, with the places that they name."""
    found = []
    with suppress(OSError):
        for name in sorted(os.listdir(directory)):
            match = NAME.fullmatch(name)
            if match and not alive(directory, match[1]):
                path = os.path.join(directory, name)
                found.append((path, _named(path, directory)))
    return found


def _named(path: str, directory: str) -> set[str]:
    """Return the places that a mark names; what is none of its lines is passed over."""
    places = set()
    with suppress(OSError), open(path, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            with suppress(ValueError):
                name = json.loads(line)
                if isinstance(name, str):
                    places.add(os.path.normpath(os.path.join(directory, name)))
    return places
