"""Bundler: `bundle.out`, with the names of photos in `list.txt` beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from photogram.errors import InputError
from photogram.formats.collections import cannot_hold, collection_of, project_of
from photogram.formats.format import Format, Wishes
from photogram.formats.project import Project
from photogram.io.files import read_lines
from photogram.io.packed_numbers import pieces

TITLE = "Bundle file"
FILE, LIST = "bundle.out", "list.txt"


def _place(path: Path) -> Path:
    return path / FILE if path.is_dir() else path


def _recognises(path: Path) -> bool:
    place = _place(path)
    if not place.is_file():
        return False
    try:
        return next(pieces(place), b"").startswith(b"# Bundle file")
    except InputError:
        return False


def read(path: Path, wishes: Wishes) -> Project:
    """Read a Bundle file of version 0.3, and the list of photos beside it."""
    from photogram.collection.formats import bundler

    del wishes
    place = _place(path)
    found = bundler.FORMAT.read(place, pieces(place))
    count = len(found.photo_parameters)
    names = [str(row) for row in range(count)]
    beside = place.parent / LIST
    if beside.is_file():
        lines = [line.rsplit(" 0 ", 1)[0].strip() for line in read_lines(beside) if line.strip()]
        if len(lines) != count:
            raise InputError(f"names {len(lines)} photos, but {place.name} has {count}", file=beside)
        if len(set(lines)) < count or not all(line.isprintable() for line in lines):
            raise InputError("names a photo twice, or with characters that do not print", file=beside)
        names = lines
    return project_of(found, place, TITLE, names)


def write(project: Project) -> Mapping[str, bytes]:
    """Return `bundle.out` and `list.txt`."""
    from photogram.collection.formats import bundler

    found, names = collection_of(project)
    return {FILE: bundler.FORMAT.to_bytes(found), LIST: "".join(f"{name}\n" for name in names).encode()}


FORMAT = Format(
    name="bundler",
    title=TITLE,
    recognises=_recognises,
    read=read,
    write=write,
    files=(FILE, "*.out"),
    cannot_hold=cannot_hold,
    pixels=True,
)
