"""Finding the files of a project."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from photogram.errors import InputError
from photogram.words import phrase

NAMES = ("COMMON", "CAMERAS", "IMAGES", "FRAMES", "GROUND")
"""The input files; they are found in any letter case and with any one extension."""


def present_files(directory: Path) -> dict[str, list[Path]]:
    """Return the files in a directory that could be each of `NAMES`."""
    found: dict[str, list[Path]] = {name: [] for name in NAMES}
    try:
        entries = sorted(directory.iterdir())
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(phrase("giant.folder", reason=reason), file=directory) from None
    for entry in entries:
        name = project_name(entry)
        # A link that leads nowhere or round in a loop is meant to be the file: reading it says what it is.
        if name and (entry.is_file() or (entry.is_symlink() and not entry.exists())):
            found[name].append(entry)
    return found


def project_name(path: Path) -> str | None:
    """Return which file of a project this would be by its name; None for another file."""
    name = path.stem.upper()
    return name if name in NAMES else None


def find_files(directory: Path) -> dict[str, Path]:
    """Find the five input files of a project."""
    files: dict[str, Path] = {}
    for name, candidates in present_files(directory).items():
        if not candidates:
            raise InputError(phrase("giant.missing", name=name, lower=name.lower()), file=directory)
        if len(candidates) > 1:
            names = [candidate.name for candidate in candidates]
            raise InputError(phrase("giant.several", name=name, names=names), file=directory)
        files[name] = candidates[0]
    return files


def written(name: str, writer: Callable[[], list[str]]) -> list[str]:
    """Return the records that a writer makes."""
    try:
        return writer()
    except ValueError as error:
        raise InputError(phrase("giant.not-written", name=name, error=str(error))) from None


def to_bytes(records: Iterable[str]) -> bytes:
    """Return records as the bytes of a text file."""
    return "\n".join([*records, ""]).encode()
