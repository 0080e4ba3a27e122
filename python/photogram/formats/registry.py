"""The formats that are known, and which of them lies at a path."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from photogram.errors import InputError, PhotogramError
from photogram.formats.format import Format, Wishes
from photogram.formats.planes import plane_remarks
from photogram.formats.project import Project
from photogram.io.files import reading
from photogram.memory import turned
from photogram.messages import listed

__all__ = ["FORMATS", "cannot_hold", "read", "recognised", "to_files"]

FORMATS: dict[str, Format] = {
    name: import_module(f"photogram.formats.{name}").FORMAT
    for name in (
        "plain",
        "colmap",
        "colmap_text",
        "opensfm",
        "blocks_exchange",
        "agisoft",
        "bundler",
        "bal",
        "pixels",
        "patb",
        "bingo",
        "giant",
    )
}
"""By name, in the order in which help lists them."""


def recognised(path: Path) -> Format:
    """Return the format of what lies at a path.

    Raises
    ------
    InputError
        Nothing lies there, it has no format that is known, or may be of several.
    """
    with reading(path):
        path.stat()
        found = [each for each in FORMATS.values() if each.recognises(path)]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(f"{each.title} (--format {each.name})" for each in found)
        raise InputError(f"may be read as {names}: say which", file=path)
    what = "folder holds" if path.is_dir() else "file is"
    titles = listed([f"{each.title} ({each.name})" for each in FORMATS.values()], len(FORMATS))
    raise InputError(f"the {what} none of the formats that are known: {titles}", file=path)


def read(path: Path, file_format: str | None = None, wishes: Wishes | None = None) -> Project:
    """Read a project.

    Parameters
    ----------
    path
        A file or a folder.
    file_format
        The name of its format; None: found out.
    wishes
        What the files do not say.

    Raises
    ------
    InputError
        The path cannot be read or holds something else; names file, record and what stands there.
    """
    path = Path(path)
    chosen = recognised(path) if file_format is None else _named(file_format)
    with turned(f"reading {path}"):
        try:
            project = chosen.read(path, wishes or Wishes())
            return project.replace(messages=(*project.messages, *plane_remarks(project)))
        except InputError as error:
            # What refuses arrays or systems of coordinates does not know where they came from.
            raise (error if error.file else InputError(error.message, file=path)) from None
        except PhotogramError:
            raise
        except (ArithmeticError, LookupError, ValueError) as error:
            # A reader has names for all that it expects; what it did not is still no bug of the user's.
            raise InputError(f"cannot be read as {chosen.title}: {error}", file=path) from error


def to_files(project: Project, file_format: str) -> Mapping[str, bytes]:
    """Return the files of a project in a format, by their names.

    Raises
    ------
    InputError
        There is no such format, it is only read, or it has no way to say what the project is.
    """
    chosen = _named(file_format)
    if chosen.write is None:
        writable = ", ".join(name for name, each in FORMATS.items() if each.write)
        raise InputError(f"{chosen.title} is only read; what can be written: {writable}")
    return chosen.write(project)


def cannot_hold(project: Project, file_format: str) -> list[str]:
    """Return what of a project a format has no place for, in sentences."""
    return _named(file_format).cannot_hold(project)


def _named(file_format: str) -> Format:
    if file_format not in FORMATS:
        raise InputError(f"format is one of {', '.join(FORMATS)}, not {file_format!r}")
    return FORMATS[file_format]
