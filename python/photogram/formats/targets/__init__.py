"""Corners of a board in images, in files of mrcal, OpenCV, Kalibr, or tables."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.format import Format, later

__all__ = ["FORMAT", "TITLE"]

TITLE = "corners of a board"


def _recognises(path: Path) -> bool:
    if (path / "project.toml").exists():
        return False
    from photogram.targets.corner_files import holds_targets

    return holds_targets(path)


FORMAT = Format(
    name="targets",
    title=TITLE,
    recognises=_recognises,
    read=later(f"{__name__}.calibrations", "read_project"),
)
