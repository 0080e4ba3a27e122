"""Corners of a board in pictures, in files of mrcal, OpenCV, Kalibr, or tables."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.calibrations import TITLE, project_of
from photogram.formats.format import Format, Wishes
from photogram.formats.project import Project
from photogram.targets.reading import holds_targets, read

__all__ = ["FORMAT"]


def _read(path: Path, wishes: Wishes) -> Project:
    """Read corners, with first values: what is adjusted is the block of their calibration."""
    sd = wishes.sd.get("images")
    origin = wishes.pixel_origin or "center"
    found = read(path, sd0=None if sd is None else sd[0], pixel_origin=origin)
    return project_of(found, path)


FORMAT = Format(
    name="targets",
    title=TITLE,
    recognises=holds_targets,
    read=_read,
)
