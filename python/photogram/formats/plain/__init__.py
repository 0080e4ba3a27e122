"""The plain project: tables with a file of settings."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.format import Format, later

__all__ = ["FORMAT", "SETTINGS"]

SETTINGS = "project.toml"


def _recognises(path: Path) -> bool:
    return (path / SETTINGS).is_file() if path.is_dir() else path.suffix.lower() == ".toml"


FORMAT = Format(
    name="plain",
    title="plain project",
    recognises=_recognises,
    read=later(f"{__name__}.reading", "read"),
    write=later(f"{__name__}.writing", "write"),
    cannot_hold=later(f"{__name__}.writing", "cannot_hold"),
    files=(SETTINGS, "*.toml"),
    geographic=True,
)
