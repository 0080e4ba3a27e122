"""The known formats, and the recognition of the format of a path."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from photogram.arguments.fields import options_of
from photogram.errors import InputError, PhotogramError
from photogram.formats.crs import plane_remarks
from photogram.formats.format import FORMATS, FORMATS_OF_CAMERAS, Format
from photogram.formats.models import (
    check_images,
    in_pixels,
    in_topocentric,
    lost,
    nominal_pixels,
    topocentric_remarks,
)
from photogram.formats.plain.statement_tables import parts_of_asked
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.formats.xml_stream import SUFFIXES, read_stream, root_of
from photogram.io.files import reading
from photogram.io.places import Place, at_place, one_word
from photogram.lazy_dataclasses import dataclass
from photogram.memory import give_back, turned
from photogram.results.result import Result
from photogram.words import Phrase, phrase

_TO_WRITE: Mapping[str, Format] = ChainMap(FORMATS_OF_CAMERAS, FORMATS)  # The order is that of FORMATS
SD = ("images", "control", "check", "gnss")
"""Types of data of any format to which the user may add standard deviations."""
MOST = 200  # Largest number of files that are examined in a folder without format
LARGE = 1_000_000  # Image observations from which memory of the reading is returned to the system


def recognised(path: Path) -> Format:
    """Return the format of a file or folder.

    Raises
    ------
    InputError
        If the path does not exist, its format is unknown, or fits several formats.
    """
    return _located(path)[0]


def _located(path: Path, file_format: str | None = None) -> tuple[Format, Path]:
    among = list(FORMATS.values()) if file_format is None else [_named(file_format)]
    with reading(path):
        path.stat()
        found = [(each, path) for each in among if each.recognises(path)]
        files = [path]
        if not found and path.is_dir():
            files = [each for each in sorted(path.iterdir())[:MOST] if each.is_file()]
            found = [(each, file) for file in files for each in among if each.recognises(file)]
    if len(found) == 1:
        return found[0]
    if file_format is not None:
        # The error of the reader describes the missing part best.
        return among[0], path
    if found:
        names = [f"{where.name}: --format {each.name}" for each, where in found]
        raise InputError(phrase("format.ambiguous", names=names), file=path)
    for file in files:
        if file.suffix.lower() in SUFFIXES and not (root := root_of(file)[0]):
            read_stream(file, {}, root)  # Its error names the syntax
    names = [f"{each.title} ({each.name})" for each in FORMATS.values()]
    of_folder = [each.title for each in FORMATS.values() if path.is_file() and each.recognises(path.parent)]
    code = "format.folder" if len(of_folder) == 1 else "format.unrecognised"
    raise InputError(phrase(code, names=names, title=of_folder[0] if of_folder else ""), file=path)


def read(path: Path, options: ReadOptions | None = None, **changes: Any) -> Project:
    """Read a project.

    Parameters
    ----------
    path
        A file or a folder, or a folder with a single file of a known format.
    options, changes
        Data that the files do not contain, and other user settings; fields of :class:`ReadOptions`.

    Raises
    ------
    InputError
        If the path cannot be read or contains something else. The error has file, record and text.
    """
    path = Path(path)
    options = options_of(ReadOptions, options, changes)
    chosen, path = _located(path, options.file_format)
    # Checks of arrays and coordinate systems do not report the file.
    with turned(f"reading {path}"), at_place(Place(path)):
        try:
            if options.settings and chosen.name != "plain":
                raise InputError(phrase("format.settings", title=chosen.title))
            if (kinds := [each for each in options.sd if each not in SD]) and chosen.name != "plain":
                raise InputError(phrase("format.kind", kind=kinds[0], title=chosen.title))
            assert chosen.read is not None  # Formats of cameras are not among the detected formats
            project = chosen.read(path, options)
            own = getattr(project.details.get("settings"), "photo_files", None)
            if options.photos_dir or options.gnss or own:
                from photogram.formats.metadata.adding import with_photo_positions

                project = with_photo_positions(project, options)
            planes = plane_remarks(project.block, path, project.starts)
            project = project.replace(messages=(*project.messages, *planes))
            if len(project.block.image_xy) > LARGE:
                give_back()
        except PhotogramError:
            raise
        except (ArithmeticError, LookupError, ValueError) as error:
            reason = f"{type(error).__name__}: {error}"
            raise InputError(phrase("format.value", title=chosen.title, reason=reason), file=path) from error
    if options == ReadOptions():
        return project
    from photogram.formats.supplements import supplemented

    return supplemented(project, options)


def to_files(project: Project, file_format: str) -> Mapping[str, bytes]:
    """Return the files of a project in a format, by name.

    Raises
    ------
    InputError
        If the format is unknown or read-only, or cannot represent the project.
    """
    chosen = _named(file_format, _TO_WRITE)
    if chosen.write is None:
        writable = [name for name, each in _TO_WRITE.items() if each.write]
        raise InputError(phrase("format.read-only", title=chosen.title, names=writable))
    if chosen.name != "plain":
        check_images(project.block, chosen.title)
    return chosen.write(_fitting(project, chosen))


def _fitting(project: Project, chosen: Format) -> Project:
    project = project if chosen.geographic else in_topocentric(project)
    return in_pixels(project) if chosen.pixels else project


@dataclass(frozen=True)
class Target:
    """Location and format for writing a project."""

    format: Format
    folder: Path  # Parent of its files
    file: str | None = None  # Name of the first file, if the user specifies it

    def files(self, project: Project) -> Mapping[Path, bytes]:
        """Return the files of a project by path, renamed as the first one."""
        found = to_files(project, self.format.name)
        if self.file is None:
            return {self.folder / name: content for name, content in found.items()}
        own, new = Path(self.format.files[0]), Path(self.file)
        alike = [name for name in found if Path(name).stem == own.stem]
        names = {name: f"{new.stem}{Path(name).suffix}" for name in alike} | {own.name: new.name}
        return {self.folder / names.get(name, name): content for name, content in found.items()}


def target(path: Path, file_format: str | None = None) -> Target:
    """Return location and format for the name of a file or folder to write.

    File names select a format (`bundle.out`, `*.im`), folder names too if they contain its name
    (`model-colmap`, `opensfm`, `sparse/0`). Other folders are plain projects.

    Parameters
    ----------
    path
        The name.
    file_format
        Name of the format; None: detected.

    Raises
    ------
    InputError
        If the name fits several formats.
    """
    path = Path(path)
    among = list(FORMATS.values()) if file_format is None else [_named(file_format, _TO_WRITE)]
    if not path.is_dir():
        exact = [each for each in among if each.files[:1] == (path.name,)]
        found = exact or [each for each in among if any(path.match(pattern) for pattern in each.files)]
        if len(found) > 1:
            names = [f"{each.title} (--to {each.name})" for each in found]
            raise InputError(phrase("format.target", names=names), file=path)
        if found:
            return Target(found[0], path.parent, path.name)
    if file_format is not None:
        return Target(among[0], path)
    name = path.parent.name if path.name.isdigit() else path.name
    called = [
        each
        for each in among
        if name in (each.name, *each.folders) or name.endswith(tuple(f"{mark}{each.name}" for mark in "-_."))
    ]
    # `_text` of colmap_text is not a separate word: the longest name is used.
    return Target(max(called, key=lambda each: len(each.name), default=FORMATS["plain"]), path)


def cannot_hold(project: Project, file_format: str) -> list[str]:
    """Return the parts of a project that a format cannot contain, in sentences; see :func:`losses`."""
    return [*map(str, losses(project, file_format))]


def losses(project: Project, file_format: str) -> list[Phrase | str]:
    """Return the parts of a project that a format cannot contain.

    Raises
    ------
    InputError
        If the project has line scanners, which only the plain project supports.
    """
    chosen = _named(file_format, _TO_WRITE)
    if chosen.name != "plain":
        check_images(project.block, chosen.title)
    found: list[Phrase | str] = [] if chosen.geographic else [*topocentric_remarks(project)]
    fitting = _fitting(project, chosen)
    found += [] if chosen.holds is None else lost(fitting, chosen.holds)
    found += chosen.cannot_hold(fitting)
    if chosen.name != "plain":
        moments = sum(each.moment is not None for each in project.block.observations)
        counts = (len(project.features), len(project.block.timed), moments)
        found += parts_of_asked(project.statement)
        parts = zip(("features", "trajectories", "moments"), counts, strict=True)
        found += [phrase(f"lost.{part}", n=n) for part, n in parts if n]
    return [*found, *(nominal_pixels(project) if chosen.pixels else [])]


def adjusting(project: Project, adjust: Callable[..., Result]) -> Callable[..., Result]:
    """Return a call that adjusts the block of a project as its files require.

    Parameters
    ----------
    project
        The project.
    adjust
        A call that adjusts a block once, with options by name: :func:`photogram.adjust`.

    Returns
    -------
    A call with the same arguments, which adjusts repeatedly if necessary; `adjust` itself if once is enough.
    """
    own = next((each for each in FORMATS.values() if each.title == project.title), None)
    return adjust if own is None or own.adjusting is None else own.adjusting(project, adjust)


def _named(file_format: str, among: Mapping[str, Format] = FORMATS) -> Format:
    return among[one_word(Place(), "format", file_format, among)]
