"""PhotoModeler and DBAT: export files, scripts and tables."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.dbat.export import is_export, read_export
from photogram.formats.dbat.script import (
    is_folder,
    is_measurements,
    read_folder,
    read_measurements,
    read_script,
)
from photogram.formats.format import Format
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.formats.xml_stream import root_of

__all__ = ["FORMAT"]

_EXPORTS = "*-pmexport.txt"


def _is_script(path: Path) -> bool:
    root, attributes = root_of(path)
    return root == "document" and "dbat_script_version" in attributes


def _the_file(path: Path) -> Path | None:
    """Return the only script of a folder, else the only export file."""
    scripts = [each for each in sorted(path.glob("*.xml")) if _is_script(each)]
    for found in (scripts, sorted(path.glob(_EXPORTS))):
        if len(found) == 1:
            return found[0]
    return None


def _recognises(path: Path) -> bool:
    if path.is_dir():
        return is_folder(path) or _the_file(path) is not None
    return _is_script(path) or is_export(path) or is_measurements(path)


def read(path: Path, options: ReadOptions) -> Project:
    """Read an export file or tables of PhotoModeler, a DBAT script or its tables."""
    if path.is_dir():
        path = _the_file(path) or path
    if path.is_dir():
        take = read_folder
    elif path.suffix.lower() == ".xml":
        take = read_script
    else:
        take = read_measurements if is_measurements(path) else read_export
    return take(path, options).dbat_project(options)


FORMAT = Format(name="dbat", title="PhotoModeler or DBAT block", recognises=_recognises, read=read)
