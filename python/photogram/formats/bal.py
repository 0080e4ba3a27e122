"""Problems of "Bundle Adjustment in the Large"."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from photogram.errors import InputError
from photogram.formats.collections import cannot_hold, collection_of, project_of
from photogram.formats.format import Format, Wishes
from photogram.formats.project import Project
from photogram.io.packed_numbers import pieces

TITLE = 'problem of "Bundle Adjustment in the Large"'
FILE = "problem.txt"
_FIRST = re.compile(
    rb"[ \t]*[0-9]+[ \t]+[0-9]+[ \t]+[0-9]+[ \t\r]*\n[ \t]*[0-9]+[ \t]+[0-9]+[ \t]+\S+[ \t]+\S+"
)


def _recognises(path: Path) -> bool:
    if not path.is_file():
        return False
    try:
        return _FIRST.match(next(pieces(path), b"")[:1000]) is not None
    except InputError:
        return False


def read(path: Path, wishes: Wishes) -> Project:
    """Read a problem, packed by bzip2 or gzip or not; photos and points are called by their numbers."""
    from photogram.collection.formats import bal

    del wishes
    found = bal.FORMAT.read(path, pieces(path))
    return project_of(found, path, TITLE, [str(row) for row in range(len(found.photo_parameters))])


def write(project: Project) -> Mapping[str, bytes]:
    """Return the file of a problem."""
    from photogram.collection.formats import bal

    return {FILE: bal.FORMAT.to_bytes(collection_of(project)[0])}


FORMAT = Format(
    name="bal",
    title=TITLE,
    recognises=_recognises,
    read=read,
    write=write,
    files=(FILE, "problem-*.txt", "*.bal"),
    cannot_hold=cannot_hold,
    pixels=True,
)
