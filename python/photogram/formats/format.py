"""Formats of projects, as declared in `formats.csv`.

Each row declares a format: the attributes of :class:`Format`, with `MODULE:NAME` of this package for
functions, `pixels` and `geographic` in the column `coordinates`, and `all` for a format that contains all
parts of projects. Modules of readers and writers are imported at the first call.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from photogram.formats.declarations import declared
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.formats.project import Project
    from photogram.formats.read_options import ReadOptions
    from photogram.results.result import Result
    from photogram.words import Phrase


def later(home: str) -> Callable[..., Any]:
    """Return the function `MODULE:NAME`, whose module of this package is imported at the first call.

    Words after the name are its first arguments.
    """
    name, *words = home.split()
    return lambda *arguments: resolve_name(f"photogram.formats.{name}")(*words, *arguments)


@dataclass(frozen=True)
class Format:
    """A format of projects.

    Attributes
    ----------
    name
        Name in commands and functions.
    title
        Name in text for users.
    recognises
        Function of a path: whether it contains a project of the format. Reads only the start of a file.
    read
        Function that returns a project; None if the format is write-only. Its only error is `InputError`,
        with file, record and text.
    write
        Function that returns the files of a project by name relative to a directory; None if the format is
        read-only.
    cannot_hold
        Function that returns further parts of a project that the format cannot contain.
    results
        Function that returns files with adjustment results for the directory of an adjusted project; None:
        none.
    files
        The (first) file that is written, and patterns of names by which a user may select the format; empty
        for a format that is a folder.
    pixels
        Whether image coordinates are in pixels; coordinates in other units are converted.
    geographic
        Whether the format contains longitudes and latitudes; others receive a topocentric frame.
    folders
        Names of folders that select the format, in addition to its name.
    adjusting
        Function that converts a call that adjusts a block once, with options by name, to a call that adjusts
        a project as its format requires; None: the block is adjusted once.
    holds
        Capabilities: `names` of points, standard `deviations`, positions of `points`, the `frame` (only if
        it is `topocentric`), `lenses`, `shared-cameras`, `unknowns` of cameras, `control`, `gnss`, `rigs`,
        `boards`, and `unposed` photos. Other parts of projects are listed as lost; None: all parts are
        contained.
    """

    name: str
    title: str
    recognises: Callable[[Path], Any] = lambda _: False
    read: Callable[[Path, ReadOptions], Project] | None = None
    write: Callable[[Project], Mapping[str, bytes]] | None = None
    cannot_hold: Callable[[Project], Sequence[Phrase | str]] = lambda _: ()
    results: Callable[[Project, Result], Mapping[str, bytes]] | None = None
    files: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()
    pixels: bool = False
    geographic: bool = False
    adjusting: Callable[[Project, Callable[..., Result]], Callable[..., Result]] | None = None
    holds: frozenset[str] | None = None


def _declared() -> Iterator[Format]:
    functions = ("recognises", "read", "write", "cannot_hold", "results", "adjusting")
    for name, title, *homes, files, folders, coordinates, holds in declared(__file__, "formats.csv"):
        values: dict[str, Any] = dict.fromkeys(coordinates.split(), True)
        values |= {own: later(home) for own, home in zip(functions, homes, strict=True) if home}
        values |= {"files": tuple(files.split()), "folders": tuple(folders.split())}
        values["holds"] = None if holds == "all" else frozenset(holds.split())
        yield Format(name=name, title=title, **values)


_ALL = {each.name: each for each in _declared()}
FORMATS = {name: each for name, each in _ALL.items() if each.read is not None}
"""Formats of projects by name, in the order of the help."""
FORMATS_OF_CAMERAS = {name: own for name, own in _ALL.items() if name not in FORMATS}
"""Formats of cameras by name, as in `photogram.targets.camera_files`."""
