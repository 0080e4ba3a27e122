"""Formats of cameras alone, which are written from any project, and not read."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType

from photogram.errors import InputError
from photogram.formats.format import Format, Wishes, later
from photogram.formats.project import Project

__all__ = ["FORMATS_OF_CAMERAS"]


def _written(name: str, project: Project) -> Mapping[str, bytes]:
    from photogram.formats.targets.cameras import rig_of_project
    from photogram.targets.output.formats import CAMERA_FORMATS

    return CAMERA_FORMATS[name](rig_of_project(project))


def _unread(path: Path, wishes: Wishes) -> Project:
    """Refuse to read what has cameras alone."""
    del wishes
    raise InputError("has cameras alone, and no photos", file=path)


FORMATS_OF_CAMERAS: Mapping[str, Format] = MappingProxyType(
    {
        name: Format(
            name=name,
            title=title,
            recognises=lambda _: False,
            read=_unread,
            write=partial(_written, name),
            cannot_hold=later("photogram.formats.targets.cameras", "lost_beside_cameras"),
            pixels=True,
            geographic=True,
        )
        for name, title in (
            ("opencv_yaml", "YAML of OpenCV"),
            ("ros_camera_info", "camera_info of ROS"),
            ("kalibr_camchain", "camchain.yaml of Kalibr"),
            ("mrcal", "a .cameramodel of mrcal"),
        )
    }
)
"""By name, as `photogram.targets.camera_files` has them."""
