"""Metadata of each photo of a folder, by priority of sources."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path, PurePosixPath

from photogram.arguments.arrays import by_key, natural_order, truth_value
from photogram.errors import InputError
from photogram.formats.cards import filled_lines
from photogram.formats.control import SYSTEMS
from photogram.formats.metadata.pictures import said_by_picture, time_of_picture
from photogram.formats.metadata.record import (
    ENDINGS,
    FIXED,
    GEO_TXT,
    Said,
    is_events,
    is_reference,
    number_of,
    prefix_of,
    read_events,
    read_exposures,
    read_geo_txt,
    read_reference,
)
from photogram.formats.plain.schema import TABLES
from photogram.io.files import reading
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message, coded
from photogram.show.judgement import remarks_section
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Facts, Section
from photogram.show.quantity import Table, column
from photogram.words import phrase

_TEXTS = (".csv", ".txt")
EXPOSURES = ".mrk"


@dataclass
class _Sources:
    """Metadata of each photo by relative path or name, and the files read.

    `said` contains its sources in order of priority; `flights` its folder, and its .MRK file if the folder
    has several.
    """

    path: Path
    said: dict[str, list[Said]] = field(default_factory=dict)
    flights: dict[str, str] = field(default_factory=dict)
    tables: list[Path] = field(default_factory=list)
    pictures: dict[str, Path] = field(default_factory=dict)
    messages: list[Message] = field(default_factory=list)

    def metadata(self) -> Metadata:
        """Return the record of each photo; the first source with a value has priority."""
        photos, low = {}, []
        for key, sources in self.said.items():
            position = next((each for each in sources if each.is_located), None)
            if position is None and any(each.position is not None for each in sources):
                low.append(key)
            deviations = next((each for each in sources if each.sd is not None), None)
            photos[key] = PhotoRecord(key, self.flights[key], position, deviations)
        pictures, remarks = tuple(self.pictures.values()), tuple(self.messages)
        if low:
            remarks += (Message.of("photos.heightless", self.path, n=len(low), names=low),)
        return Metadata(self.path, photos, tuple(self.tables), pictures, remarks)


def _files_of(directory: Path) -> dict[str, Path]:
    """Return the visible files of a folder and its subfolders, in order, by their relative paths."""
    found = {}
    for folder, folders, names in os.walk(directory):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        for path in (Path(folder) / name for name in sorted(names) if not name.startswith(".")):
            found[path.relative_to(directory).as_posix()] = path
    return found


def _with_suffix(files: Mapping[str, Path], *suffixes: str) -> dict[str, Path]:
    return {key: path for key, path in files.items() if path.suffix.lower() in suffixes}


class Photos:
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
        inside = ([key for key in keys or () if PurePosixPath(key).is_relative_to(folder)] for keys in tried)
        return next(filter(None, inside), [])


def _tables(files: Mapping[str, Path], found: _Sources) -> dict[str, Said]:
    """Return metadata of geo.txt (with priority) and reference tables."""
    photos = Photos(found.pictures)
    texts = {path: key for key, path in files.items() if path.stem not in TABLES}
    given: dict[str, Said] = {}
    again = Counter[Path]()
    for path in sorted(texts, key=lambda each: (each.name.lower() != GEO_TXT, each)):
        if path.name.lower() == GEO_TXT:
            rows = read_geo_txt(path)
        elif is_reference(path, photos.meant if found.pictures else None):
            rows = read_reference(path, found.messages)
        else:
            continue
        found.tables.append(path)
        folder = PurePosixPath(texts[path]).parent.as_posix()
        for name, said in rows.items():
            keys = photos.meant(name, folder)
            if len(keys) > 1:
                raise said.place.error(phrase("photos.ambiguous", photo=name, names=keys))
            key = keys[0] if keys else (PurePosixPath(folder) / name).as_posix()
            again[path] += given.setdefault(key, said) is not said
    found.messages += [Message.of("photos.other-table", path, n=n) for path, n in again.items() if n]
    return given


def _add_exposures(files: Mapping[str, Path], found: _Sources, *, antenna: bool) -> None:
    """Add exposures of .MRK files to the photos of their folders, or of subfolders without such files."""
    exposures = {path: read_exposures(path, antenna=antenna) for path in files.values()}
    found.tables += exposures
    used = {path: set[int]() for path in exposures}
    of_folder = by_key((PurePosixPath(key).parent.as_posix(), path) for key, path in files.items())
    for key, sources in found.said.items():
        photo = PurePosixPath(key)
        number = number_of(photo.stem)
        folder = next((each.as_posix() for each in photo.parents if each.as_posix() in of_folder), None)
        if number is None or folder is None:
            continue
        paths = of_folder[folder]
        if len(paths) > 1:
            # The file with the prefix of the photo, otherwise the one with its number.
            named = [each for each in paths if photo.name.startswith(f"{prefix_of(each)}_")]
            paths = named or [each for each in paths if number in exposures[each]]
            if len(paths) > 1:
                names = [path.name for path in paths]
                raise InputError(phrase("photos.flight", photo=key, names=names), file=paths[0].parent)
            if not paths:
                continue
            found.flights[key] = f"{folder}/{prefix_of(paths[0])}".removeprefix("./")
        if number in exposures[paths[0]]:
            sources.append(exposures[paths[0]][number])
            used[paths[0]].add(number)
    for path, numbers in used.items():
        found.messages += _unused(path, len(exposures[path]), len(numbers))


def _unused(path: Path, total: int, used: int) -> list[Message]:
    return [Message(phrase("photos.unused", n=total - used, total=total), path)] if used < total else []


WITHOUT = "without"


@dataclass(frozen=True)
class PhotoRecord:
    """Position and accuracy of one photo.

    Attributes
    ----------
    photo
        Path relative to the folder.
    flight
        Folder of the photo; if the folder has several .MRK files, also the name of its file.
    position
        Source of the position: position, system, flag, angles; None without a position.
    deviations
        Source of the standard deviations of east, north and height in metres; None without usable ones. It
        may differ from the source of the position.
    """

    photo: str
    flight: str
    position: Said | None
    deviations: Said | None

    @property
    def rtk(self) -> bool:
        """Whether a receiver with real-time corrections provided the accuracy."""
        source = self.deviations or self.position
        return source is not None and source.rtk


@dataclass(frozen=True, repr=False)
class Metadata(Documented):
    """Positions of photos from the metadata of a folder of photographs.

    Attributes
    ----------
    directory
        The folder, or the file with positions.
    photos
        Records by path relative to the folder, or by name in the file.
    tables, pictures
        Files that were read: tables and .MRK files, and image files (headers only).
    messages
        Remarks.
    """

    directory: Path
    photos: Mapping[str, PhotoRecord]
    tables: tuple[Path, ...]
    pictures: tuple[Path, ...]
    messages: tuple[Message, ...]

    def sources(self) -> dict[str, int]:
        """Count positions by source of their standard deviations, or without any."""
        located = [each for each in self.photos.values() if each.position is not None]
        return counts(each.deviations for each in located)

    def document(self) -> Document:
        """Return the document: files, sources of positions and standard deviations, flights."""
        records = list(self.photos.values())
        located = [each for each in records if each.position is not None]
        flights = by_key((each.flight, each) for each in located)
        positions, deviations = counts(each.position for each in records), self.sources()
        remarks = [*self.messages, *remarks_on(located)]
        numbers = {"pictures": len(self.pictures), "tables": len(self.tables), "photos": len(records)}
        files = [
            Fact("Folder", str(self.directory)),
            *(Fact.of(name.capitalize(), number) for name, number in numbers.items()),
            Fact("Positions", told(positions)),
            Fact("Standard deviations of positions", told(deviations)),
        ]
        columns = [
            column("flight", list(flights), "Flight", kind="name"),
            column("photos", [len(own) for own in flights.values()], "Photos"),
            column("rtk", [sum(each.rtk for each in own) for own in flights.values()], "Of RTK"),
        ]
        sections = [
            Section("read", "Read", [Facts("", files)]),
            Section.of(Table("flights", "Flights", columns)),
            remarks_section(remarks),
        ]
        members = {"path": str(self.directory), **numbers, "positions": positions, "position_sd": deviations}
        members["messages"] = coded(remarks)
        return Document("Positions of photographs", "", sections=sections, members=members)


def counts(sources: Iterable[Said | None]) -> dict[str, int]:
    """Return the number of records of each source; :data:`WITHOUT` without source."""
    return dict(Counter(WITHOUT if each is None else each.source for each in sources))


def told(sources: Mapping[str, int]) -> str:
    """Format counts of sources: 118 of .MRK, 2 of XMP, 1 without."""
    counts = [f"{count} of {name}" for name, count in sources.items() if name != WITHOUT]
    counts += [f"{sources[WITHOUT]} {WITHOUT}"] if WITHOUT in sources else []
    return ", ".join(counts) or "none"


def read_metadata(directory: str | os.PathLike[str], *, mrk_antenna: bool = False) -> Metadata:
    """Read positions and accuracies of photos from files of a folder.

    Sources are image headers (EXIF, XMP of DJI and Pix4D), `*_Timestamp.MRK`, `geo.txt`, references of
    Metashape and geolocations of Pix4D. The priority is geo.txt and references, .MRK, XMP, EXIF, separately
    for positions and standard deviations.

    Parameters
    ----------
    directory
        The folder.
    mrk_antenna
        Whether positions of .MRK files are antenna positions, which their offsets reduce to the camera.
        Original DJI files contain camera positions.

    Returns
    -------
    Positions in the systems of their sources; standard deviations in metres, always east, north, height.

    Raises
    ------
    InputError
        If the folder contains no metadata, a file is invalid, or pillow is not installed
        (`pip install 'photogram[photos]'`).

    Notes
    -----
    Section 6 of the specification of accuracy statements.
    """
    truth_value("mrk_antenna", mrk_antenna)
    directory = Path(directory)
    with reading(directory):
        if not directory.is_dir():
            raise InputError(phrase("photos.folder"), file=directory)
        files = _files_of(directory)
    found = _Sources(directory, pictures=_with_suffix(files, *ENDINGS))
    exposures = _with_suffix(files, EXPOSURES)
    given = _tables(_with_suffix(files, *_TEXTS), found)
    if not (found.pictures or given or exposures):
        names = [*ENDINGS, "*_Timestamp.MRK", GEO_TXT]
        raise InputError(phrase("photos.sources", names=names), file=directory)
    for key in dict.fromkeys([*found.pictures, *given]):
        found.said[key] = [given[key]] if key in given else []
        folder = PurePosixPath(key).parent.as_posix()
        found.flights[key] = directory.resolve().name if folder == "." else folder
    _add_exposures(exposures, found, antenna=mrk_antenna)
    for key, path in found.pictures.items():
        found.said[key] += said_by_picture(path)
    return found.metadata()


def remarks_on(records: Iterable[PhotoRecord]) -> list[Message]:
    """Return remarks on RTK solutions and accuracies of photos."""
    fixes: dict[str, list[str]] = {}
    remarks: dict[str, int] = {}
    for each in records:
        sources = [source for source in (each.deviations, each.position) if source is not None]
        if sources and (remark := sources[0].remark):
            remarks[remark] = remarks.get(remark, 0) + 1
        fix = next((source.fix for source in sources if source.fix), FIXED)
        if fix != FIXED:
            fixes.setdefault(fix, []).append(each.photo)
    found = [Message.of("photos.fix", fix=fix, n=len(names), names=names) for fix, names in fixes.items()]
    return found + [Message.of("photos.remark", remark=text, n=count) for text, count in remarks.items()]


MAX_INTERVAL_DIFFERENCE = 2.0  # Seconds; EXIF has whole seconds


def read_gnss_file(
    path: Path, photos: Sequence[str], directory: Path | None = None, *, mrk_antenna: bool = False
) -> Metadata:
    """Read the positions of a file by the names of photos.

    `directory`: folder of all photographs; None: the photos of the project. The order of photos assigns
    events to them. `mrk_antenna`: whether positions of .MRK files are antenna positions.
    """
    found = _Sources(path, tables=[path])
    first = next((place.text or "" for place in filled_lines(path)), "").strip()
    if path.suffix.lower() == EXPOSURES:
        exposures = read_exposures(path, antenna=mrk_antenna)
        if not exposures:
            raise InputError(phrase("format.missing", what="exposures"), file=path)
        names: dict[int, str] = {}
        for photo in photos:
            number = number_of(PurePosixPath(photo).stem)
            if number is not None and number in exposures and names.setdefault(number, photo) != photo:
                fields = {"number": number, "names": [names[number], photo]}
                raise InputError(phrase("photos.exposure", **fields), file=path)
        if not names:
            raise InputError(phrase("photos.numbers", numbers=list(exposures), names=list(photos)), file=path)
        found.messages += _unused(path, len(exposures), len(names))
        said: Mapping[str, Said] = {photo: exposures[number] for number, photo in names.items()}
    elif is_events(path):
        said = _of_events(path, photos, directory)
    elif first.upper().startswith(SYSTEMS):
        said = read_geo_txt(path)
    elif is_reference(path):
        said = read_reference(path, found.messages)
    else:
        raise InputError(phrase("photos.positions"), file=path)
    found.said, found.flights = {name: [one] for name, one in said.items()}, dict.fromkeys(said, path.stem)
    return found.metadata()


def _of_events(path: Path, photos: Sequence[str], directory: Path | None) -> Mapping[str, Said]:
    """Return events by photo, matched in order of time, or in order of photo names."""
    events = read_events(path)
    pictures = {} if directory is None else _with_suffix(_files_of(directory), *ENDINGS)
    names = sorted(photos if directory is None else pictures, key=natural_order)
    times = {name: time for name in pictures if (time := time_of_picture(pictures[name])) is not None}
    if len(times) == len(names):
        names.sort(key=times.__getitem__)
    if len(names) != len(events):
        counts = {"events": len(events), "photos": len(names)}
        source = phrase("photos.project") if directory is None else directory.name
        raise InputError(phrase("photos.events-count", **counts, source=source), file=path)
    if len(times) == len(names):
        for (first, second), (before, after) in zip(pairwise(events), pairwise(names), strict=True):
            elapsed, taken = second[0] - first[0], times[after] - times[before]
            if abs(elapsed - taken) > MAX_INTERVAL_DIFFERENCE:
                fields = {"elapsed": elapsed, "photo": after, "taken": taken}
                raise second[1].place.error(phrase("photos.interval", **fields))
    return {name: said for name, (_, said) in zip(names, events, strict=True)}
