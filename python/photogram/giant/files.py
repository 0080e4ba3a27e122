"""Search for the files of a project."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from photogram.errors import InputError
from photogram.words import phrase

NAMES = ("COMMON", "CAMERAS", "IMAGES", "FRAMES", "GROUND")
"""The input files; letter case and extension are ignored."""


def present_files(directory: Path) -> dict[str, list[Path]]:
    """Return the candidates in a directory for each of `NAMES`."""
    found: dict[str, list[Path]] = {name: [] for name in NAMES}
    try:
        entries = sorted(directory.iterdir())
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(phrase("giant.folder", reason=reason), file=directory) from None
    for entry in entries:
        name = project_name(entry)
        # A broken or circular link counts as the file: the reader reports its error.
        if name and (entry.is_file() or (entry.is_symlink() and not entry.exists())):
            found[name].append(entry)
    return found


def project_name(path: Path) -> str | None:
    """Return the project file that a file name denotes; None for another file."""
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
    """Return the records of a writer; its errors name the file."""
    try:
        return writer()
    except ValueError as error:
        raise InputError(phrase("giant.not-written", name=name, error=str(error))) from None


def to_bytes(records: Iterable[str]) -> bytes:
    """Return records as the bytes of a text file."""
    return "\n".join([*records, ""]).encode()
