"""Corners of a board in pictures, in files of mrcal, OpenCV, Kalibr, or tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.formats.format import Format, Wishes
from photogram.formats.project import Project
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.targets.calibrated import Calibrated
from photogram.targets.calibration import Calibration
from photogram.targets.reading import holds_targets, read

__all__ = ["FORMAT", "TITLE", "adjusted_project", "project_of"]

TITLE = "corners of a board"
MIDDLE = 0.5
"""Of the first pixel, from the upper-left corner: projects count from there."""


def project_of(calibration: Calibration, path: Path | None = None) -> Project:
    """Return a calibration as a project, whose pixels count from the upper-left corner of the first."""
    block, lacks = from_corner(calibration.block()), []
    if calibration.sd0 is None:
        lacks.append("no standard deviations of corners: 1 px is assumed (--sd images=...)")
    return Project(
        block=block,
        path=path or Path("corners"),
        title=TITLE,
        sizes=tuple(calibration.corners.sizes),
        pixel_mm=(None,) * len(calibration.cameras),
        starts=np.asarray(block.point_positions),
        lacks=tuple(lacks),
        messages=tuple(calibration.messages),
    )


def from_corner(block: Block) -> Block:
    """Return a block whose pixels count from the middle of the first as one that counts from its corner."""
    return block.replace(cameras=[_shifted(each) for each in block.cameras], image_xy=block.image_xy + MIDDLE)


def adjusted_project(calibrated: Calibrated) -> Project:
    """Return what was adjusted as a project: free values where the adjustment has ended."""
    result = calibrated.result
    return project_of(calibrated.calibration).replace(
        block=from_corner(result.restarted()), starts=calibrated.points, lacks=()
    )


def _shifted(camera: Camera) -> Camera:
    """Return a camera whose principal point counts from the corner of the first pixel."""
    if "w" in camera.names:
        return camera  # from the middle of the picture, which is the same place
    centre = {name: camera.parameters[name] + MIDDLE for name in ("cx", "cy")}
    return camera.replace(parameters={**camera.parameters, **centre})


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
