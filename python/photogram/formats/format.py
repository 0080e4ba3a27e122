"""Definition of a format: recognition, reader and writer of its files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from photogram.formats.columns import PLAIN, Columns
from photogram.formats.project import Project
from photogram.lazy_dataclasses import dataclass, field
from photogram.results.result import Result
from photogram.words import Phrase

__all__ = ["Format", "GnssFile", "PhotoFiles", "Wishes", "later"]


def later(module: str, name: str) -> Callable[..., Any]:
    """Return a function that imports its module at the first call."""

    def call(*arguments: Any) -> Any:
        return getattr(import_module(module), name)(*arguments)

    return call


@dataclass(frozen=True)
class PhotoFiles:
    """A folder of photographs, and user settings for the positions in its files.

    Attributes
    ----------
    directory
        The folder.
    crs
        System of positions if their source does not name it or the reference of its heights (EXIF).
    mrk_antenna
        Whether positions of .MRK files are antenna positions.
    """

    directory: Path
    crs: str | None = None
    mrk_antenna: bool = False


@dataclass(frozen=True)
class GnssFile:
    """A file with positions of photos, and user settings for them.

    Attributes
    ----------
    path
        A table of photo, x, y, z. Or a geolocation file of Pix4D, a reference of Metashape, `geo.txt` of
        OpenDroneMap, an .MRK file of DJI, or events of RTKLIB (`*_events.pos`).
    crs
        The system of positions if the file does not name it; None: the frame of the project.
    antenna
        x, y, z of the antenna in the axes of the photo (right, up, back towards the viewer) from the
        projection centre, and one standard deviation of them (0: fixed; `inf`: free), metres; None: positions
        are projection centres.
    mrk_antenna
        Whether positions of .MRK files are antenna positions.

    Examples
    --------
    >>> from pathlib import Path
    >>> from photogram.formats import GnssFile, Wishes
    >>> Wishes(gnss=GnssFile(Path("geo.txt"), antenna=(0.0, 0.08, 0.1, 0.01))).gnss.crs is None
    True
    """

    path: Path
    crs: str | None = None
    antenna: tuple[float, float, float, float] | None = None
    mrk_antenna: bool = False


@dataclass(frozen=True)
class Wishes:
    """User settings that complete the contents of files.

    Attributes
    ----------
    cameras
        Camera table (as in the plain project) for formats without cameras; None: cameras of the files.
    pixel_origin
        `corner` or `center` of the first pixel is 0, 0 in tables of pixels; None: as defined by the format.
    model
        Index of the model in a file with several, from 0; None: the largest.
    angles
        `deg`, `gon` or `rad`, for files that do not specify the unit of their angles.
    sd
        Standard deviations by table for files without them: one number or three.
    columns
        Meaning of the columns of the control table of a plain project.
    photos
        Folder of its photographs with positions; None: as in the project.
    gnss
        A file with positions of photos, which become observations; None: without.
    cubes
        The list of cubes or ISDs of a control network.
    jigsaw
        Adjustment settings of a control network by names of jigsaw, or the path of a file with them.
    settings
        Settings that replace settings of a plain project: `section.key=value`.
    """

    cameras: Path | None = None
    pixel_origin: Literal["corner", "center"] | None = None
    model: int | None = None
    angles: str | None = None
    sd: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    columns: Columns = PLAIN
    photos: PhotoFiles | None = None
    gnss: GnssFile | None = None
    cubes: Path | None = None
    jigsaw: str | None = None
    settings: Sequence[str] = ()


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
        Function that returns a project. Its only error is `InputError`, with file, record and text.
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
    recognises: Callable[[Path], bool]
    read: Callable[[Path, Wishes], Project]
    write: Callable[[Project], Mapping[str, bytes]] | None = None
    cannot_hold: Callable[[Project], Sequence[Phrase | str]] = lambda _: ()
    results: Callable[[Project, Result], Mapping[str, bytes]] | None = None
    files: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()
    pixels: bool = False
    geographic: bool = False
    adjusting: Callable[[Project, Callable[..., Result]], Callable[..., Result]] | None = None
    holds: frozenset[str] | None = None
