"""The files of GIANT (Elassal and Malhotra, NOAA 1987): COMMON, CAMERAS, IMAGES, FRAMES and GROUND."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.arguments.annotations import check_arguments
from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.giant.cameras import Camera
    from photogram.giant.common import Common
    from photogram.giant.diagnostics import ErrorWarning, error_warnings
    from photogram.giant.frames import Frame
    from photogram.giant.ground import GroundPoint
    from photogram.giant.images import ImageFrame
    from photogram.giant.limits import Limits
    from photogram.giant.printout.listing import listing
    from photogram.giant.project import Project, read_project, write_project

__all__ = [
    "Camera",
    "Common",
    "ErrorWarning",
    "Frame",
    "GroundPoint",
    "ImageFrame",
    "Limits",
    "Project",
    "error_warnings",
    "listing",
    "read_project",
    "write_project",
]

_HOMES = {
    "Camera": "cameras",
    "Common": "common",
    "error_warnings": "diagnostics",
    "ErrorWarning": "diagnostics",
    "Frame": "frames",
    "GroundPoint": "ground",
    "ImageFrame": "images",
    "Limits": "limits",
    "listing": "printout.listing",
    "Project": "project",
    "read_project": "project",
    "write_project": "project",
}
"""The module of each name, loaded when it is first asked for."""

WAYS = {"check_of": ("checking",)}
"""The file that says how a project is diagnosed: see `photogram.show.methods`."""

__getattr__, __dir__ = on_demand(
    __name__, _HOMES, check_arguments, unchecked={"ErrorWarning", "ImageFrame", "Project"}
)
