"""What a format is: how its files are known, and how projects are read from them and written to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from photogram.formats.columns import PLAIN, Columns
from photogram.formats.project import Project
from photogram.lazy_dataclasses import dataclass, field
from photogram.results.result import Result
from photogram.words import Phrase

__all__ = ["Format", "GnssFile", "PhotoFiles", "Wishes", "later"]


def later(module: str, name: str) -> Callable[..., Any]:
    """Return a call of a function whose module is loaded when it is called: most projects have one format."""

    def call(*arguments: Any) -> Any:
        return getattr(import_module(module), name)(*arguments)

    return call


@dataclass(frozen=True)
class PhotoFiles:
    """A folder of photographs, and what a user says of the positions that its files carry.

    Attributes
    ----------
    directory
        The folder.
    crs
        The system of positions whose source does not say it, or not what heights are above (EXIF).
    mrk_antenna
        Whether positions of .MRK files are those of the antenna.
    """

    directory: Path
    crs: str | None = None
    mrk_antenna: bool = False


@dataclass(frozen=True)
class GnssFile:
    """A file with positions of photos, and what a user specifies about them.

    Attributes
    ----------
    path
        A table of photo, x, y, z, a geolocation file of Pix4D, a reference of Metashape, `geo.txt` of
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
    """What a user says of files that do not say it themselves.

    Attributes
    ----------
    cameras
        A table of cameras (that of the plain project) for formats without; None: those of the files.
    pixel_origin
        `corner` or `center` of the first pixel is 0, 0, in tables of pixels; None: as the format has it.
    model
        Which of several models of one file, counted from 0; None: the largest.
    angles
        `deg`, `gon` or `rad` where a file has angles and does not say which.
    sd
        Standard deviations by table where files have none: one number or three.
    columns
        What the columns of the control of a plain project are.
    photos
        Where its photographs lie, whose files carry positions; None: as the project says.
    gnss
        A file with positions of photos, which become observations; None: without.
    cubes
        The list of cubes or ISDs of a control network.
    jigsaw
        How a control network is adjusted: settings by the names of jigsaw, or the path of a file with them.
    settings
        What the settings of a plain project say otherwise: `section.key=value`.
    """

    cameras: Path | None = None
    pixel_origin: str | None = None
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
        As commands and functions take it.
    title
        As people are told what lies there.
    recognises
        Whether what lies at a path is meant for one; it reads no more than the beginning of a file.
    read
        A project. Raises `InputError` that names file, record and what stands there, and nothing else.
    write
        The files of a project, by their names below a directory; None where the format is only read.
    cannot_hold
        Parts of a project that the format cannot contain.
    results
        Files with what an adjustment found that go beside an adjusted project in the format; None: none.
    files
        The file that is written, the first of them where there are several, and patterns of the names by
        which a user may say the format; empty for a format that is a folder.
    pixels
        Whether its images are pixels: what is written is in pixels, whatever the project has.
    geographic
        Whether it holds longitudes and latitudes; what is written in others is in a topocentric frame.
    folders
        Names of folders that say the format, beside its own name.
    adjusting
        Makes of a call that adjusts a block once, with options by name, what adjusts the block of a project
        in the format as that asks for; None: once is all.
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
