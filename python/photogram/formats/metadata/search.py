"""Search of a folder of photographs for positions, matched to photos."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath

from photogram.errors import InputError
from photogram.formats.metadata.pictures import ENDINGS, said_by_picture
from photogram.formats.metadata.record import Exposure, Said, number_of, prefix_of, read_exposures
from photogram.formats.metadata.reference import GEO_TXT, is_reference, read_geo_txt, read_reference
from photogram.formats.plain.schema import TABLES
from photogram.io.files import reading
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.words import phrase

_TEXTS = (".csv", ".txt")
EXPOSURES = ".mrk"


@dataclass
class Found:
    """Metadata of each photo by relative path, and the files read.

    `said` contains its sources in order of priority; `flights` its folder, and its .MRK file if the folder
    has several.
    """

    said: dict[str, list[Said]] = field(default_factory=dict)
    flights: dict[str, str] = field(default_factory=dict)
    tables: list[Path] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)


def found_in(directory: Path, *, antenna: bool) -> Found:
    """Read all files with photo positions in a folder and its subfolders.

    If `antenna`, positions of .MRK files are antenna positions.
    """
    with reading(directory):
        if not directory.is_dir():
            raise InputError(phrase("photos.folder"), file=directory)
        files = list(files_of(directory))
    found = Found()
    pictures = {_key(directory, path): path for path in files if path.suffix.lower() in ENDINGS}
    found.pictures = list(pictures.values())
    given = _tables(directory, files, found)
    exposures = {path: read_exposures(path) for path in files if path.suffix.lower() == EXPOSURES}
    found.tables += exposures
    if not (pictures or given or exposures):
        raise InputError(
            phrase("photos.sources", names=[*ENDINGS, "*_Timestamp.MRK", GEO_TXT]), file=directory
        )
    for key in dict.fromkeys([*pictures, *given]):
        found.said[key] = [given[key]] if key in given else []
        folder = PurePosixPath(key).parent.as_posix()
        found.flights[key] = directory.resolve().name if folder == "." else folder
    _add_exposures(directory, exposures, found, antenna=antenna)
    for key, path in pictures.items():
        found.said[key] += said_by_picture(path)
    return found


def files_of(directory: Path) -> Iterator[Path]:
    """Yield the visible files of a folder and its subfolders in order."""
    for folder, folders, names in os.walk(directory):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        yield from (Path(folder) / name for name in sorted(names) if not name.startswith("."))


def _key(directory: Path, path: Path) -> str:
    return path.relative_to(directory).as_posix()


class Photos:
    """Lookup of photos of a folder by relative path or name."""

    def __init__(self, keys: Iterable[str]) -> None:
        self._known: tuple[dict[str, list[str]], ...] = ({}, {}, {})
        for key in keys:
            path = PurePosixPath(key)
            for names, name in zip(self._known, (key, path.name, path.stem.casefold()), strict=True):
                names.setdefault(name, []).append(key)

    def meant(self, name: str, folder: str = ".") -> list[str]:
        """Return photos of a folder by path, otherwise file name, otherwise stem."""
        path = PurePosixPath(name.replace("\\", "/"))
        paths, names, stems = self._known
        tried = (
            paths.get((PurePosixPath(folder) / path).as_posix()),
            names.get(path.name),
            stems.get(path.stem.casefold()),
            stems.get(path.name.casefold()),  # A name without suffix that contains a dot
        )
        for keys in tried:
            inside = [each for each in keys or () if PurePosixPath(each).is_relative_to(folder)]
            if inside:
                return inside
        return []


def _tables(directory: Path, files: Sequence[Path], found: Found) -> dict[str, Said]:
    """Return metadata of geo.txt (with priority) and reference tables."""
    photos = Photos(_key(directory, path) for path in found.pictures)
    texts = [path for path in files if path.suffix.lower() in _TEXTS and path.stem not in TABLES]
    given: dict[str, Said] = {}
    again: dict[Path, int] = {}
    for path in sorted(texts, key=lambda each: (each.name.lower() != GEO_TXT, each)):
        if path.name.lower() == GEO_TXT:
            rows = read_geo_txt(path)
        elif is_reference(path, photos.meant if found.pictures else None):
            rows = read_reference(path, found.messages)
        else:
            continue
        found.tables.append(path)
        folder = _key(directory, path.parent)
        for name, said in rows.items():
            keys = photos.meant(name, folder)
            if len(keys) > 1:
                raise said.place.error(phrase("photos.ambiguous", photo=name, names=keys))
            key = keys[0] if keys else (PurePosixPath(folder) / name).as_posix()
            if given.setdefault(key, said) is not said:
                again[path] = again.get(path, 0) + 1
    for path, count in again.items():
        found.messages.append(Message(phrase("photos.other-table", n=count), path))
    return given


def _add_exposures(
    directory: Path, exposures: Mapping[Path, Mapping[int, Exposure]], found: Found, *, antenna: bool
) -> None:
    """Add exposures of .MRK files to the photos of their folders."""
    of_folder: dict[str, list[Path]] = {}
    for path in exposures:
        of_folder.setdefault(_key(directory, path.parent), []).append(path)
    used: dict[Path, set[int]] = {path: set() for path in exposures}
    for key, sources in found.said.items():
        number, folder = number_of(PurePosixPath(key).stem), _nearest(key, of_folder)
        if number is None or folder is None:
            continue
        own = _of_flight(key, of_folder[folder], number, exposures)
        if own is None:
            continue
        if len(of_folder[folder]) > 1:
            found.flights[key] = f"{folder}/{prefix_of(own)}".removeprefix("./")
        if number in exposures[own]:
            sources.append(exposures[own][number].said(antenna))
            used[own].add(number)
    for path, numbers in used.items():
        if left := len(exposures[path]) - len(numbers):
            found.messages.append(Message(phrase("photos.unused", n=left, total=len(exposures[path])), path))


def _nearest(key: str, folders: Mapping[str, object]) -> str | None:
    """Return the folder of a photo, or its nearest parent, among some folders."""
    above = (each.as_posix() for each in PurePosixPath(key).parents)
    return next((each for each in above if each in folders), None)


def _of_flight(
    key: str, paths: Sequence[Path], number: int, exposures: Mapping[Path, Mapping[int, Exposure]]
) -> Path | None:
    """Return the .MRK file of a photo: the only one, or the one with its prefix."""
    if len(paths) == 1:
        return paths[0]
    named = [each for each in paths if PurePosixPath(key).name.startswith(f"{prefix_of(each)}_")]
    likely = named or [each for each in paths if number in exposures[each]]
    if len(likely) > 1:
        raise InputError(
            phrase("photos.flight", photo=key, names=[path.name for path in likely]), file=paths[0].parent
        )
    return likely[0] if likely else None
