"""The plain project: tables with a file of settings."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.format import Format
from photogram.formats.plain.reading import SETTINGS, read
from photogram.formats.plain.writing import cannot_hold, write

__all__ = ["FORMAT"]


def _recognises(path: Path) -> bool:
    return (path / SETTINGS).is_file() if path.is_dir() else path.suffix.lower() == ".toml"


FORMAT = Format(
    name="plain",
    title="plain project",
    recognises=_recognises,
    read=read,
    write=write,
    cannot_hold=cannot_hold,
    files=(SETTINGS, "*.toml"),
    geographic=True,
)
