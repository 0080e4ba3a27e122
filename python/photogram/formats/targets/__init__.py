"""Corners of a board in images, in files of mrcal, OpenCV, Kalibr, or tables."""

from __future__ import annotations

from photogram.formats.format import Format, later
from photogram.targets.corner_files import holds_targets

__all__ = ["FORMAT", "TITLE"]

TITLE = "corners of a board"

FORMAT = Format(
    name="targets",
    title=TITLE,
    recognises=holds_targets,
    read=later(f"{__name__}.calibrations", "read_project"),
)
